// Grids: a calculation grid is drawn on a surface and typed, read and held against a target; an observer is rated; the lux
// report is computed, given up, saved and printed.
//   node grid_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, savedBytes, screenshot, settled, startServer, state, until} from "./harness.mjs";

const text = (page, selector) => page.locator(selector).textContent();
const grids = async (page) => (await state(page)).grids?.grids ?? [];

// Where a place of the picture is on the screen; 0..1 of the picture.
async function at(page, x, y) {
    const {size_px} = await state(page), box = await page.locator("#screen").boundingBox();
    const scale = Math.min(box.width / size_px[0], box.height / size_px[1]);
    return [box.x + box.width / 2 + (x - 0.5) * scale * size_px[0], box.y + box.height / 2 + (y - 0.5) * scale * size_px[1]];
}

async function shot(page, name) {
    if (screenshot) await page.screenshot({path: screenshot.replace(/(\.\w+)?$/, `-${name}$1`)});
}

async function drawAndRead(page) {
    await page.locator("#grids-toggle").click();
    check(await page.locator("#grid-read").isDisabled(), "without a grid there is nothing to read");
    await page.locator("#grid-draw").click();
    await page.mouse.click(...await at(page, 0.35, 0.86));
    await until("the first corner", async () => (await text(page, "#grid-hint")).includes("opposite"));
    await page.mouse.click(...await at(page, 0.65, 0.95));
    const [grid] = await until("the grid", async () => { const all = await grids(page); return all.length === 1 && all; });
    const [u, v] = [grid.u_m, grid.v_m];
    check(grid.name === "grid 1" && u[2] * v[0] - u[0] * v[2] > 0 && Math.abs(u[1]) + Math.abs(v[1]) < 1e-6, "it lies flat on the floor and faces up", JSON.stringify([u, v]));
    await page.locator("#grid-read").click();
    await until("its values", async () => (await text(page, "#grid-result")).startsWith("Mean"));
    const {grid_values: values} = await asked(page, {grid: {name: "grid 1"}});
    const shown = await text(page, ".grid-mean"), mean = Number(/Mean ([\d.]+)/.exec(shown)[1]);
    check(Math.abs(mean / values.mean_lx - 1) < 0.02, "the mean is the server's", `${shown}; ${values.mean_lx}`);
    check(await page.locator("#grid-view text").count() === values.values_lx.length, "each value stands over the picture", `${values.values_lx.length}`);
    await until("the plan", () => page.locator("#grid-plan").evaluate((image) => image.complete && image.naturalWidth > 0));
    const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#grid-csv").click()]);
    const lines = (await savedBytes(download)).toString().trim().split("\n");
    check(lines.length === values.values_lx.length + 1 && lines[0] === "i,j,x_m,y_m,z_m,lx,left_out", "CSV has a line for each point");
}

async function typeOne(page) {
    const set = (label, value) => page.locator(`#grids input[aria-label="${label}"]`).fill(String(value));
    await page.locator("#grid-name").fill("desk");
    for (const [label, value] of [["Corner x", -0.4], ["Corner y", 0.5], ["Corner z", 0.4], ["Edge u x", 0.8], ["Edge u y", 0], ["Edge u z", 0], ["Edge v x", 0], ["Edge v y", 0], ["Edge v z", -0.8], ["Maintenance factor", 0.8]]) await set(label, value);
    await page.locator("#grid-quantity").selectOption("cylindrical");
    await page.locator("#grids select[aria-label=Spacing]").selectOption("count");
    await set("Points along u", 2);
    await set("Points along v", 2);
    await page.locator("#grid-target").selectOption("communication");
    await page.locator("#grid-keep").click();
    const desk = await until("the typed grid", async () => (await grids(page)).find(({name}) => name === "desk"));
    check(desk.quantity === "cylindrical" && desk.maintenance_factor === 0.8 && desk.target.ez_lx === 150 && desk.count.join() === "2,2", "what was typed is kept", JSON.stringify(desk));
    await page.locator("#grid-read").click();
    await until("its check", async () => (await page.locator("#grid-result .check").count()) === 2);
    const told = await page.locator("#grid-result .check").allTextContents();
    check(told.every((each) => /^(✓ pass|✗ FAIL) (Ez|U0) /.test(each)), "whether the target is met is said in words", told.join("; "));
    await shot(page, "read");
    await page.locator("#grids select[aria-label=Spacing]").selectOption("nearest");
    await page.locator("#grid-target").selectOption("own");
    await set("Own mean, lx", 1e6);
    await page.locator("#grid-quantity").selectOption("plane");
    await page.locator("#grid-keep").click();
    await until("the other target", async () => (await grids(page)).find(({name}) => name === "desk").target.em_lx === 1e6);
    await page.locator("#grid-read").click();
    await until("its failure", async () => (await page.locator("#grid-result .check.fail").allTextContents()).some((each) => each.startsWith("✗ FAIL Em")));
    check(true, "a target that is not met fails");
}

async function observe(page) {
    await page.locator("#observer-camera").click();
    await page.locator("#observer-name").fill("seat");
    await page.locator('#grids input[aria-label="Greatest UGR"]').fill("19");
    await page.locator("#observer-keep").click();
    const seat = await until("the observer", async () => (await state(page)).observers?.observers.find(({name}) => name === "seat"));
    const {camera} = await state(page);
    check(seat.eye_m.every((x, i) => Math.abs(x - camera.eye[i]) < 1e-3) && seat.direction[1] === 0, "it stands where the camera does and looks level");
    await page.locator("#ugr-read").click();
    await until("its rating", async () => /UGR/.test(await text(page, "#ugr-result")) && /luminaires glare/.test(await text(page, "#ugr-result")));
    check(/^(UGR \d|No UGR)/.test(await text(page, "#ugr-result")), "it is rated", await text(page, "#ugr-result"));
}

async function report(page, browser) {
    await page.locator("#lux-report-noise").selectOption("0.02");
    await page.locator("#lux-report").click();
    await until("its progress", async () => /parts/.test(await text(page, "#lux-report-result")));
    await page.locator("#lux-report-cancel").click();
    await until("its end", async () => (await text(page, "#lux-report-result")) === "Cancelled");
    await until("that the server gave it up", async () => (await asked(page, {stats: {}})).stats.reference_cancelled === 1);
    check(true, "the report can be given up");

    await page.locator("#lux-report-noise").selectOption("0.2");
    await page.locator("#lux-report-seconds").fill("2");
    const [download] = await Promise.all([page.waitForEvent("download", {timeout: 240000}), page.locator("#lux-report").click()]);
    const html = (await savedBytes(download)).toString();
    check(/^lux-report-cornell-\d+\.html$/.test(download.suggestedFilename()), "it is saved under the scene's name", download.suggestedFilename());
    for (const part of ["grid 1", "desk", "seat", "UGR", "SHA-256", "Signature"]) check(html.includes(part), `it has ${part}`);
    const paper = await browser.newPage({javaScriptEnabled: false});
    const asks = [];
    paper.on("request", (request) => { if (!request.url().startsWith("data:")) asks.push(request.url()); });
    await paper.setContent(html);
    check(asks.length === 0, "it asks for nothing from elsewhere", asks.join(" "));
    check(await paper.evaluate(() => [...document.images].length === 2 && [...document.images].every((image) => image.naturalWidth > 0)), "its two pictures are in it");
    check(await paper.evaluate(() => document.querySelectorAll("svg").length) === 2, "and a plan of each grid");
    const pdf = await paper.pdf({preferCSSPageSize: true, ...(screenshot ? {path: screenshot.replace(/(\.\w+)?$/, "-report.pdf")} : {})});
    const pages = pdf.toString("latin1").match(/\/Type\s*\/Page\b(?!s)/g)?.length ?? 0;
    check(pages >= 2 && pages <= 12, "it prints on a few pages of A4", `${pages}`);
    await paper.close();
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0"));
    const page = await browser.newPage({viewport: {width: 1440, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    await settled(page);
    await drawAndRead(page);
    await shot(page, "drawn");
    await typeOne(page);
    await observe(page);
    await report(page, browser);
    await page.locator("#grid-remove").click();
    await until("one grid less", async () => (await grids(page)).length === 1);
    check(true, "a grid is removed");
    await page.close();
});
