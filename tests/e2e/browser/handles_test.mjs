// What can be taken hold of in the picture: lights are picked, dragged and aimed; what lies under the pointer is told.
//   node handles_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, screenshot, settled, startServer, state, until} from "./harness.mjs";
import {changed, distance, drag, handle, light, onPage} from "./place.mjs";

// Where a light came to rest that was dragged away from `from`, by 5 cm at least.
const dragged = (page, name, from) => changed(page, "a light that was dragged and rests", from, async () => {
    const {position} = await light(page, name);
    return distance(position, from) > 0.05 ? position : from;
});

async function run(page, server) {
    await page.goto(server.url);
    await until("the first picture", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    await settled(page);
    const first = (await state(page)).lights[0].name;

    // Under the pointer: the same as the meter reads there.
    await page.mouse.move(...await onPage(page, [0.5, 0.8]));
    const text = await until("what lies under the pointer", async () => await page.locator("#under").isVisible() && page.locator("#under").textContent());
    const found = /^([\d.]+) lx · ([\d.]+) cd\/m² · (.+) at (\S+) (\S+) (\S+) m · normal (\S+) (\S+) (\S+) · ([\d.]+) m away$/.exec(text);
    check(found, "lux, cd/m², object, point and normal are told under the pointer", text);
    const read = (await asked(page, {meter: {point_m: found.slice(4, 7).map(Number), normal: found.slice(7, 10).map(Number)}})).meter.total_lx;
    check(Math.abs(read - Number(found[1])) < 0.02 * read, "the meter reads the same there", `${found[1]} lx, ${read.toFixed(1)} lx`);

    // A light is dragged along an axis, freely, and back with Escape.
    const before = (await light(page, first)).position;
    await drag(page, await handle(page, "circle[data-axis=x]"), [40, 0]);
    const along = await dragged(page, first, before);
    check(along[0] > before[0] && Math.abs(along[1] - before[1]) < 1e-9 && Math.abs(along[2] - before[2]) < 1e-9, "its X handle moves it along X", along.join(" "));
    await drag(page, await handle(page, `circle[data-light="${first}"]`), [-30, 25]);
    const free = await dragged(page, first, along);
    check(free[1] < along[1], "its own handle moves it in the plane of the picture", free.join(" "));
    await drag(page, await handle(page, `circle[data-light="${first}"]`), [60, 10], () => page.keyboard.press("Escape"));
    await until("the light where it was", async () => distance((await light(page, first)).position, free) < 1e-6);
    check(true, "Escape takes a drag back");
    await drag(page, await handle(page, `circle[data-light="${first}"]`), [60, -30], () => page.keyboard.press("y"));
    const up = await dragged(page, first, free);
    check(Math.abs(up[0] - free[0]) < 1e-9 && Math.abs(up[2] - free[2]) < 1e-9 && up[1] > free[1], "Y holds a drag to that axis", up.join(" "));

    // The ring about the aim, which is straight down: C0 is +X, and C90 is -Z. So C0 on +Z is a roll of -90°.
    const rolled = (wanted) => until(`a roll of ${wanted}°`, async () => Math.abs((await light(page, first)).roll_rad * 180 / Math.PI - wanted) < 6 && light(page, first));
    const flat = await light(page, first);
    check(flat.aim[1] < -0.9999 && Math.abs(flat.roll_rad) < 1e-9, "the light aims down and is not rolled");
    const at = await handle(page, "circle[data-roll]"), ring = await page.locator("#handles path.roll").boundingBox();
    const front = ring.y + (flat.position[1] > (await state(page)).camera.eye[1] ? 0 : ring.height);    // nearest to the camera, on +Z
    const toFront = [ring.x + ring.width / 2 - at[0], front - at[1]];
    await drag(page, at, toFront);
    const onZ = await rolled(-90);
    check(onZ.c0[2] > 0.99 && Math.abs(onZ.aim[1] + 1) < 1e-6, "the ring rolls the light about its aim", `C0 ${onZ.c0.map((x) => x.toFixed(2))}, ${(onZ.roll_rad * 180 / Math.PI).toFixed(1)}°`);
    await page.keyboard.down("Control");
    await drag(page, await handle(page, "circle[data-roll]"), [ring.width / 4, 0]);
    await page.keyboard.up("Control");
    const snapped = 12 / Math.PI * await changed(page, "another roll", onZ.roll_rad, async () => (await light(page, first)).roll_rad);
    check(Math.abs(snapped - Math.round(snapped)) < 1e-6, "Ctrl rolls in steps of 15°", `${Math.round(snapped) * 15}°`);
    await until("the same degrees in the field", async () => Math.abs(Number(await page.locator("#roll-number").inputValue()) - Math.round(snapped) * 15) < 0.06);
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+z");
    await rolled(-90);
    await page.keyboard.press("Control+z");
    await rolled(0);
    check(true, "each drag of the ring is one step of undo");
    await drag(page, await handle(page, "circle[data-roll]"), [-40, 6], () => page.keyboard.press("Escape"));
    await until("no roll", async () => Math.abs((await light(page, first)).roll_rad) < 1e-9);
    check(true, "Escape takes a roll back");

    // Aim here.
    await page.locator("#aim-here").click();
    const target = await onPage(page, [0.4, 0.93]);
    await page.mouse.move(...target);
    await page.mouse.click(...target);
    const aimed = await until("an aim at the point", async () => {
        const {position, aim} = await light(page, first), t = -position[1] / aim[1];
        return Math.abs(aim[0] / aim[1]) > 0.01 && [position[0] + t * aim[0], position[2] + t * aim[2]];
    });
    await page.mouse.move(target[0] + 1, target[1]);
    const seen = await until("what lies there", async () => {
        const at = / at (\S+) (\S+) (\S+) m/.exec(await page.locator("#under").textContent() ?? "");
        return at && Math.abs(Number(at[2])) < 0.01 && at.slice(1).map(Number);
    });
    check(Math.hypot(aimed[0] - seen[0], aimed[1] - seen[2]) < 0.05, "a click aims the light at the surface", `${aimed.map((x) => x.toFixed(2))}, ${seen}`);

    // A second light at the same place: the second click goes on to it.
    await page.locator("#lights button[aria-label='New light']").click();
    await page.locator("#lights form input").fill("second");
    await page.locator("#lights form button").click();
    await until("the new light", () => light(page, "second"));
    check(await page.locator("#light-name").textContent() === "second", "a new light is selected");
    await asked(page, {command: {set_light: {name: "second", position_m: (await light(page, first)).position}}});
    await until("both at one place", async () => distance((await light(page, "second")).position, (await light(page, first)).position) < 1e-9);
    const names = [];
    for (let i = 0; i < 3; ++i) {
        await page.mouse.click(...await handle(page, "circle.light.on"));
        names.push(await page.locator("#light-name").textContent());
    }
    check(new Set(names).size === 2 && names[0] === names[2], "clicks go on to lights that are hidden behind others", names.join(", "));
    if (screenshot) {
        await page.mouse.move(...await onPage(page, [0.6, 0.75]));
        await until("what lies under the pointer", () => page.locator("#under").isVisible());
        await settled(page);
        await page.screenshot({path: screenshot});
    }
    // The legend: a pixel's colour is the lux that is told under the pointer.
    await page.locator("#views button[data-value=illuminance]").click();
    await until("the legend", () => page.locator("#legend").isVisible());
    // What is told follows the light while the pointer rests.
    const place = [0.45, 0.95], lux = async () => Number(/^([\d.]+) lx/.exec(await page.locator("#under").textContent())?.[1]);
    await page.mouse.move(...await onPage(page, place));
    await settled(page);
    const both = await until("what lies there", lux);
    await asked(page, {command: {set_light: {name: "second", level_ratio: 0}}});
    await until("less lux under the pointer", async () => await lux() < 0.9 * both);
    await asked(page, {command: {set_light: {name: "second", level_ratio: 1}}});
    await until("all of them again", async () => Math.abs(await lux() / both - 1) < 0.02);
    await settled(page);
    const told = await lux();
    const shown = await page.evaluate(async ([x, y]) => {
        const {valueOf, scaleOf} = await import("/legend.js");
        const canvas = document.querySelector("#canvas"), small = document.createElement("canvas");
        small.width = canvas.width, small.height = canvas.height;
        const context = small.getContext("2d", {willReadFrequently: true});
        context.drawImage(canvas, 0, 0);
        return valueOf(scaleOf(window.gonio.state), [...context.getImageData(Math.round(x * canvas.width), Math.round(y * canvas.height), 1, 1).data.slice(0, 3)]);
    }, place);
    check(Math.abs(Math.log10(shown / told)) < 0.08, "the legend's colours stand for the lux that are there", `${shown.toFixed(1)} lx, ${told} lx`);
    if (screenshot) await page.screenshot({path: screenshot.replace(/\.png$/, "-legend.png")});
    // Its settings: steps, and the difference from what was kept.
    await page.locator("#scale select[aria-label=Steps]").selectOption("10");
    await until("ten steps", async () => / 10 steps$/.test(await page.locator("#legend").getAttribute("aria-label")));
    await page.getByRole("button", {name: "Keep A"}).click();
    await until("a difference", async () => (await state(page)).view_compare === "A" && /^Difference, lx/.test(await page.locator("#legend").innerText()));
    await page.locator("#scale select[aria-label='Difference from']").selectOption("");
    await until("no difference", async () => (await state(page)).view_compare === "");
    await page.keyboard.press("Escape");
    check(await page.locator("#views button").count() === 5, "views of maps are none of the tabs");
    await page.locator("#views button[data-value=beauty]").click();
    await until("no legend", () => page.locator("#legend").isHidden());
    await page.locator(`#lights li[data-name=second] .pick`).click();
    await page.locator("#light-remove").click();
    await until("one light", async () => (await state(page)).lights.length === 1);
    check(await page.locator("#light-name").textContent() === first, "a light that is removed leaves the selection to another");
    await page.locator("#light-remove").click();
    await page.locator("#first-light").click();
    await page.locator("#lights form input").fill("first");
    await page.locator("#lights form button").click();
    await until("a light again", async () => (await state(page)).lights.length === 1);
    check(true, "a scene without lights offers one");
    await page.locator("button[aria-label='Rename this light']").click();
    await page.locator("input[aria-label='New name of the light']").fill("key");
    await page.keyboard.press("Enter");
    await until("the light's new name", async () => await page.locator("#light-name").textContent() === "key");
    check((await state(page)).lights[0].name === "key", "a light is renamed and stays selected");
    await page.keyboard.press("Escape");
    await page.locator("#canvas").focus();
    await page.keyboard.press("Control+z");
    await until("the old name", async () => (await state(page)).lights[0].name === "first");
    check(true, "Ctrl+Z gives it its old name");
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0"));
    const page = await browser.newPage({viewport: {width: 1280, height: 800}});
    listen(page);
    await run(page, servers[0]);
});
