// The page in headless Chromium against a real goniod.
//   node browser_test.mjs GONIOD_BINARY [SCREENSHOT.png]
// Exit code 0: all held; 1: something did not; 77: Chromium or playwright-core are missing.

import {createSocket} from "node:dgram";
import {mkdtempSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {dirname, join} from "node:path";

import {asked, check, difference, end, inBrowser, kTimeoutMs, listen as listenTo, picture, playwright, screenshot, settled, sleep,
    startServer as startBare, state, until} from "./harness.mjs";

const kMalformed = "IESNA:LM-63-2002\n[TEST] none\n[MANUFAC] nobody\nthis is no TILT line\n1 2 3\n";
const kSize = ["--size", "360x360"];
// Absolute photometry, rotationally symmetric, 5000 cd down to nothing at 40°.
const kNarrow = ["IESNA:LM-63-2002", "[TEST] none", "[MANUFAC] Gonio tests", "[LUMCAT] NARROW", "[LUMINAIRE] narrow beam",
    "TILT=NONE", "1 -1 1 7 1 1 2 0 0 0", "1 1 50", "0 10 20 30 40 60 90", "0", "5000 4000 1500 300 0 0 0", ""].join("\n");

// A recorded fader box whose controller 7 goes up and down for ten minutes.
function recordedBox() {
    const file = join(mkdtempSync(join(tmpdir(), "gonio-")), "box.txt");
    const lines = Array.from({length: 3000}, (_, i) => {
        const value = i % 40 < 20 ? (i % 40) * 6 : (40 - (i % 40)) * 6;
        return `${i * 200} B4 07 ${value.toString(16).padStart(2, "0")}`;
    });
    writeFileSync(file, ["midi 1234:5678 Recorded Box", ...lines, ""].join("\n"));
    return file;
}

const startServer = (listen, more = []) => startBare(listen, ["--osc", "127.0.0.1:0", "--surface-replay", recordedBox(), ...more]);

// ---------------------------------------------------------------------------------------------------- the run
let outage = false;    // while the server is gone the browser itself reports refused connections
const listen = (page) => listenTo(page,
    (message) => outage && /WebSocket connection to .* failed|ERR_CONNECTION_REFUSED/.test(message.text()));

async function run(page, server) {
    await page.goto(server.url);
    await until("a decoded frame", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    check(await page.evaluate(() => window.gonio.connected && window.gonio.mode === "h264"), "the page is connected and decodes H.264");
    await until("what the picture lacks so far", async () => /so far$/.test(await page.locator("#format").textContent()));
    const first = await settled(page);
    check(!/so far/.test(await page.locator("#format").textContent()), "the page says what the picture lacks until every bounce is there");
    check(first.spread > 4, "the decoded picture is not uniform", `spread ${first.spread.toFixed(1)}`);
    const start = await state(page);
    const light = start.lights[0].name;
    check(await page.locator("#light-name").textContent() === light, "the first light is selected", light);

    // Level: a drag of the slider, and a hand that another client does not move.
    const slider = page.locator("#level");
    const box = await slider.boundingBox();
    const at = (ratio) => [box.x + 7 + (box.width - 14) * ratio, box.y + box.height / 2];
    const level = async () => (await state(page)).lights[0].level_ratio;
    await page.mouse.move(...at(await level()));
    await page.mouse.down();
    for (let step = 1; step <= 20; step++) {
        await page.mouse.move(...at(1 - 0.04 * step));
        await sleep(16);
    }
    const inHand = await until("the dragged level in the state", async () => {
        const value = await level();
        return value > 0.1 && value < 0.3 && value;
    });
    const dim = await settled(page);
    check(dim.mean < 0.9 * first.mean, "dragging the level slider down darkens the picture",
        `mean ${first.mean.toFixed(1)} -> ${dim.mean.toFixed(1)}, level ${inHand.toFixed(3)}`);
    const held = await slider.inputValue();
    await asked(page, {command: {set_light: {name: light, level_ratio: 0.75}}});
    await until("the other client's level in the state", async () => Math.abs(await level() - 0.75) < 1e-6);
    check(await slider.inputValue() === held, "a held slider is not moved by another client", `${held} %`);
    await page.mouse.up();
    await until("the released slider at the server's level", async () => Math.abs(Number(await slider.inputValue()) - 75) < 0.2);
    check(true, "once released it shows the server's value", "75 %");
    await page.locator("#level-number").fill("100");
    await page.locator("#level-number").press("Enter");
    await until("level 1 in the state", async () => await level() === 1);
    const full = await settled(page);
    check(Math.abs(full.mean - first.mean) < 0.03 * first.mean + 1, "a typed level brings the light back",
        `mean ${full.mean.toFixed(1)}`);

    // Undo: what was typed, and a whole drag; the buttons say what they would do.
    const title = `Undo: level of ${light} (Ctrl+Z)`;
    await until("the undo button's title", async () => await page.locator("#undo").getAttribute("title") === title);
    await slider.focus();
    await page.keyboard.press("Control+z");
    await until("the level before it was typed", async () => await level() === 0.75);
    await page.keyboard.press("Control+Shift+Z");
    await until("the typed level again", async () => await level() === 1);
    await page.mouse.move(...at(1));
    await page.mouse.down();
    await page.mouse.move(...at(0.5), {steps: 8});
    await page.mouse.up();
    await until("the dragged level", async () => Math.abs(await level() - 0.5) < 0.05);
    await page.keyboard.press("Control+z");
    await until("the level before the drag", async () => await level() === 1);
    await page.locator("#redo").click();
    await until("the level after it", async () => Math.abs(await level() - 0.5) < 0.05);
    await page.locator("#undo").click();
    check(await until("the level before the drag again", async () => await level() === 1),
        "a drag is undone as one, by key and by button", await page.locator("#redo").getAttribute("title"));

    const format = await page.locator("#format").getAttribute("title");
    check(/· libx264 · private lane$/.test(format), "the page says which encoder and lane it watches", format);

    // Profile: a bad file, then a good one.
    const curve = () => page.locator("#profile .c0").getAttribute("d");
    const before = await until("a polar curve", () => curve().catch(() => null));
    const profile = async () => (await state(page)).lights[0].profile;
    const oldProfile = await profile();
    const upload = (name, text) => page.locator("#profile-file").setInputFiles({name, mimeType: "text/plain", buffer: Buffer.from(text)});
    await upload("malformed.ies", kMalformed);
    const error = page.locator("#profile-error");
    await error.waitFor({timeout: kTimeoutMs});
    const reason = (await error.innerText()).replaceAll("\n", " | ");
    check(/\bline\b/i.test(reason), "a malformed file is refused with line and reason", reason);
    check(await profile() === oldProfile && await curve() === before, "and changes nothing");
    await upload("narrow.ies", kNarrow);
    await until("another polar curve", async () => await curve() !== before);
    check(await profile() !== oldProfile && await error.isHidden(), "a good file changes the profile and its polar curve", await profile());
    const narrow = await settled(page);
    check(difference(full, narrow) > 1, "and the picture", `difference ${difference(full, narrow).toFixed(1)}`);

    // View and camera.
    await page.locator("#debug summary").click();
    await page.locator("#debug [data-view=rsm-normal]").click();
    await until("the view in the state", async () => (await state(page)).view === "rsm-normal");
    const normals = await settled(page);
    check(difference(narrow, normals) > 3, "switching the view changes the picture", `difference ${difference(narrow, normals).toFixed(1)}`);
    await page.locator("#views button[data-value=beauty]").click();
    await until("the view in the state", async () => (await state(page)).view === "beauty");
    const straight = await settled(page);
    const screen = await page.locator("#canvas").boundingBox();
    const middle = [screen.x + screen.width / 2, screen.y + screen.height / 2];
    await page.mouse.move(...middle);
    await page.mouse.down();
    for (let step = 1; step <= 10; step++) {
        await page.mouse.move(middle[0] + 6 * step, middle[1] + 2 * step);
        await sleep(16);
    }
    await page.mouse.up();
    await until("another eye in the state", async () => Math.abs((await state(page)).camera.eye[0] - start.camera.eye[0]) > 0.05);
    const turned = await settled(page);
    check(difference(straight, turned) > 1, "dragging in the picture orbits the camera", `difference ${difference(straight, turned).toFixed(1)}`);

    // Size: a new decoder for a new stream.
    const shown = (size) => until(`a picture of ${size}`, () => page.evaluate((wanted) => {
        const canvas = document.getElementById("canvas");
        return `${canvas.width}x${canvas.height}` === wanted;
    }, size));
    await page.locator("select[aria-label='Picture size']").selectOption("800x800");
    await shown("800x800");
    await asked(page, {command: {set_size: {width_px: start.size_px[0], height_px: start.size_px[1]}}});
    await shown(start.size_px.join("x"));
    check(true, "another size of the picture arrives, and the first one again", start.size_px.join("x"));

    // The frame report, and the still.
    await page.locator("#report-toggle").click();
    const rows = await until("rows of the frame report", () => page.locator("#report tbody tr").count());
    check(rows >= 3, "the frame report lists passes", `${rows}`);
    if (screenshot) await page.screenshot({path: screenshot});
    await page.locator("#report-toggle").click();

    // The consoles: where goniod listens, and what came there.
    await page.locator("#consoles-toggle").click();
    const place = await until("the place where OSC is listened to", async () =>
        /osc on 127\.0\.0\.1:(\d+)/.exec(await page.locator("#consoles header p").textContent()));
    const address = `/light/${light}/level`;
    const osc = Buffer.from(address.padEnd(4 * (Math.floor(address.length / 4) + 1), "\0") + ",f\0\0\x3f\0\0\0", "latin1");
    const socket = createSocket("udp4");
    socket.send(osc, Number(place[1]), "127.0.0.1");
    await until("the level that OSC set", async () => (await state(page)).lights[0].level_ratio === 0.5);
    await until("its sender in the table", async () => (await page.locator("#consoles tbody").textContent()).includes(address));
    check(true, "an OSC message moves a level and its sender is in the consoles panel", place[1]);
    socket.close();
    if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, "-consoles.png")});
    await page.locator("#consoles-toggle").click();
    await presets(page);
    await surfaces(page);
    const [download] = await Promise.all([page.waitForEvent("download", {timeout: kTimeoutMs}), page.locator("#save").click()]);
    check(/\.png$/.test(download.suggestedFilename()), "a still can be saved", download.suggestedFilename());

    await meter(page);
    return {start, oldProfile, before};
}

// A preset is saved, recalled and removed.
async function presets(page) {
    const names = async () => (await state(page)).presets?.names ?? [];
    const level = async () => (await state(page)).lights[0].level_ratio;
    const before = await level();
    await page.locator("#presets button[aria-label='New preset']").click();
    await page.locator("#presets form input").fill("look 1");
    await page.locator("#presets form button").click();
    await until("the preset", async () => (await names()).includes("look 1"));
    await page.locator("#level-number").fill("12");
    await page.locator("#level-number").press("Enter");
    await until("another level", async () => Math.abs(await level() - 0.12) < 1e-9);
    await page.locator("#presets li[data-name='look 1'] .pick").click();
    await until("the level of the preset", async () => Math.abs(await level() - before) < 1e-9);
    await page.locator("#presets button[aria-label='Remove look 1']").click();
    await until("no preset", async () => (await names()).length === 0);
    check(true, "a preset is saved, recalled and removed");
}

// A control of the recorded box is learned from the page, drives the light, and is forgotten.
async function surfaces(page) {
    await page.locator("#surfaces-toggle").click();
    const light = (await state(page)).lights[0].name;
    await page.locator("#learn-target").selectOption(`light ${light}`);
    await page.locator("#learn-property").selectOption("roll");
    await page.locator("#learn").click();
    await until("the learned control", async () => (await page.locator("#surfaces header p").textContent()).includes("cc 5/7"));
    const row = page.locator("#surfaces tr[data-control='cc 5/7']");
    await until("its row", async () => (await row.count()) === 1 && (await row.textContent()).includes(`${light} roll`));
    const roll = async () => (await state(page)).lights[0].roll_rad;
    const first = await roll();
    await until("the light turned by the box", async () => await roll() !== first);
    if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, "-surfaces.png")});
    await row.locator("button").click();
    await until("the control forgotten", async () => (await row.count()) === 0 || !(await row.textContent()).includes("roll"));
    check(true, "a control is learned from the page, drives and is forgotten", "cc 5/7");
    // A map changes no picture: something else has to, so that there is one of the newest revision.
    await page.locator("#level-number").fill("60");
    await page.locator("#level-number").press("Enter");
    await settled(page);
    await page.locator("#surfaces-toggle").click();
}

// The meter panel: readings of two qualities, a refusal.
async function meter(page) {
    await page.locator("#meter-toggle").click();
    const result = () => page.locator("#meter-result").textContent();
    const read = async () => {
        await page.locator("#meter-read").click();
        return until("a reading", async () => {
            const text = await result();
            return await page.locator("#meter-read").isEnabled() && !text.endsWith("…") && text;
        });
    };
    for (const [i, letter] of ["x", "y", "z"].entries()) await page.locator(`input[aria-label='Point ${letter}']`).fill(["0", "0", "1.5"][i]);
    const lux = (text) => Number(/^([\d.]+) lx ±/.exec(text)?.[1]);
    const live = await read();
    check(lux(live) > 1 && /direct .* lx · indirect .* lx ± .* · 8192 samples/.test(live), "the meter panel reads lux with its error", live);
    await page.locator("#meter-quality").selectOption("rsm");
    await page.locator("#meter-quality").selectOption("reference");
    await page.locator("select[aria-label='Noise of reference quality']").selectOption("0.05");
    const traced = await read();
    const direct = (text) => Number(/direct ([\d.]+) lx/.exec(text)?.[1]);
    check(Math.abs(direct(traced) - direct(live)) < 0.1, "reference quality agrees about direct light", traced);
    await page.locator("input[aria-label='Normal y']").fill("0");
    const refused = await read();
    check(/Normal must not be the zero vector/.test(refused), "a refusal is told in its place", refused);
    await page.locator("input[aria-label='Normal y']").fill("1");
    await page.locator("#meter-quality").selectOption("interactive");
    if (screenshot) {
        await read();
        await page.screenshot({path: screenshot.replace(/(\.\w+)?$/, "-meter$1")});
    }
    return settled(page);
}

// The page's arithmetic, in the browser that runs it.
async function arithmetic(page) {
    const wrong = await page.evaluate(async () => {
        const [{parseFrameHeader}, camera, {ringsFor}, color, {formatLux, formatProgress}] = await Promise.all(
            ["/video.js", "/camera.js", "/polar.js", "/color.js", "/meter.js"].map((name) => import(name)));
        const found = [];
        const expect = (condition, what) => { if (!condition) found.push(what); };

        const bytes = new Uint8Array(33);
        const view = new DataView(bytes.buffer);
        bytes.set([2, 1, 3, 7]);
        view.setUint32(4, 4000000000, true);
        view.setUint32(8, 12, true);
        view.setBigUint64(16, 5000000n, true);
        view.setUint32(24, 8700, true);
        view.setUint32(28, 1300, true);
        const header = parseFrameHeader(bytes.buffer);
        expect(header.key && header.final && header.lane === 7 && header.seq === 4000000000 && header.scene_rev === 12
            && header.rendered_us === 5000 && header.render_us === 8700 && header.encode_us === 1300, "frame header");
        expect(parseFrameHeader(bytes.buffer.slice(0, 32)) === null, "a frame header without a frame");
        bytes[1] = 9;
        expect(parseFrameHeader(bytes.buffer) === null, "a frame header of another version");

        const pose = {eye: [1, 2, 5], target: [0.5, 1, -1]};
        const distance = ({eye, target}) => Math.hypot(...eye.map((x, i) => x - target[i]));
        const near = (a, b) => Math.abs(a - b) < 1e-9;
        expect(near(distance(camera.orbit(pose, 37, -12)), distance(pose)), "orbit keeps the distance");
        expect(camera.orbit(pose, 0, 0).eye.every((x, i) => near(x, pose.eye[i])), "no drag, no orbit");
        expect(camera.orbit(pose, 0, 1e6).eye.every(Number.isFinite), "orbit stops at the pole");
        expect(near(distance(camera.pan(pose, 0.7, 600, 30, 20)), distance(pose)), "pan keeps the distance");
        // A target one screen height away, panned by the screen height, moves by the height that is seen at its distance.
        const moved = camera.pan(pose, 0.7, 600, 0, 600);
        expect(near(Math.hypot(...moved.target.map((x, i) => x - pose.target[i])), 2 * distance(pose) * Math.tan(0.35)), "pan follows the pointer");
        expect(near(distance(camera.dolly(pose, 0.5)), distance(pose) / 2) && distance(camera.dolly(pose, 1e-9)) > 0.019, "dolly");

        for (const peak of [1e-4, 0.3, 1, 80, 1001, 18500, 2e6]) {
            const rings = ringsFor(peak);
            expect(rings.length >= 1 && rings.length <= 4 && rings.at(-1) >= peak * (1 - 1e-9) && rings.at(-1) < 2 * peak + 1e-12,
                `rings for ${peak}: ${rings}`);
        }
        expect(ringsFor(0).length === 1, "rings without light");
        expect(formatLux(42.3791, 0.0557) === "42.379 lx ± 0.056" && formatLux(250, 0) === "250.0 lx" && formatLux(43.9, 0.15) === "43.90 lx ± 0.15",
            `lux: ${formatLux(42.3791, 0.0557)}, ${formatLux(250, 0)}, ${formatLux(43.9, 0.15)}`);
        expect(formatProgress({jobs_before: 2}) === "Waiting: 2 jobs come first"
            && formatProgress({samples: 64, unit: "samples", noise_ratio: 0.05, seconds: 12.3}) === "12 s · 64 samples · noise 5.00 %"
            && formatProgress({samples: 3, total: 9, unit: "tiles", seconds: 1}) === "1 s · 3 of 9 tiles"
            && formatProgress({samples: 64, seconds: 12.3, seconds_left: 30}) === "12 s · 64 done · 30 s left"
            && formatProgress({samples: 64, seconds: 12.3, seconds_left: 7200}) === "12 s · 64 done · 2 h left", "progress");
        expect(color.toHex(color.fromHex("#1f80e0")) === "#1f80e0", "sRGB and back");
        return found;
    });
    check(wrong.length === 0, "header, camera, rings and colours compute", wrong.join("; "));
}

// A frame that is lost on the way: the decoder would not notice.
async function lostFrame(browser, server) {
    const page = await browser.newPage();
    listen(page);
    let dropNext = false, dropped = 0;
    await page.routeWebSocket(/\/v1\/ws$/, (route) => {
        const upstream = route.connectToServer();
        upstream.onMessage((message) => {
            if (dropNext && typeof message !== "string") {
                dropNext = false;
                dropped++;
                return;
            }
            route.send(message);
        });
    });
    await page.goto(server.url);
    await until("a decoded frame", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    const before = await settled(page);
    const exposure = page.locator("#exposure-number");
    const start = Number(await exposure.inputValue());
    dropNext = true;
    for (let step = 1; step <= 20; step++) {
        await exposure.fill(String(start + 0.05 * step));
        await exposure.press("Enter");
        await sleep(50);
    }
    await until("a lost frame", () => dropped === 1);
    await until("the last exposure in the state", async () => Math.abs((await state(page)).exposure_ev100 - start - 1) < 1e-6);
    const after = await settled(page);
    const gaps = await page.evaluate(() => window.gonio.gaps);
    check(gaps >= 1 && after.mean < before.mean, "a lost frame is seen and a key frame repairs the picture", `gaps ${gaps}`);
    await exposure.fill(String(start));
    await exposure.press("Enter");
    await until("the first exposure in the state", async () => Math.abs((await state(page)).exposure_ev100 - start) < 1e-6);
    const restored = await settled(page);
    check(difference(before, restored) < 3, "exposure goes back to where it was", `difference ${difference(before, restored).toFixed(1)}`);
    await page.close();
}

// Two pages and one camera; and a page that only looks.
async function control(page, browser, server) {
    const other = await browser.newPage(), viewer = await browser.newPage();
    for (const one of [other, viewer]) listen(one);
    await other.goto(server.url);
    await viewer.goto(`${server.url}/?role=viewer`);
    for (const one of [other, viewer]) await until("the first picture", () => one.evaluate(() => window.gonio.framesDecoded > 0));
    const says = (one, text) => until(`"${text}"`, async () => (await one.locator("#control").innerText()).includes(text));
    const drag = async (one) => {
        const box = await one.locator("#canvas").boundingBox();
        await one.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
        await one.mouse.down();
        await one.mouse.move(box.x + box.width / 2 + 60, box.y + box.height / 2, {steps: 5});
        await one.mouse.up();
    };
    const eye = async () => (await state(page)).camera.eye.join();
    await page.locator("#take-camera").click();
    await says(page, "You have the camera");
    await says(other, "Another page has the camera");
    const before = await eye();
    await drag(other);
    await drag(viewer);
    await sleep(300);
    check(await eye() === before, "while one page has the camera, others do not move it");
    await other.locator("#take-camera").click();
    await says(page, "Another page has the camera");
    await drag(other);
    await until("the camera moving", async () => await eye() !== before);
    await other.locator("#take-camera").click();
    await until("a free camera", async () => !(await page.locator("#control").innerText()).includes("has the camera"));
    check(true, "it is taken over and released");
    check(await viewer.evaluate(() => document.getElementById("left").inert && document.getElementById("inspector").inert)
        && /Viewing only/.test(await viewer.locator("#control").innerText()), "a viewer's page only looks");
    await other.close();
    await viewer.close();
}

async function fallback(browser, server) {
    const page = await browser.newPage();
    listen(page);
    await page.addInitScript(() => { delete window.VideoDecoder; });
    await page.goto(server.url);
    await until("an MJPEG picture", () => page.evaluate(() => document.getElementById("still").naturalWidth > 0));
    const shown = await picture(page, "#still");
    check(shown.spread > 4 && await page.evaluate(() => window.gonio.mode === "mjpeg"), "without WebCodecs the picture comes as MJPEG",
        `spread ${shown.spread.toFixed(1)}`);
    const why = /this browser has no H\.264/i;
    await until("why in the bar", async () => why.test(await page.locator("#format").textContent()));
    check(/has no WebCodecs/.test(await page.locator("#toasts").textContent()), "the bar and a message say why", await page.locator("#format").textContent());
    await page.close();
}

// A server that asks for a token, a browser without WebCodecs: the picture comes with the token in a header; and so does
// a scene that is dropped onto it.
async function locked(browser) {
    const token = join(mkdtempSync(join(tmpdir(), "gonio-")), "token");
    writeFileSync(token, "a-token-for-this-test\n", {mode: 0o600});
    const viewers = join(dirname(token), "viewers");
    writeFileSync(viewers, "a-token-for-viewers\n", {mode: 0o600});
    const server = await startServer("127.0.0.1:0", ["--token-file", token, "--viewer-token-file", viewers]);
    const page = await browser.newPage();
    const addresses = [];
    page.on("request", (request) => addresses.push(request.url()));
    await page.addInitScript(() => { delete window.VideoDecoder; });
    await page.goto(server.url);
    await page.locator("#token").waitFor();
    await page.locator("#token input").fill("a-token-for-this-test");
    await page.locator("#token button").click();
    await until("an MJPEG picture", () => page.evaluate(() => document.getElementById("still").naturalWidth > 0));
    const shown = await picture(page, "#still");
    check(shown.spread > 4 && await page.evaluate(() => window.gonio.mode === "mjpeg" && document.getElementById("still").src.startsWith("blob:")),
        "with a token the MJPEG picture comes through fetch()", `spread ${shown.spread.toFixed(1)}`);
    await page.locator("input[type=file]").first().setInputFiles({name: "a scene.gltf", mimeType: "model/gltf+json",
        buffer: Buffer.from(JSON.stringify({asset: {version: "2.0"}, scenes: [{nodes: []}], scene: 0}))});
    await until("the uploaded scene", async () => (await state(page)).scene === "upload:a scene.gltf");
    check(!addresses.some((address) => address.includes("token")), "an uploaded scene is loaded; no address holds the token");
    const looker = await browser.newPage();
    listen(looker);
    await looker.goto(server.url);
    await looker.locator("#token input").fill("a-token-for-viewers");
    await looker.locator("#token button").click();
    await until("the viewer's page", async () => /Viewing only/.test(await looker.locator("#control").innerText()));
    await until("its state", () => looker.evaluate(() => document.getElementById("left").inert));
    check(new URL(looker.url()).searchParams.get("role") === "viewer" && !(await looker.locator("#token").isVisible()),
        "a viewer's token opens a page that only looks");
    await looker.close();
    await page.close();
    await end(server.child, "SIGTERM");
}

async function restart(page, server, {start}) {
    const address = server.url.replace("http://", "");
    outage = true;
    await end(server.child, "SIGKILL");
    await until("the page knowing that it is alone", () => page.evaluate(() => !window.gonio.connected));
    check(await page.locator("#veil").isVisible(), "a lost connection is shown");
    const frames = await page.evaluate(() => window.gonio.framesDecoded);
    const again = await startServer(address, kSize);
    await until("the connection again", () => page.evaluate(() => window.gonio.connected));
    await until("new frames", () => page.evaluate((count) => window.gonio.framesDecoded > count, frames));
    outage = false;
    await settled(page);
    const now = await state(page);
    check(now.lights[0].profile === start.lights[0].profile
        && Math.hypot(...now.camera.eye.map((x, i) => x - start.camera.eye[i])) < 1e-6,
    "the page reconnects and restates what the new server says");
    check(await page.locator("#profile select").inputValue() === start.lights[0].profile && await page.locator("#veil").isHidden(),
        "its controls and the picture are those of the new server");
    return again;
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0", kSize));
    const page = await browser.newPage({viewport: {width: 1280, height: 800}});
    listen(page);
    const seen = await run(page, servers[0]);
    await arithmetic(page);
    await lostFrame(browser, servers[0]);
    await control(page, browser, servers[0]);
    await fallback(browser, servers[0]);
    await locked(browser);
    servers.push(await restart(page, servers[0], seen));
});
