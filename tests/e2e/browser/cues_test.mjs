// Cues: recorded, played and changed on the page; what is active and next is told in words; keys do not clash.
//   node cues_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, screenshot, sleep, startServer, state, until} from "./harness.mjs";

const kShots = [["desktop", 1440, 900], ["telephone", 390, 844]];

async function run(page) {
    const light = (await state(page)).lights[0].name;
    const level = async () => (await state(page)).lights[0].level_ratio;
    const setLevel = async (level_ratio) => {
        await asked(page, {command: {set_light: {name: light, level_ratio}}});
        await until("the level", async () => Math.abs(await level() - level_ratio) < 1e-9);
    };
    const cue = (number) => page.locator(`#cues tr[data-cue="${number}"]`);
    const record = async ({number, label, up, after, after_s}) => {
        if (number !== undefined) await page.locator("#cue-number").fill(number);
        const wanted = await page.locator("#cue-number").inputValue();
        await page.locator("#cue-label").fill(label);
        await page.locator("#cue-up").fill(String(up));
        await page.locator("#cue-down").fill(String(up));
        await page.locator("#cue-next-by").selectOption(after ?? "manual");
        if (after) await page.locator("#cue-after").fill(String(after_s));
        await page.locator("#cue-record").click();
        await cue(wanted).waitFor();
        return wanted;
    };
    const marks = () => page.locator("#cues tr[data-cue]").evaluateAll((rows) => rows.map((row) => `${row.dataset.cue}${row.querySelector(".mark").textContent}`).join(" "));

    await page.locator("#cues-toggle").click();
    await page.locator("#cue-new").click();
    await setLevel(0);
    check(await record({label: "Dark", up: 0}) === "1", "the first cue is offered the number 1");
    await setLevel(0.5);
    check(await record({label: "Half", up: 1}) === "2", "the next one 2");
    await setLevel(1);
    await record({number: "1.5", label: "Full", up: 0, after: "hang_s", after_s: 1});
    await page.locator("#cue-label").press("Escape");
    check(await page.locator("#cue-label").isHidden() && await page.locator("#cues table").isVisible(), "Escape closes the form, not the tool");
    check(await marks() === "1▸ next 1.5 2", "the list sorts by number and says what is next in words", await marks());

    await page.locator("#cue-go").click();
    await until("GO", async () => await marks() === "1● active 1.5▸ next 2");
    check(await level() === 0, "GO starts the next cue");
    check(await page.locator("#cue-active").textContent() === "1 Dark" && await page.locator("#cue-next").textContent() === "1.5 Full", "the bar says which they are");
    await sleep(300);
    await page.locator("#cue-go").click();
    await until("the second cue", async () => await level() === 1);
    await until("the countdown", async () => /next in \d\.\d s/.test(await page.locator("#cue-left").textContent()));
    await until("what hangs on it", async () => await marks() === "1 1.5 2● active");
    check(true, "a hang starts the next one by itself, after a countdown");
    await until("its end", async () => await level() === 0.5);

    // A second GO is refused, and told.
    await page.locator("#cues .cue-options summary").click();
    await page.locator("#cue-option-guard").fill("5");
    await page.locator("#cue-option-guard").press("Enter");
    await until("the guard", async () => (await state(page)).cue_playback.guard_s === 5);
    await asked(page, {command: {cue_goto: {number: "2", time_s: 0}}});    // what the guard counts begins anew
    await asked(page, {command: {set_cue_options: {next: "1"}}});
    await page.locator("#cue-go").click();
    await until("GO", async () => (await state(page)).cue_playback.active === "1");
    await page.locator("#cue-go").click();
    await page.locator(".toast").waitFor();
    check((await page.locator(".toast").first().textContent()).includes("nother GO came"), "a double GO is refused in words");
    check((await state(page)).cue_playback.active === "1", "and starts nothing");
    await page.locator(".toast button").first().click();
    await page.locator("#cue-option-guard").fill("0.2");
    await page.locator("#cue-option-guard").press("Enter");
    await until("the guard", async () => (await state(page)).cue_playback.guard_s === 0.2);
    await page.locator("#cues .cue-options summary").click();

    // Changed, and held in the middle.
    await cue("2").getByRole("button", {name: "Edit cue 2"}).click();
    check(await page.locator("#cue-label").inputValue() === "Half" && await page.locator("#cue-content").inputValue() === "keep", "Edit loads the cue");
    await page.locator("#cue-up").fill("60");
    await page.locator("#cue-label").fill("Slow");
    await page.locator("#cue-record").click();
    await until("the change", async () => (await cue("2").textContent()).includes("Slow"));
    check((await state(page)).cues.cues.find(({number}) => number === "2").up_s === 60, "and changes it");
    await cue("2").getByRole("button", {name: "Go to cue 2"}).click();
    await until("a fade", async () => await level() > 0);
    if (screenshot) {
        for (const [name, width, height] of kShots) {
            for (const colorScheme of ["light", "dark"]) {
                await page.setViewportSize({width, height});
                await page.emulateMedia({colorScheme});
                await sleep(500);
                await page.screenshot({path: screenshot.replace(/(\.\w+)?$/, `-${name}-${colorScheme}$1`)});
            }
        }
        await page.setViewportSize({width: 1280, height: 900});
    }
    await page.locator("#cue-stop").click();
    await until("it is held", async () => (await page.locator("#cue-left").textContent()).startsWith("held"));
    const held = await level();
    await sleep(400);
    check(await level() === held && held < 0.5, "STOP holds the fade", `${held}`);
    await page.locator("#cue-back").click();
    await until("the cue before", async () => (await state(page)).cue_playback.active === "1.5");

    // Keys: Space is GO, unless something has it.
    await page.locator("#canvas").focus();
    await page.keyboard.press("Space");
    await until("GO by Space", async () => (await state(page)).cue_playback.active === "2");
    await page.keyboard.press("Shift+Space");
    await until("STOP by Shift Space", async () => (await state(page)).cue_playback.held);
    await asked(page, {command: {cue_goto: {number: "1", time_s: 0}}});
    await until("cue 1", async () => (await state(page)).cue_playback.active === "1");
    await page.locator("#cue-new").click();
    await page.keyboard.type("a b");
    check(await page.locator("#cue-label").inputValue() === "a b" && (await state(page)).cue_playback.active === "1", "in a field Space is a space");
    await page.keyboard.press("Escape");
    await page.locator("#cues-toggle").click();
    await page.locator("#canvas").focus();
    await page.keyboard.press("Space");
    await sleep(300);
    check((await state(page)).cue_playback.active === "1", "while the tool is closed Space is nothing");
    await page.locator("#cues-toggle").click();
    await cue("1.5").getByRole("button", {name: "Make cue 1.5 the next one"}).click();
    await until("the pointer", async () => (await state(page)).cue_playback.next === "1.5");
    await cue("1.5").getByRole("button", {name: "Remove cue 1.5"}).click();
    await until("it is gone", async () => await cue("1.5").count() === 0);
    check((await state(page)).cue_playback.next === "2", "what is removed gives the pointer on");
    await page.keyboard.press("Control+z");
    await until("it is back", async () => await cue("1.5").count() === 1);
    check(true, "and undo brings it back");
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null"]));
    const page = await browser.newPage({viewport: {width: 1280, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    await run(page);
});
