// The patch panel: real sACN packets, clashes in words, rows that are added, changed and taken out by mouse and keyboard.

import {createSocket} from "node:dgram";
import {mkdtempSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";

import {asked, check, inBrowser, listen, screenshot, startServer, state, until} from "./harness.mjs";

const shot = async (page, name) => { if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, `-${name}.png`)}); };

// ANSI E1.31-2018, tables 4-1 to 4-3: a data packet of universe 1.
function sacn(slots, sequence, {universe = 1, priority = 100, cid = 7} = {}) {
    const packet = Buffer.alloc(126 + slots.length);
    const layer = (at) => packet.writeUInt16BE(0x7000 | (packet.length - at), at);
    packet.writeUInt16BE(0x10, 0);
    packet.write("ASC-E1.17\0\0\0", 4, "latin1");
    layer(16);
    packet.writeUInt32BE(4, 18);
    packet.fill(cid, 22, 38);
    layer(38);
    packet.writeUInt32BE(2, 40);
    packet.write("desk", 44);
    packet[108] = priority;
    packet[111] = sequence;
    packet.writeUInt16BE(universe, 113);
    layer(115);
    packet[117] = 2;
    packet[118] = 0xa1;
    packet.writeUInt16BE(1, 121);
    packet.writeUInt16BE(slots.length + 1, 123);
    Buffer.from(slots).copy(packet, 126);
    return packet;
}

// A recorded box whose controller 7 goes up and down.
function recordedBox() {
    const file = join(mkdtempSync(join(tmpdir(), "gonio-")), "box.txt");
    const lines = Array.from({length: 3000}, (_, i) => `${i * 200} B4 07 ${((i % 40 < 20 ? i % 40 : 40 - (i % 40)) * 6).toString(16).padStart(2, "0")}`);
    writeFileSync(file, ["midi 1234:5678 Recorded Box", ...lines, ""].join("\n"));
    return file;
}

// What the panel makes of rows, senders and faders, against a list made by hand.
async function arithmetic(page) {
    const wrong = await page.evaluate(async () => {
        const {faults, footprint, levelsOf} = await import("/patch.js");
        const found = [], expect = (is, wanted, what) => { if (JSON.stringify(is) !== JSON.stringify(wanted)) found.push(`${what}: ${JSON.stringify(is)}`); };
        const row = (universe, address, target, property, bits = 8, protocol = "sacn") => ({protocol, universe, address, target, property, bits});
        expect([row(1, 1, "a", "level"), row(1, 1, "a", "color"), row(1, 1, "a", "position", 16)].map(footprint), [1, 3, 6], "footprints");
        const scene = {lights: [{name: "a"}, {name: "b"}], groups: [{name: "g", lights: ["a", "b"]}]};
        const rows = [row(1, 1, "a", "color"), row(1, 3, "b", "level"), row(1, 4, "b", "pan", 16), row(2, 1, "a", "red"), row(1, 1, "b", "tilt", 8, "artnet"),
            row(3, 1, "g", "pan"), row(3, 2, "nobody", "level"), row(4, 1, "", "master"), row(4, 9, "b", "aim")];
        expect(faults(rows, [{target: "b", property: "tilt", text: "box cc 1"}], scene), {
            rows: [["same slots as row 2", "same property as row 4"], ["same slots as row 1"], ["same property as row 6, row 9"], ["same property as row 1"], ["same property as row 9, box cc 1"],
                ["same property as row 3, row 9"], ["no light or group nobody"], [], ["same property as row 3, row 6, row 5, box cc 1"]],
            faders: [["same property as row 5, row 9"]]}, "faults");
        const sender = (priority, levels, more = {}) => ({protocol: "sacn", universe: 1, state: "live", priority, levels, ...more});
        expect(levelsOf([sender(100, [10, 200]), sender(100, [20]), sender(50, [255]), sender(200, [255], {state: "lost"}), sender(200, [255], {preview: true})], "sacn", 1).slice(0, 3),
            [20, 200, 0], "the highest of the highest priority");
        expect(levelsOf([], "sacn", 1), null, "no sender");
        return found;
    });
    check(wrong.length === 0, "clashes, footprints and levels are those of a list made by hand", wrong.join("\n"));
}

async function run(page, name) {
    await page.locator("#patch-toggle").click();
    const rows = page.locator("#patch tbody tr[data-row]");
    await until("the default patch", async () => (await rows.count()) === 2);
    check(/Default patch/.test(await page.locator("#patch header p").textContent()), "the panel says that the patch is the default one");

    // Levels as they arrive.
    const place = await until("where sACN is listened to", async () => {
        const {sources} = await asked(page, {sources: {}});
        return sources?.endpoints?.find((one) => one.protocol === "sacn")?.address;
    });
    const socket = createSocket("udp4");
    let sequence = 0, slots = [128];
    const timer = setInterval(() => socket.send(sacn(slots, sequence = (sequence + 1) & 255), Number(place.split(":").at(-1)), "127.0.0.1"), 50);
    const level = (row) => page.locator(`#patch tr[data-row='${row}'] .level`).textContent();
    await until("the level that arrives", async () => /^128 = 0\.50$/.test(await level(1)));
    await until("the light follows", async () => Math.abs((await state(page)).lights[0].level_ratio - 128 / 255) < 1e-6);
    check(await level(2) === "no sender", "rows show what arrives, and where nobody sends", await level(1));

    // A row of 16 bits, by mouse; the default patch becomes one of its own.
    await page.locator("#patch-target").selectOption(`light ${name}`);
    await page.locator("#patch-property").selectOption("pan");
    await page.locator("#patch-bits").selectOption("16");
    await page.locator("#patch-address").fill("5");
    await page.locator("#patch-low").fill("-90");
    await page.locator("#patch-high").fill("90");
    await page.locator("#patch-submit").click();
    await until("the third row", async () => (await rows.count()) === 3);
    slots = [128, 0, 0, 0, 255, 255];
    await until("the pan that it drives", async () => Math.abs((await state(page)).lights[0].pan_rad - Math.PI / 2) < 1e-6);
    await until("its level", async () => /^65535 = 90 °$/.test(await level(3)));
    check(true, "a row is added and drives", await level(3));
    check(await page.locator("#patch-address").inputValue() === "7", "the next address is offered");

    // A clash, by keyboard: the tilt lies on the fine slot of the pan.
    await page.locator("#patch-property").selectOption("tilt");
    await page.locator("#patch-bits").selectOption("8");
    await page.locator("#patch-address").fill("6");
    await page.keyboard.press("Enter");
    await until("the fourth row", async () => (await rows.count()) === 4);
    const note = (row) => page.locator(`#patch tr[data-row='${row}'] td.note`).textContent();
    check(await note(4) === "⚠ same slots as row 3" && await note(3) === "⚠ same slots as row 4", "a clash is said in words on both rows", await note(4));
    await shot(page, "patch");
    await page.locator("button[aria-label='Edit row 4']").focus();
    await page.keyboard.press("Enter");
    check(await page.locator("#patch-address").evaluate((field) => field === document.activeElement), "Edit takes the keyboard into the form");
    await page.keyboard.press("Control+a");
    await page.keyboard.type("9");
    await page.keyboard.press("Enter");
    await until("no clash", async () => (await page.locator("#patch tr.clash").count()) === 0);
    check((await asked(page, {patch: {}})).patch.rows[3].address === 9, "a row is changed");

    // A target that is not there; somebody else's change since.
    const {patch} = await asked(page, {patch: {}});
    await asked(page, {command: {set_patch: {rows: [...patch.rows, {protocol: "sacn", universe: 3, address: 1, target: "nobody", property: "level"}]}}});
    await until("the row without a target", async () => (await rows.count()) === 5 && /no light or group nobody/.test(await note(5)));
    check(true, "a row whose target is not there says so");
    await page.locator("button[aria-label='Unpatch row 5']").click();
    await until("four rows", async () => (await rows.count()) === 4);
    check(!(await asked(page, {patch: {}})).patch.rows.some((row) => row.target === "nobody"), "it is taken out");

    // Every light at an address of its own.
    await asked(page, {command: {add_light: {light: {name: "second", profile: {name: "narrow_spot"}}}}});
    await until("the second light", async () => (await state(page)).lights.length === 2);
    await page.locator("#patch-target").selectOption("all");
    await page.locator("#patch-property").selectOption("level");
    await page.locator("#patch-universe").fill("2");
    await page.locator("#patch-address").fill("101");
    await page.locator("#patch-submit").click();
    await until("a row for each", async () => (await rows.count()) === 6);
    const last = (await asked(page, {patch: {}})).patch.rows.slice(-2);
    check(last.map((row) => `${row.target} ${row.universe} ${row.address}`).join() === `${name} 2 101,second 2 102`, "all lights are patched one after the other");
    check(await note(5) === "the highest counts of this and row 1, row 2", "rows that merge are said too", await note(5));
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+z");
    await until("undone", async () => (await rows.count()) === 4);
    check(true, "Ctrl+Z takes both out");

    // A row of names: three profiles share a slot's way, 255 is the last of them.
    await page.locator("#patch-target").selectOption("light second");
    await page.locator("#patch-property").selectOption("profile");
    await page.locator("#patch-universe").fill("1");
    await page.locator("#patch-address").fill("6");
    await page.locator("#patch-names").fill("downlight, flood, narrow_spot");
    await page.locator("#patch-submit").click();
    await until("the row of profiles", async () => (await rows.count()) === 5);
    check((await asked(page, {patch: {}})).patch.rows[4].profiles.join() === "downlight,flood,narrow_spot", "a row of profiles is added");
    await until("the profile that arrives", async () => await level(5) === "255 = narrow_spot");
    slots = [128, 0, 0, 0, 255, 100];
    await until("the profile that it drives", async () => (await state(page)).lights[1].profile === "flood");
    await until("its level", async () => await level(5) === "100 = flood");
    check(true, "and drives", await level(5));
    await page.locator("button[aria-label='Edit row 5']").click();
    check(await page.locator("#patch-names").inputValue() === "downlight, flood, narrow_spot", "its names can be edited");
    await page.locator("#patch-property").selectOption("gel");
    await page.locator("#patch-names").fill("none, L201");
    await page.locator("#patch-submit").click();
    await until("the row of gels", async () => JSON.stringify((await asked(page, {patch: {}})).patch.rows[4].profiles) === JSON.stringify(["", "L201"]));
    check(await page.locator("#patch-names").isVisible(), "a row of gels too");
    await page.locator("button[aria-label='Unpatch row 5']").click();
    await until("four rows again", async () => (await rows.count()) === 4);

    // A fader of the box is learned, shown and forgotten.
    await page.locator("#patch-target").selectOption(`light ${name}`);
    await page.locator("#patch-property").selectOption("tilt");
    await page.locator("#patch-learn").click();
    const fader = page.locator("#patch tr[data-fader$='cc 5/7']");
    await until("the fader's row", async () => (await fader.count()) === 1);
    check(/same property as row 4/.test(await fader.textContent()) && /%/.test(await fader.locator(".level").textContent()), "a fader is learned; its place and its clash are shown", await fader.textContent());
    await shot(page, "patch-fader");
    await fader.locator("button").click();
    await until("no fader", async () => (await fader.count()) === 0);
    check(true, "and forgotten");

    await page.setViewportSize({width: 390, height: 800});
    const submit = await page.locator("#patch-submit").boundingBox();
    check(submit.x >= 0 && submit.x + submit.width <= 390, "the form fits a screen of 390 pixels");
    await shot(page, "patch-390");
    await page.setViewportSize({width: 1280, height: 800});
    await page.locator("#patch-default").click();
    await until("the default patch again", async () => /Default patch/.test(await page.locator("#patch header p").textContent()));
    check(true, "the default patch comes back");
    clearInterval(timer);
    socket.close();
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null", "--sacn", "127.0.0.1:0", "--surface-replay", recordedBox()]));
    const page = await browser.newPage({viewport: {width: 1280, height: 800}});
    listen(page);
    await page.goto(servers[0].url);
    await until("a picture", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    await arithmetic(page);
    await run(page, (await state(page)).lights[0].name);
});
