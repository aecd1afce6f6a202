// Render: stills of a chosen view, quality, size and file type; progress, cancel, and the strip they go into.
//   node render_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, kTimeoutMs, listen, savedBytes, screenshot, settled, sleep, startServer, state, until} from "./harness.mjs";

const field = (page, label) => page.locator(`#render [aria-label='${label}']`);
const told = (page) => page.locator("#render-told").textContent();
const stills = (page) => page.locator("#render .kept li");
const shot = (page, name) => screenshot && page.screenshot({path: screenshot.replace(/(\.\w+)?$/, `-${name}$1`)});

// Fields by their labels, then Render. Result: what is told of the still.
async function render(page, choices) {
    for (const [label, value] of Object.entries(choices)) await field(page, label).selectOption(value);
    const before = await stills(page).count();
    await page.locator("#render-start").click();
    await until("a still", async () => await stills(page).count() === before + 1 && page.locator("#render-start").isEnabled(), 4 * kTimeoutMs);    // references yield to all else
    return told(page);
}

async function saved(page) {
    const [download] = await Promise.all([page.waitForEvent("download"), stills(page).first().getByRole("button", {name: /^Save/}).click()]);
    return {name: download.suggestedFilename(), bytes: await savedBytes(download)};
}

// Width, height and RGBA of the newest still.
const pixels = (page) => stills(page).first().locator("img").evaluate(async (image) => {
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), {width: image.naturalWidth, height: image.naturalHeight});
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return {width: canvas.width, height: canvas.height, data: [...context.getImageData(0, 0, canvas.width, canvas.height).data]};
});

async function files(page) {
    const size = (await state(page)).size_px;
    const text = await render(page, {});
    const png = await saved(page);
    check(text === `Rendered ${size[0]} × ${size[1]}`, "a still as the picture is shown", text);
    check(/^cornell-beauty-\d+\.png$/.test(png.name) && png.bytes.subarray(1, 4).toString() === "PNG", "it is saved as PNG", png.name);

    check(await page.locator("#render-legend").isHidden(), "Beauty has no legend");
    await field(page, "Size of the still").selectOption("own");
    await field(page, "Width, px").fill("5000");
    await page.locator("#render-start").click();
    check(await stills(page).count() === 1 && await field(page, "Width, px").evaluate((input) => !input.validity.valid), "5000 pixels are beyond the bound");
    await field(page, "Width, px").fill("320");
    await field(page, "Height, px").fill("240");
    await render(page, {"View to render": "illuminance", "File type": "jpg"});
    const plain = await pixels(page);
    await page.locator("#render-legend").check();
    await render(page, {});
    const legend = await pixels(page), jpeg = await saved(page);
    const differs = legend.data.filter((value, i) => Math.abs(value - plain.data[i]) > 40).length / legend.data.length;
    check(legend.width === 320 && legend.height === 240 && /^cornell-illuminance-\d+\.jpg$/.test(jpeg.name) && jpeg.bytes.readUInt16BE(0) === 0xffd8,
        "of another view, size and file type", jpeg.name);
    check(differs > 0.01 && differs < 0.4, "the legend is in the picture", `${(100 * differs).toFixed(1)} % of the values`);

    await render(page, {"File type": "exr"});
    const exr = await saved(page);
    check(await page.locator("#render-legend").isHidden() && exr.bytes.readUInt32LE(0) === 20000630 && await stills(page).first().locator("img").count() === 0,
        "EXR has values, no legend and no thumbnail", exr.name);
    check((await state(page)).view === "beauty", "the live picture stays as it is");
}

async function reference(page) {
    check(await field(page, "Noise target, percent").isHidden(), "a live still has no noise");
    await field(page, "Width, px").fill("64");
    await field(page, "Height, px").fill("48");
    await field(page, "Quality of the still").selectOption("reference");
    check(await page.locator("#render-denoise").isHidden(), "illuminance is not denoised");
    await field(page, "Noise target, percent").fill("20");
    const text = await render(page, {"View to render": "", "File type": "png"});
    const [, samples, noise] = /64 × 48, (\d+) samples, noise ([\d.]+) %$/.exec(text) ?? [];
    check(Number(samples) >= 8 && Number(noise) <= 20, "a reference tells its samples and noise", text);
    await page.locator("#render-denoise").check();
    check(await field(page, "Noise target, percent").isHidden(), "what is denoised ends by itself");
    await page.locator("#render-denoise").uncheck();

    // One that does not end by itself while the test waits.
    await field(page, "Noise target, percent").fill("0.05");
    await page.locator("#render-start").click();
    const bar = page.locator("#render-bar");
    await until("how far it is", async () => /samples · noise .* left/.test(await told(page)) && await bar.getAttribute("value") !== null, 4 * kTimeoutMs);
    check(await bar.isVisible() && await page.locator("#render-start").isDisabled(), "how far it is", await told(page));
    await shot(page, "progress");
    await page.locator("#render-cancel").click();
    await until("the end", async () => await told(page) === "Cancelled" && page.locator("#render-start").isEnabled());
    await until("an idle server", async () => !(await asked(page, {stats: {}})).stats.reference_running);
    const {stats} = await asked(page, {stats: {}});
    check(stats.reference_cancelled === 1 && await bar.isHidden(), "Cancel ends the work on the server too");

    await field(page, "Longest time, seconds").fill("0.3");
    const short = await render(page, {});
    check(/samples/.test(short), "a time limit ends it with what it has", short);
}

async function strip(page) {
    await stills(page).first().getByRole("button", {name: /^Compare/}).click();
    check(await page.locator("#compare .kept li").count() === 1, "a still goes to Compare");
    const before = await stills(page).count();
    await stills(page).first().getByRole("button", {name: /^Forget/}).click();
    check(await stills(page).count() === before - 1, "a still is forgotten");

    // The bound of the strip, with a server that answers at once.
    const kept = await page.evaluate(async () => {
        const {RenderPanel} = await import("/render.js");
        const node = document.createElement("section"), store = Object.assign(new EventTarget(), {state: {view: "beauty"}});
        const image = btoa("no picture");
        let asked = 0;
        new RenderPanel(store, {request: async () => ({capture: {image, format: "exr", width_px: ++asked, height_px: 1, scene_rev: asked}})}, node, null);
        for (let i = 0; i < 26; ++i) {
            node.querySelector("form").dispatchEvent(new Event("submit", {cancelable: true}));
            await new Promise((resolve) => setTimeout(resolve));
        }
        return [asked, node.querySelectorAll("li").length, node.querySelector("li .facts").textContent];
    });
    check(kept[0] === 26 && kept[1] === 24 && kept[2].includes("26 × 1"), "of 26 stills the newest 24 stay", kept.join(", "));
}

inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0"));
    const page = await browser.newPage({viewport: {width: 1440, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await settled(page);
    await page.locator("#render-toggle").click();
    await files(page);
    await sleep(50);
    await shot(page, "files");
    await reference(page);
    await strip(page);
});
