// What designers do with lights in the picture: several at once, duplicates, arranging, aiming, the keys of move and turn, the
// beam, the work light; by mouse, keyboard and touch.
//   node lights_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, picture, screenshot, settled, startServer, state, until} from "./harness.mjs";
import {changed, distance, drag, handle, light, names, onPage} from "./place.mjs";

// Absolute photometry, rotationally symmetric, 5000 cd down to nothing at 40°.
const kNarrow = ["IESNA:LM-63-2002", "[TEST] none", "[MANUFAC] Gonio tests", "[LUMCAT] NARROW", "[LUMINAIRE] narrow beam",
    "TILT=NONE", "1 -1 1 7 1 1 2 0 0 0", "1 1 50", "0 10 20 30 40 60 90", "0", "5000 4000 1500 300 0 0 0", ""].join("\n");

const circle = (name) => `circle[data-light="${name}"]`;
const said = (page) => page.locator("#many-name").textContent();
const positions = async (page) => Object.fromEntries((await state(page)).lights.map((one) => [one.name, one.position]));

async function undone(page, what, probe) {
    await page.locator("#undo").click();
    await until(what, probe);
    check(true, what);
}

// Ctrl+D: everything but the name and the place.
async function duplicates(page, first) {
    await asked(page, {command: {set_light: {name: first, level_ratio: 0.5, tint_duv: 0.01, aim: [0.3, -1, 0.1]}}});
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+d");
    const copy = await until("a copy", () => light(page, `${first} 2`));
    const original = await light(page, first), same = ({position, name, ...rest}) => JSON.stringify(rest);
    check(same(copy) === same(original) && distance(copy.position, original.position) > 0.2, "Ctrl+D makes a copy with all that the light has, beside it");
    await until("the copy's name", async () => await page.locator("#light-name").textContent() === copy.name);
    check(true, "the copy is selected");
    await page.locator("#light-duplicate").click();
    await until("another copy", () => light(page, `${first} 3`));
    await asked(page, {command: {edit_lights: {set: [{name: first, position_m: [-1, 3, 0.5]}, {name: `${first} 2`, position_m: [0, 2.6, 0.2]}, {name: `${first} 3`, position_m: [1.2, 2.8, -0.4]}]}}});
    await until("all three in their places", async () => (await light(page, `${first} 3`)).position[0] === 1.2);
}

async function chooses(page, first) {
    await page.mouse.click(...await handle(page, circle(first)));
    await page.keyboard.down("Shift");
    await page.mouse.click(...await handle(page, circle(`${first} 2`)));
    await page.keyboard.up("Shift");
    await until("two lights", async () => await page.locator("#many-view").isVisible() && await said(page) === "2 lights");
    check(true, "shift-click selects beside the others");
    await page.keyboard.down("Shift");
    await drag(page, await onPage(page, [0.02, 0.12]), await page.locator("#screen").boundingBox().then(({width, height}) => [Math.min(width, height) * 0.92, height * 0.6]),
        async () => check(await page.locator("#handles .marquee").count() === 1, "a rectangle is drawn"));
    await page.keyboard.up("Shift");
    await until("three lights", async () => await said(page) === "3 lights");
    check(await page.locator("#handles circle.on").count() === 3, "the lights in it are selected too");
    const {camera} = await state(page);
    check(distance(camera.eye, [0, 2, 7.75]) < 1e-6, "the camera stays where it is", camera.eye.join(" "));
}

// Level, colour, align, distribute, group: one step of undo each.
async function changesAll(page, first) {
    const all = [first, `${first} 2`, `${first} 3`], levels = async () => (await state(page)).lights.map((one) => one.level_ratio);
    await page.locator("#many-view input[type=number][aria-label='Level of the selected lights']").fill("40");
    await page.keyboard.press("Enter");
    await until("all at 40 %", async () => (await levels()).every((ratio) => Math.abs(ratio - 0.4) < 1e-9));
    check(true, "one field sets the level of all");
    await undone(page, "one undo sets all three levels back", async () => (await levels()).every((ratio) => ratio === 0.5));
    await page.locator("#many-view button", {hasText: "3200 K"}).click();
    await until("one white", async () => (await state(page)).lights.every((one) => one.cct_k === 3200));
    check(true, "one chip sets the colour temperature of all");
    await page.locator("#many-view input[aria-label='y of the selected lights']").fill("3.1");
    await page.keyboard.press("Enter");
    await until("one height", async () => (await state(page)).lights.every((one) => one.position[1] === 3.1));
    check(true, "one field sets a coordinate of all");
    await undone(page, "one undo sets their heights back", async () => (await light(page, first)).position[1] === 3);
    for (const [label, field, value, factor] of [["Tilt", "tilt_rad", 30, Math.PI / 180], ["Shutter", "shutter_ratio", 0.5, 1], ["Zoom", "zoom_rad", 40, Math.PI / 180]]) {
        const before = (await state(page)).lights.map((one) => one[field]);
        await page.locator(`#many-view input[type=number][aria-label='${label} of the selected lights']`).fill(String(value));
        await page.keyboard.press("Enter");
        await until(`one ${field}`, async () => (await state(page)).lights.every((one) => Math.abs(one[field] - value * factor) < 1e-5));
        await undone(page, `one field sets the ${label.toLowerCase()} of all, one undo sets it back`, async () => JSON.stringify((await state(page)).lights.map((one) => one[field])) === JSON.stringify(before));
    }
    await page.locator("#many-view select[aria-label='Luminous opening of the selected lights']").selectOption("disc");
    await until("one opening", async () => (await state(page)).lights.every((one) => one.opening === "disc 0.6"));
    await undone(page, "one choice gives all an opening", async () => (await state(page)).lights.every((one) => one.opening_of_file));
    const profiles = async () => (await state(page)).lights.map((one) => one.profile), own = JSON.stringify(await profiles());
    await page.locator("#many-view input[type=file]").setInputFiles({name: "narrow.ies", mimeType: "text/plain", buffer: Buffer.from(kNarrow)});
    await until("one profile", async () => (await profiles()).every((name) => name === "narrow.ies"));
    await undone(page, "one upload gives all a profile", async () => JSON.stringify(await profiles()) === own);
    await page.locator("input[aria-label='Scene file to upload']").setInputFiles({name: "narrow.ies", mimeType: "text/plain", buffer: Buffer.from(kNarrow)});
    await until("a message", () => page.locator(".toast", {hasText: "narrow.ies is the profile of 3 lights now"}).isVisible());
    await undone(page, "a photometric file that is dropped does, too", async () => JSON.stringify(await profiles()) === own);
    await page.locator("button[aria-label='Align y to the mean']").click();
    await until("the mean height", async () => (await state(page)).lights.every((one) => Math.abs(one.position[1] - 2.8) < 1e-9));
    check(true, "aligned to the mean", "2.8 m of 3, 2.6 and 2.8");
    await page.locator("button[aria-label^='Distribute evenly along x']").click();
    const x = await until("even steps", async () => {
        const values = all.map(async (name) => (await light(page, name)).position[0]);
        const now = await Promise.all(values);
        return Math.abs(now[1] - 0.1) < 1e-9 && now;
    });
    check(x[0] === -1 && x[2] === 1.2, "distributed between the outermost, which stay", x.join(" "));
    await page.locator("button[aria-label='Group the selected lights']").click();
    await page.locator("input[aria-label='Name of the group of the selected lights']").fill("row");
    await page.keyboard.press("Enter");
    await until("a group", async () => (await state(page)).groups[0]?.lights.length === 3);
    check(true, "a group is made of the selection");
}

// A drag moves all by the same; Aim here turns all to the point.
async function movesAll(page, first) {
    const before = await positions(page);
    await drag(page, await handle(page, circle(first)), [30, 24]);
    const after = await changed(page, "lights that were dragged", before, () => positions(page));
    const by = Object.keys(before).map((name) => after[name].map((value, i) => value - before[name][i]));
    check(distance(by[0], by[1]) < 1e-9 && distance(by[0], by[2]) < 1e-9 && distance(by[0], [0, 0, 0]) > 0.02, "a drag moves all of them by the same", by[0].map((value) => value.toFixed(3)).join(" "));
    await undone(page, "one undo moves all of them back", async () => JSON.stringify(await positions(page)) === JSON.stringify(before));
    await page.locator("#aim-here").click();
    const target = await onPage(page, [0.42, 0.93]);
    await page.mouse.move(...target);
    await until("the point's normal", () => page.locator("#handles .normal").count());
    const shown = await until("what lies there", async () => /at (\S+) (\S+) (\S+) m · normal (\S+) (\S+) (\S+)/.exec(await page.locator("#under").textContent() ?? ""));
    await page.mouse.click(...target);
    const point = shown.slice(1, 4).map(Number);
    await until("aims at the point", async () => (await state(page)).lights.every(({position, aim}) => {
        const to = point.map((value, i) => value - position[i]);
        return distance(aim, to.map((value) => value / Math.hypot(...to))) < 0.01;
    }));
    check(true, "Aim here turns all of them to the point", point.join(" "));
    if (screenshot) await page.screenshot({path: screenshot});
}

async function usesKeys(page, first) {
    await page.mouse.click(...await handle(page, circle(first)));
    await page.keyboard.press("Escape");
    await page.locator(`#light-list li[data-name="${first}"] .pick`).click();
    await until("one light", () => page.locator("#light-view").isVisible());
    const start = (await light(page, first)).position, at = await onPage(page, [0.5, 0.5]);
    await page.mouse.move(...at);
    await page.keyboard.press("w");
    await page.keyboard.press("x");
    for (let i = 1; i <= 4; ++i) await page.mouse.move(at[0] + 12 * i, at[1] + 5 * i);
    await page.mouse.down();
    await page.mouse.up();
    const moved = await changed(page, "a light that W moved", start, async () => (await light(page, first)).position);
    check(moved[0] > start[0] + 0.05 && moved[1] === start[1] && moved[2] === start[2], "W, X, the mouse and a click move it along X", moved.join(" "));
    await page.keyboard.press("g");
    await page.mouse.move(at[0] - 60, at[1] - 50);
    await until("it follows", async () => distance((await light(page, first)).position, moved) > 0.05);
    await page.keyboard.press("Escape");
    await until("the light where it was", async () => distance((await light(page, first)).position, moved) < 1e-9);
    check(true, "G follows the mouse, Esc takes it back");
    const aim = (await light(page, first)).aim;
    await page.mouse.move(...at);
    await page.keyboard.press("e");
    await page.mouse.move(at[0] + 60, at[1]);
    await page.keyboard.press("Enter");
    const turned = await changed(page, "a light that E turned", aim, async () => (await light(page, first)).aim);
    check(turned[0] > aim[0], "E turns it after the mouse, Enter keeps it", turned.map((value) => value.toFixed(3)).join(" "));
    await drag(page, await handle(page, "circle[data-aim]"), [-40, 0]);
    const back = await changed(page, "the aim's handle", turned, async () => (await light(page, first)).aim);
    check(back[0] < turned[0], "the end of the aim line is a handle");
    await page.keyboard.press("f");
    await until("the light in the middle", async () => distance((await state(page)).camera.target, moved) < 1e-6);
    check(true, "F brings the selection into the middle");
    await page.locator("button[title='Back to the camera that the scene came with']").click();
    await until("the first camera", async () => distance((await state(page)).camera.eye, [0, 2, 7.75]) < 1e-6);
}

async function addsAndRemoves(page) {
    await settled(page);
    await page.keyboard.press("n");
    check(await page.locator("#tool-add").getAttribute("aria-pressed") === "true", "N begins to add");
    const before = (await names(page)).length, place = await onPage(page, [0.3, 0.3]);
    await page.mouse.move(place[0] - 9, place[1]);
    await page.mouse.move(...place);
    await until("the distances to the neighbours", async () => / m to /.test(await page.locator("#tool-hint").textContent()));
    const told = /([\d.]+) m to ([^,]+)/.exec(await page.locator("#tool-hint").textContent());
    await page.mouse.click(...place);
    await until("a new light", async () => (await names(page)).length === before + 1);
    const made = await light(page, "light 1");
    check(made && distance(made.aim, [0, 0, 1]) < 1e-6 && Math.abs(made.position[2] + 1.95) < 0.02, "a click on the back wall puts it 5 cm before it, aimed along its normal", `${made.position} ${made.aim}`);
    check(await page.locator("#tool-add").getAttribute("aria-pressed") === "false", "one click adds one");
    const away = distance((await light(page, told[2])).position, made.position);
    check(Math.abs(away - Number(told[1])) < 0.1, "its distance to the nearest was told before", `${told[0]}, ${away.toFixed(2)} m`);
    await page.locator("#canvas").focus();
    await page.keyboard.press("Delete");
    await until("one less", async () => (await names(page)).length === before);
    check(!await light(page, "light 1"), "Delete removes what is selected");
    await undone(page, "undo brings it back", () => light(page, "light 1"));
}

// The edges of the beam on the floor, against the profile's law I = I0 exp(200 (cos v - 1)).
async function showsBeam(page, first) {
    await asked(page, {command: {set_light: {name: first, position_m: [-0.4, 1.5, 1.5], aim: [0, -1, 0], profile: {name: "narrow_spot"}}}});
    await page.locator(`#light-list li[data-name="${first}"] .pick`).click();
    check(await page.locator("#tool-beam").getAttribute("aria-pressed") === "false", "no beam is shown until it is asked for");
    await page.locator("#tool-beam").click();
    await until("the beam in the picture", async () => (await page.locator("#beam .beam").getAttribute("d"))?.endsWith("Z"));
    const {beam} = await asked(page, {beam: {light: first}});
    for (const {ratio, points_m, hit} of beam.edges) {
        const wanted = 1.5 * Math.tan(Math.acos(1 + Math.log(ratio) / 200));
        const radii = hit.map((_, i) => Math.hypot(points_m[3 * i] + 0.4, points_m[3 * i + 2] - 1.5));
        check(hit.every(Boolean) && radii.every((radius) => Math.abs(radius - wanted) < 0.02 * wanted), `the ${100 * ratio} % edge on the floor has the radius of the law`, `${wanted.toFixed(3)} m, ${radii[0].toFixed(3)} m`);
    }
    check((await page.locator("#profile-facts").textContent()).includes("9.5°"), "the inspector tells the beam angle");
    const now = /([\d.\u2009]+) lm at (\d+) %/.exec(await page.locator("#light-output").textContent());
    const {flux_lm, level_ratio} = await light(page, first);
    check(now && Math.abs(Number(now[1].replace("\u2009", "")) - flux_lm * level_ratio) < 1, "and the flux at its level", now?.[0]);
    await page.keyboard.press("b");
    await until("no beam", async () => await page.locator("#beam .beam").getAttribute("d") === "");
    await page.keyboard.press("b");
    if (screenshot) {
        await settled(page);
        await page.screenshot({path: screenshot.replace(/\.png$/, "-beam.png")});
    }
}

// One finger: several, a move by the tool.
async function byTouch(browser, server) {
    const context = await browser.newContext({viewport: {width: 390, height: 844}, hasTouch: true, isMobile: true});
    const page = await context.newPage();
    listen(page);
    await page.goto(server.url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    const all = await names(page), tap = async (selector) => page.touchscreen.tap(...await handle(page, selector));
    await page.locator("#tool-several").tap();
    await tap(circle(all[1]));
    await tap(circle(all[2]));
    await until("several lights by touch", () => page.locator("#many-view").isVisible());
    check(true, "Several selects by touch", await said(page));
    await page.locator("#tool-several").tap();
    await tap(circle(all[1]));
    await until("one light", () => page.locator("#light-view").isVisible());
    const before = (await light(page, all[1])).position;
    await page.locator("#tool-move").tap();
    const session = await context.newCDPSession(page), at = await onPage(page, [0.5, 0.6]);
    const touch = (type, x, y) => session.send("Input.dispatchTouchEvent", {type, touchPoints: type === "touchEnd" ? [] : [{x, y}]});
    await touch("touchStart", ...at);
    for (let i = 1; i <= 4; ++i) await touch("touchMove", at[0] + 10 * i, at[1]);
    await touch("touchEnd");
    const after = await changed(page, "a light that a finger moved", before, async () => (await light(page, all[1])).position);
    check(after[0] > before[0], "Move and a finger move it", after.map((value) => value.toFixed(2)).join(" "));
    check(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "nothing is wider than the screen");
    if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, "-touch.png")});
    await context.close();
}

// Without any light the picture is shaded, stills too, and says that this is no design; lux know nothing of it.
async function worksInTheDark(page) {
    await page.locator("#light-filter").fill("");
    await page.locator("#light-all").click();
    await page.locator("#light-remove").click();
    await until("no light", async () => (await names(page)).length === 0);
    await until("the work light", () => page.locator("#work-light").isVisible());
    const lit = await until("a picture that is not black", async () => {
        const now = await picture(page);
        return now.mean > 40 && now;
    });
    check(lit.spread > 5, "a scene without lights is shaded by a work light", `mean ${lit.mean.toFixed(1)}`);
    if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, "-work-light.png")});
    const {meter} = await asked(page, {meter: {point_m: [0, 0, 0], normal: [0, 1, 0]}});
    check(meter.total_lx === 0, "meters read nothing of it");
    const {capture} = await asked(page, {capture: {format: "png"}});
    const brightest = await page.evaluate(async (image) => {
        const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(image), (c) => c.charCodeAt(0))]));
        const canvas = new OffscreenCanvas(64, 64), context = canvas.getContext("2d");
        context.drawImage(bitmap, 0, 0, 64, 64);
        return Math.max(...context.getImageData(0, 0, 64, 64).data.filter((_, i) => i % 4 !== 3));
    }, capture.image);
    check(brightest > 40, "stills show it too", String(brightest));
    await page.locator("#work-light button").click();
    await until("a black picture", async () => (await picture(page)).mean < 20);
    check(await page.locator("#work-light").isHidden(), "it can be switched off");
    await page.locator("#work-light-toggle").click();
    await until("it is on again", () => page.locator("#work-light").isVisible());
    await page.locator("#undo").click();
    await until("lights again", async () => (await names(page)).length > 1);
    check(await page.locator("#work-light").isHidden(), "it is off by itself where a light is");
}

// Zoom and shutter of the light that is selected; its profile has no wheel.
async function shapesABeam(page, name) {
    await page.locator(`#light-list li[data-name="${name}"] .pick`).click();
    const {max_cd: open, flux_lm} = await light(page, name);
    await page.locator("#zoom-number").fill("20");
    await page.keyboard.press("Enter");
    const zoomed = await until("another beam", async () => {
        const now = await light(page, name);
        return Math.abs(now.zoom_rad - Math.PI / 9) < 1e-4 && now;
    });
    check(zoomed.max_cd !== open && Math.abs(zoomed.flux_lm / flux_lm - 1) < 0.01, "a zoom spreads the same flux",
        `${open} cd becomes ${zoomed.max_cd}, ${flux_lm} lm ${zoomed.flux_lm}`);
    await page.locator("#shutter-number").fill("0.5");
    await page.keyboard.press("Enter");
    await until("half a shutter", async () => (await light(page, name)).shutter_ratio === 0.5);
    check(await page.locator("#gobo").isHidden(), "a profile without a wheel has no gobo to choose");
    for (const [field, value] of [["zoom", "0"], ["shutter", "1"]]) {
        await page.locator(`#${field}-number`).fill(value);
        await page.keyboard.press("Enter");
    }
    await until("the profile's own beam", async () => (await light(page, name)).max_cd === open);
}

// Haze by its list and its sliders.
async function fillsTheAir(page) {
    const state = (name) => page.evaluate((key) => window.gonio.state.haze?.[key], name);
    await page.locator("#haze select").selectOption("show");
    await until("haze", async () => await state("extinction_per_m") === 0.01);
    check(await page.locator("#haze input[type=number]").first().isVisible(), "its own values are there");
    await page.locator("#haze input[type=number]").nth(3).fill("2.5");
    await page.keyboard.press("Enter");
    await until("a layer", async () => await state("layer_height_m") === 2.5);
    check(await page.locator("#haze select").inputValue() === "custom", "a layer is no preset");
    if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, "-haze.png")});
    await page.locator("#haze select").selectOption("off");
    await until("clear air", async () => await state("extinction_per_m") === 0);
    check(await page.locator("#haze input[type=number]").first().isHidden(), "without haze it has no values");
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0"));
    const page = await browser.newPage({viewport: {width: 1280, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await until("the first picture", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    await settled(page);
    const [first] = await names(page);
    await duplicates(page, first);
    await chooses(page, first);
    await changesAll(page, first);
    await movesAll(page, first);
    await usesKeys(page, first);
    await addsAndRemoves(page);
    await showsBeam(page, first);
    await shapesABeam(page, first);
    await fillsTheAir(page);
    await byTouch(browser, servers[0]);
    await worksInTheDark(page);
});
