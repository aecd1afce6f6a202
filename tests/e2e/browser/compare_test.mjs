// Compare: pictures are kept, laid side by side and under a divider; presets are compared without changing the lights.
//   node compare_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, screenshot, settled, startServer, state, until} from "./harness.mjs";

// Mean luma of the lower half of what is on the screen between two shares of the comparison's width.
async function luma(page, from, to) {
    const box = await page.locator("#compare-view").boundingBox();
    const png = await page.screenshot({clip: {x: box.x + from * box.width, y: box.y + 0.55 * box.height, width: (to - from) * box.width, height: 0.4 * box.height}});
    return page.evaluate(async (base64) => {
        const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], {type: "image/png"}));
        const canvas = Object.assign(document.createElement("canvas"), {width: bitmap.width, height: bitmap.height});
        const context = canvas.getContext("2d");
        context.drawImage(bitmap, 0, 0);
        const {data} = context.getImageData(0, 0, canvas.width, canvas.height);
        let sum = 0;
        for (let i = 0; i < data.length; i += 4) sum += 0.2126 * data[i] + 0.7152 * data[i + 1] + 0.0722 * data[i + 2];
        return sum / (data.length / 4);
    }, png.toString("base64"));
}

async function keep(page, side) {
    const before = await page.locator("#compare .kept li").count();
    await page.locator(`#keep-${side}`).click();
    await until("a kept picture", async () => await page.locator("#compare .kept li").count() === before + 1 && page.locator(`#keep-${side}`).isEnabled());
}

async function run(page) {
    const light = (await state(page)).lights[0].name;
    const level = async (level_ratio) => {
        await asked(page, {command: {set_light: {name: light, level_ratio}}});
        await until("the level", async () => Math.abs((await state(page)).lights[0].level_ratio - level_ratio) < 1e-9);
        await settled(page);
    };
    await asked(page, {command: {set_exposure: {ev100: (await state(page)).exposure_ev100}}});
    await page.locator("#compare-toggle").click();
    await keep(page, "a");
    await level(0.1);
    await keep(page, "b");
    await page.locator("#compare button[data-mode=wipe]").click();
    const left = await luma(page, 0.3, 0.48), right = await luma(page, 0.52, 0.7);
    check(left > 1.5 * right, "under the divider A is on the left, B on the right", `${left.toFixed(0)}, ${right.toFixed(0)}`);

    // The divider: dragged, by keys, and as a number.
    const slider = page.locator("#compare-view [role=slider]"), at = () => slider.getAttribute("aria-valuenow").then(Number);
    const box = await page.locator("#compare-view").boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + 100);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.75 * box.width, box.y + 140, {steps: 4});
    await page.mouse.up();
    check(Math.abs(await at() - 75) < 1, "it is dragged", `${await at()} %`);
    check(await luma(page, 0.52, 0.7) > 1.5 * right, "and A goes on to it");
    await slider.press("ArrowLeft");
    check(Math.abs(await at() - 74) < 1, "an arrow key moves it by 1 %");
    await slider.press("Shift+ArrowRight");
    check(Math.abs(await at() - 84) < 1, "with Shift by 10 %");
    await slider.press("Home");
    check(await at() === 0, "Home moves it to the edge");
    await page.locator("#compare input[type=number]").fill("30");
    await page.locator("#compare input[type=number]").press("Enter");
    check(await at() === 30 && await slider.getAttribute("aria-label") === "Divider between A and B", "a number does too");
    if (screenshot) await page.screenshot({path: screenshot});

    await page.locator("#compare button[data-mode=side]").click();
    const a = await luma(page, 0.15, 0.35), b = await luma(page, 0.65, 0.85);
    check(a > 1.5 * b, "side by side", `${a.toFixed(0)}, ${b.toFixed(0)}`);
    if (screenshot) await page.screenshot({path: screenshot.replace(/(\.\w+)?$/, "-side$1")});

    // One picture and what is live.
    await page.locator("#compare .kept li").nth(1).locator("[data-side=b]").click();
    await level(1);
    await until("the live picture as B", async () => Math.abs(await luma(page, 0.65, 0.85) - a) < 0.2 * a);
    check(await page.locator("#compare-view .b figcaption").textContent() === "BLive", "without a picture of its own B is live");
    await page.locator("#compare button[data-mode=a]").focus();
    await page.keyboard.press("ArrowLeft");
    check(await page.locator("#compare-view").isHidden(), "arrow keys choose how; off shows the live picture alone");

    // The legend of false colour stays where both pictures have its scale, beside their captions.
    await page.locator("#views button[data-value=illuminance]").click();
    await settled(page);
    await keep(page, "a");
    await page.locator("#compare button[data-mode=wipe]").click();
    const legend = await page.locator("#legend").boundingBox(), comparison = await page.locator("#compare-view").boundingBox();
    check(legend.x >= comparison.x + comparison.width, "the legend is beside the comparison");
    if (screenshot) await page.screenshot({path: screenshot.replace(/(\.\w+)?$/, "-legend$1")});
    await asked(page, {command: {set_view: {range_low: 1, range_high: 500}}});
    await until("no legend", () => page.locator("#legend").isHidden());
    check(true, "and goes where they have different scales");
    await page.locator("#compare button[data-mode=off]").click();
    await page.locator("#views button[data-value=beauty]").click();
    await page.locator("#compare .kept li").nth(2).locator("button[aria-label^=Forget]").click();
    await settled(page);

    // Presets: each is shown for its picture, and the lights come back.
    await asked(page, {command: {save_preset: {name: "bright"}}});
    await asked(page, {command: {set_light: {name: light, level_ratio: 0.1}}});
    await asked(page, {command: {save_preset: {name: "dim"}}});
    await level(0.5);
    for (const name of ["bright", "dim"]) {
        const before = await page.locator("#compare .kept li").count();
        await page.locator("#compare select").selectOption(name);
        await page.locator("#keep-preset").click();
        await until("its picture", async () => await page.locator("#compare .kept li").count() === before + 1 && page.locator("#keep-preset").isEnabled());
        await until("the lights as they were", async () => (await state(page)).lights[0].level_ratio === 0.5);
    }
    check(true, "pictures of two presets are kept, and the lights are as they were");
    const names = await page.locator("#compare .kept .name").allTextContents();
    check(names.at(-2).includes("bright") && names.at(-1).includes("dim"), "they have the presets' names", names.join(", "));
    await page.locator("#compare .kept li").nth(names.length - 2).locator("[data-side=a]").click();
    await page.locator("#compare .kept li").nth(names.length - 1).locator("[data-side=b]").click();
    await page.locator("#compare button[data-mode=wipe]").click();
    await page.locator("#compare input[type=number]").fill("50");
    await page.locator("#compare input[type=number]").press("Enter");
    const bright = await luma(page, 0.3, 0.48), dim = await luma(page, 0.52, 0.7);
    check(bright > 1.5 * dim, "A and B show the two presets", `${bright.toFixed(0)}, ${dim.toFixed(0)}`);

    // Bounded; and Escape ends it.
    for (let i = names.length; i < 14; ++i) {
        await page.locator("#keep-a").click();
        await until("the next", () => page.locator("#keep-a").isEnabled());
    }
    check(await page.locator("#compare .kept li").count() === 12, "the strip keeps twelve");
    await page.locator("#compare button[data-mode=wipe]").click();
    await page.locator("#compare-view [role=slider]").focus();
    await page.keyboard.press("Escape");
    check(await page.locator("#compare-view").isHidden(), "Escape ends the comparison");
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0"));
    const page = await browser.newPage({viewport: {width: 1280, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    await settled(page);
    await run(page);
});
