// Colour temperature, gels and shows in the page: mouse, keyboard, drop, a viewer, a narrow screen, a server that restarts.

import {mkdtempSync, readdirSync, readFileSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";

import {asked as tell, check, end, inBrowser, listen, screenshot, settled, sleep, startServer, state, until} from "./harness.mjs";

const folder = mkdtempSync(join(tmpdir(), "gonio-shows-"));
const shot = async (page, name) => { if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, `-${name}.png`)}); };
const light = async (page) => (await state(page)).lights[0];
const shown = (page) => page.evaluate(() => window.gonio.state.show);

async function colour(page) {
    const before = await settled(page);
    await page.locator(".chip[data-kelvin='3200']").first().click();
    await until("3200 K", async () => (await light(page)).cct_k === 3200);
    check(await page.locator("#cct-number").inputValue() === "3200", "a chip sets the colour temperature");
    check(await page.locator(".chip[data-kelvin='3200']").first().getAttribute("aria-pressed") === "true", "and says which one is on");
    await page.locator("#cct").focus();
    await page.keyboard.press("PageUp");
    const colder = await until("a colder white by key", async () => { const {cct_k} = await light(page); return cct_k > 3200 && cct_k; });
    check(colder > 3200 && colder < 15000, "the slider's keys make it colder", `${colder} K`);
    await page.locator("#cct-number").fill("500");
    await page.keyboard.press("Enter");
    await until("the nearest that there is", async () => (await light(page)).cct_k === 1000);
    await page.locator("#cct-number").fill("0");
    await page.keyboard.press("Enter");
    await until("none", async () => (await light(page)).cct_k === 0);
    check(true, "a typed one is bounded, and 0 is none");

    await until("gels", async () => (await page.locator("#gel option").count()) > 10);
    await page.locator("#gel").selectOption({label: await page.locator("#gel option", {hasText: "L201"}).textContent()});
    await until("the gel in the state", async () => (await light(page)).gel === "L201 Full C.T. Blue");
    const source = await page.locator(".gel-source").first().textContent();
    check(/LEE Filters/.test(source) && /35 % \/ 34 %/.test(source), "a gel is chosen and says its transmission and source", source);
    const behind = await settled(page);
    check(behind.mean < 0.9 * before.mean, "it takes its share of the light", `mean ${before.mean.toFixed(1)} -> ${behind.mean.toFixed(1)}`);
    await shot(page, "colour");
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+z");
    await until("no gel", async () => ((await light(page)).gel ?? "") === "");
    check(true, "Ctrl+Z takes the gel away");
}

// What somebody did before the page was loaded anew is undone by the same button.
async function reload(page) {
    const before = (await light(page)).level_ratio;
    await page.locator("#level-number").fill("42");
    await page.locator("#level-number").press("Enter");
    await until("the level", async () => (await light(page)).level_ratio === 0.42);
    await page.reload();
    await until("the step of before", () => page.locator("#undo").isEnabled());
    await page.locator("#undo").click();
    await until("the level of before", async () => (await light(page)).level_ratio === before);
    check(true, "undo goes on where the page is loaded again");
    await page.locator("#redo").click();
    await until("the level again", async () => (await light(page)).level_ratio === 0.42);
}

async function shows(page) {
    await until("that it is not saved", async () => await page.locator("#show-state").textContent() === "Not saved");
    await page.keyboard.press("Control+s");
    check(await page.locator("#show-dialog").isVisible(), "Ctrl+S asks for a name where there is none");
    check(await page.locator("#show-save").isDisabled(), "there is nothing to save it as yet");
    await page.locator("#show-save-as input").fill("../Act 1");
    await page.keyboard.press("Enter");
    await until("a refusal", () => page.locator("#show-dialog .problem").isVisible());
    check(/name of a show/.test(await page.locator("#show-dialog .problem").textContent()), "a path is no name", await page.locator("#show-dialog .problem").textContent());
    await page.locator("#show-save-as input").fill("Act 1");
    await page.keyboard.press("Enter");
    await until("the show in the list", () => page.locator("tr[data-show='Act 1']").isVisible());
    await until("that it is saved", async () => await page.locator("#show-state").textContent() === "" && (await shown(page)).name === "Act 1");
    check(readdirSync(join(folder, "shows")).join() === "Act 1.json", "the file is in the server's folder");
    await shot(page, "shows");
    await page.keyboard.press("Escape");
    check(await page.locator("#show-dialog").isHidden() && /Act 1/.test(await page.locator("#show-open").textContent()), "Escape closes; the bar has the name");

    await page.locator("#level-number").fill("30");
    await page.keyboard.press("Enter");
    await until("not saved again", async () => await page.locator("#show-state").textContent() === "Not saved");
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+s");
    await until("saved by key", async () => await page.locator("#show-state").textContent() === "");
    check(JSON.parse(readFileSync(join(folder, "shows", "Act 1.json"))).lights[0].level_ratio === 0.3, "Ctrl+S writes over the show at hand");

    // Another name for the file; a copy under the first one; the other one goes.
    const questions = [];
    page.on("dialog", (dialog) => { questions.push(dialog.message()); return dialog.accept(dialog.type() === "prompt" ? "Act 2" : undefined); });
    await page.locator("#show-open").click();
    await page.locator("button[aria-label='Rename Act 1']").click();
    await until("the new name", async () => (await shown(page)).name === "Act 2");
    await page.locator("button[aria-label='Rename Act 2']").click();    // to the name that it has
    await page.locator("#show-save-as input").fill("Act 1");
    await page.locator("#show-save-as input").press("Enter");
    await until("saved once more", async () => (await shown(page)).name === "Act 1");
    await page.locator("button[aria-label='Delete Act 2']").click();
    await page.locator("#show-dialog tr[data-show='Act 2']").waitFor({state: "detached"});
    check(questions.length === 3 && /Delete the show Act 2/.test(questions.at(-1)), "a show is renamed, and deleted when that is confirmed", questions.join(", "));
    questions.length = 0;
    await page.keyboard.press("Escape");

    // Another name, then the first one again; what is not saved is asked about.
    await page.locator("#level-number").fill("80");
    await page.keyboard.press("Enter");
    await page.locator("#show-open").click();
    const asked = page.locator("#unsaved-dialog");
    await page.locator("button[aria-label='Open Act 1']").click();
    await asked.waitFor();
    check(/Act 1 has changed/.test(await asked.textContent()), "what is not saved is asked about", await asked.textContent());
    await shot(page, "unsaved");
    await page.locator("#unsaved-cancel").click();
    await asked.waitFor({state: "detached"});
    check((await light(page)).level_ratio === 0.8, "Cancel changes nothing");
    await page.locator("button[aria-label='Open Act 1']").click();
    await page.locator("#unsaved-discard").click();
    await until("the level of the show", async () => (await light(page)).level_ratio === 0.3);
    check(await page.locator("#show-dialog").isHidden(), "a show is opened");
    await until("the step", async () => /open Act 1/.test(await page.locator("#undo").getAttribute("title")));
    await page.locator("#undo").click();
    await until("what was before", async () => (await light(page)).level_ratio === 0.8);
    check((await shown(page)).unsaved, "undo brings back what was not saved");
    await page.locator("#redo").click();
    await until("the show again", async () => (await light(page)).level_ratio === 0.3);

    // Another scene from the bar: saved first.
    await page.locator("#level-number").fill("45");
    await page.keyboard.press("Enter");
    await until("not saved", async () => (await shown(page)).unsaved);
    await page.locator("select[aria-label='Scene']").selectOption("atrium");
    await asked.waitFor();
    await page.locator("#unsaved-save").click();
    await until("the other scene", async () => (await state(page)).scene === "atrium");
    check(JSON.parse(readFileSync(join(folder, "shows", "Act 1.json"))).lights[0].level_ratio === 0.45, "it is saved, then the scene is loaded");
    await page.locator("#undo").click();
    await until("the scene before", async () => (await state(page)).scene === "cornell");
    check((await light(page)).level_ratio === 0.45 && !(await shown(page)).unsaved, "the scene comes back with its lights, saved as it is");
    await page.locator("#level-number").fill("30");
    await page.keyboard.press("Enter");
    await until("the level", async () => (await light(page)).level_ratio === 0.3);
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+s");
    await until("saved", async () => !(await shown(page)).unsaved);

    await page.locator("#show-open").click();
    const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#show-download").click()]);
    const file = join(folder, "downloaded.json");
    await download.saveAs(file);
    const text = readFileSync(file, "utf8");
    check(download.suggestedFilename() === "Act 1.json" && JSON.parse(text).lights[0].level_ratio === 0.3, "the show as it stands is downloaded");
    for (const [format, begins] of [["glb", "glTF"], ["mvr", "PK"]]) {
        const [scene] = await Promise.all([page.waitForEvent("download"), page.locator(`#scene-download-${format}`).click()]);
        await scene.saveAs(join(folder, `scene.${format}`));
        check(scene.suggestedFilename() === `cornell.${format}` && readFileSync(join(folder, `scene.${format}`), "latin1").startsWith(begins), `and the scene as .${format}`);
    }
    await page.keyboard.press("Escape");

    // Dropped onto the picture.
    const edited = JSON.parse(text);
    edited.lights[0].level_ratio = 0.55;
    await page.evaluate((content) => {
        const data = new DataTransfer();
        data.items.add(new File([content], "from elsewhere.json", {type: "application/json"}));
        for (const type of ["dragover", "drop"])
            document.querySelector("#canvas").dispatchEvent(new DragEvent(type, {dataTransfer: data, bubbles: true, cancelable: true}));
    }, JSON.stringify(edited));
    await until("the dropped show", async () => (await light(page)).level_ratio === 0.55);
    check((await shown(page)).unsaved && !(await shown(page)).name, "a dropped show is opened and is not saved yet");
    writeFileSync(join(folder, "broken.json"), "{");
    await page.locator("#show-open").click();
    await page.locator("input[aria-label='Show file to open']").setInputFiles(join(folder, "broken.json"));
    await page.locator("#unsaved-discard").click();
    await until("why not", () => page.locator("#show-dialog .problem").isVisible());
    check(/broken\.json/.test(await page.locator("#show-dialog .problem").textContent()) && (await light(page)).level_ratio === 0.55,
        "a broken file is refused by name and changes nothing", await page.locator("#show-dialog .problem").textContent());
    await page.locator("#show-save-as input").fill("Act 1");
    await page.keyboard.press("Enter");
    await until("the question", () => questions.length === 1);
    await until("written over", async () => (await shown(page)).name === "Act 1");
    check(/Write over it/.test(questions.at(-1)), "another show is written over only after a question", questions.at(-1));
    await page.keyboard.press("Escape");
}

// A gltf of one triangle with sides of 300 m, of which loading says that it is large.
const large = () => {
    const buffer = Buffer.from(new Float32Array([0, 0, 0, 300, 0, 0, 0, 300, 0]).buffer);
    return {asset: {version: "2.0"}, scenes: [{nodes: [0]}], nodes: [{mesh: 0}], meshes: [{primitives: [{attributes: {POSITION: 0}}]}],
        buffers: [{byteLength: buffer.length, uri: `data:application/octet-stream;base64,${buffer.toString("base64")}`}],
        bufferViews: [{buffer: 0, byteLength: buffer.length}], accessors: [{bufferView: 0, componentType: 5126, count: 3, type: "VEC3"}]};
};

// The question before a load: what the keys and the bar do meanwhile, what stays; then what the load says.
async function loads(page) {
    const asked = page.locator("#unsaved-dialog"), busy = page.locator("#scene .busy").first();
    await page.locator("#level-number").fill("35");
    await page.keyboard.press("Enter");
    await until("not saved", async () => (await shown(page)).unsaved);
    const before = await state(page);
    await page.locator("select[aria-label='Scene']").selectOption("atrium");
    await asked.waitFor();
    check(await busy.textContent() === "", "nothing is said to load while the question is open");
    for (const key of ["2", "Control+z", "Control+d", "Delete", "f", "?", "Control+s"]) {
        await page.evaluate(() => document.activeElement?.blur());
        await page.keyboard.press(key);
    }
    await sleep(300);
    const now = await state(page);
    check(now.scene_rev === before.scene_rev && await page.locator("dialog[open]").count() === 1, "keys of the page do nothing under a dialog", `${before.scene_rev}, ${now.scene_rev}`);
    await page.locator("#unsaved-keep").check();
    await page.locator("#unsaved-discard").click();
    await until("the other scene", async () => (await state(page)).scene === "atrium");
    const kept = await state(page);
    check(kept.lights.length === before.lights.length && kept.lights[0].name === before.lights[0].name && kept.lights[0].level_ratio === 0.35, "the lights stay where that is ticked");
    await page.locator("#scene-warned").focus();
    await page.keyboard.press("Enter");
    await page.locator("#scene-warnings").waitFor();
    check(/own luminaires are left out/.test(await page.locator("#scene-warnings").textContent()), "what was left out is told", await page.locator("#scene-warnings li").first().textContent());
    await page.keyboard.press("Escape");
    await page.locator("#undo").click();
    await until("the scene before", async () => (await state(page)).scene === "cornell");
    await until("its warnings", () => page.locator("#scene-warned").isHidden());

    // A light above the ceiling is among the warnings, which have the button that mends it.
    const hung = (await state(page)).lights[0];
    await tell(page, {command: {set_light: {name: hung.name, position_m: [0, 4.02, 0], aim: [0, -1, 0]}}});
    await until("the light above the ceiling", () => page.locator("#scene-warned").isVisible());
    await page.locator("#scene-warned").click();
    await page.locator("#scene-warnings .recess").click();
    await until("that it is mended", () => page.locator("#scene-warned").isHidden());
    check(Math.abs((await state(page)).lights[0].position[1] - 3.999) < 1e-4, "one click in the warnings recesses a hidden light");

    writeFileSync(join(folder, "large.gltf"), JSON.stringify(large()));
    await page.locator("input[aria-label='Scene file to upload']").setInputFiles(join(folder, "large.gltf"));
    await asked.waitFor();
    await page.locator("#unsaved-discard").click();
    await until("the upload", async () => (await state(page)).scene === "upload:large.gltf");
    await page.locator("#scene-warned").click();
    check(/m/.test(await page.locator("#scene-warnings li").first().textContent()), "one click opens the warnings of a load", await page.locator("#scene-warnings li").first().textContent());
    await shot(page, "warnings");
    await page.keyboard.press("Escape");
    check(await page.locator("#show-loose").isHidden(), "a show holds an upload");
    await page.locator("#undo").click();
    await until("the scene before", async () => (await state(page)).scene === "cornell");
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+s");
    await until("saved", async () => !(await shown(page)).unsaved);
}

// What the server says of a picture that fails, and of a scene that no show can hold: it is put into its messages here.
async function faults(browser, url) {
    const page = await browser.newPage();
    listen(page);
    await page.addInitScript(() => {
        const parse = JSON.parse;
        JSON.parse = (text, ...more) => {
            const read = parse(text, ...more);
            if (window.fault && read.state_changed?.state) Object.assign(read.state_changed.state, window.fault);
            return read;
        };
    });
    await page.goto(url);
    await until("the state", () => page.evaluate(() => window.gonio?.state?.show?.name));
    const tell = async (fault) => {
        await page.evaluate((told) => { window.fault = told; }, fault);
        await page.locator("#master input").first().focus();
        await page.keyboard.press("ArrowLeft");
    };
    check(await page.locator("#picture-error").isHidden() && await page.locator("#show-loose").isHidden(), "nothing is red while all is well");
    const {show} = await state(page);
    await tell({picture_error: "the GPU has no memory", show: {...show, not_held: true}});
    await until("that the picture fails", () => page.locator("#picture-error").isVisible());
    check(await page.locator("#picture-error").getAttribute("title") === "the GPU has no memory", "a picture that cannot be made is said, and why");
    const red = await page.locator("#picture-error").evaluate((node) => getComputedStyle(node).color);
    await page.locator("#show-loose").click();
    check(/more than 128 MiB/.test(await page.locator("#show-not-held").textContent())
        && await page.locator("#show-not-held").evaluate((node) => getComputedStyle(node).color) === red, "a scene that the show will not hold is said in red", await page.locator("#show-not-held").textContent());
    await shot(page, "not-held");
    await page.keyboard.press("Escape");
    await tell({picture_error: "", show: {...show, not_held: false}});
    await until("that all is well again", async () => await page.locator("#picture-error").isHidden() && await page.locator("#show-loose").isHidden());
    check(true, "and it goes with its cause");
    await page.close();
}

async function narrow(page) {
    await page.setViewportSize({width: 390, height: 800});
    await page.locator("#show-open").click();
    const box = await page.locator("#show-dialog").boundingBox();
    check(box.x >= 0 && box.x + box.width <= 390, "the dialog fits a screen of 390 pixels", `${box.x}..${box.x + box.width}`);
    await shot(page, "shows-390");
    await page.keyboard.press("Escape");
    await page.setViewportSize({width: 1280, height: 800});
}

async function viewer(browser, url) {
    const page = await browser.newPage();
    listen(page);
    await page.goto(`${url}/?role=viewer`);
    await until("the state", () => page.evaluate(() => window.gonio?.state?.show?.name));
    await page.locator("#show-open").click();
    await until("the list", () => page.locator("tr[data-show='Act 1']").isVisible());
    check(await page.locator("#show-dialog button", {hasText: /^(Save|Save as|Open|Rename|Delete)/}).count() === 0
        && await page.locator("button[aria-label='Download Act 1']").isVisible(), "a viewer lists and downloads, and neither saves nor opens");
    await page.close();
}

// Of twenty changes a second the newest are not in the state file, which is written once a second, when the server is killed.
async function restart(page, server, start) {
    const port = new URL(server.url).port;
    await page.evaluate((name) => {
        const socket = new WebSocket(`ws://${location.host}/v1/ws`, "gonio.v1.json");
        let i = 0;
        socket.onopen = () => {
            socket.send(JSON.stringify({identify: {client: "rider"}}));
            setInterval(() => socket.readyState === 1 && socket.send(JSON.stringify({command: {set_light: {name, level_ratio: 0.001 * (100 + ++i % 800)}}})), 50);
        };
    }, page.light);
    await sleep(3000);
    await end(server.child, "SIGKILL");
    await sleep(300);
    const seen = await page.evaluate(() => window.gonio.sceneRev);
    await start(`127.0.0.1:${port}`);
    await until("that something was lost", async () => /lost unsaved changes/.test(await page.locator("#show-lost").textContent()));
    const {restored_rev} = await state(page);
    check(restored_rev > 0 && restored_rev < seen, "a restart that lost something says so", `${await page.locator("#show-lost").textContent()}: ${restored_rev}, ${seen}`);
    await shot(page, "restart");
    await page.locator("button[aria-label='Dismiss what the restart lost']").click();
    check(await page.locator("#show-lost").textContent() === "", "until it is dismissed");
}

await inBrowser(async (browser, servers) => {
    const start = async (address) => {
        const server = await startServer(address, ["--state", join(folder, "state.json")]);
        servers.push(server);
        return server;
    };
    const server = await start("127.0.0.1:0");
    const page = await browser.newPage({viewport: {width: 1280, height: 800}});
    listen(page, (message) => /WebSocket connection to .* failed|ERR_CONNECTION_REFUSED/.test(message.text()));
    await page.goto(server.url);
    await until("a picture", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    page.light = (await light(page)).name;
    await colour(page);
    await reload(page);
    await shows(page);
    await loads(page);
    await faults(browser, server.url);
    await narrow(page);
    await viewer(browser, server.url);
    await restart(page, server, start);
});
