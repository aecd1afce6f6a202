// The page on a telephone, a tablet and three desktops, in light and dark: no overlap, nothing cut, no jumps, and nothing that
// axe-core (WCAG 2.2 A and AA) finds. With GONIO_LAYOUTS=all: all sizes in both schemes; else a telephone and the smallest desktop
// in one each.
//   node layout_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {mkdtempSync, readFileSync, writeFileSync} from "node:fs";
import {createRequire} from "node:module";
import {tmpdir} from "node:os";
import {join} from "node:path";

import {asked, check, end, inBrowser, listen, screenshot, settled, startServer, until} from "./harness.mjs";

const kSizes = {phone: [390, 844], tablet: [820, 1180], desktop: [1440, 900], "small desktop": [1024, 768],
    "wide desktop": [1920, 1080], "phone on its side": [844, 390]};
const kAll = process.env.GONIO_LAYOUTS === "all";
const kSchemes = {phone: ["dark"], "small desktop": ["light"]};
const schemes = (size) => kAll ? ["dark", "light"] : kSchemes[size] ?? [];
const kAxe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const kTags = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"];

// Of the page, or of a part of it.
async function findings(page, part) {
    return page.evaluate(async ({tags, part}) => {
        const {violations} = await axe.run(part ?? document, {runOnly: tags, resultTypes: ["violations"], rules: {"target-size": {enabled: true}}});
        return violations.map(({id, impact, nodes}) =>
            `${impact} ${id}: ${nodes.slice(0, 4).map(({target, any}) => `${target.join(" ")} ${any[0]?.message ?? ""}`).join(" | ")}`);
    }, {tags: kTags, part});
}

// What is wrong with where things are.
function misplaced(page) {
    return page.evaluate(() => {
        const found = [], root = document.scrollingElement;
        const seen = (node) => node.checkVisibility({visibilityProperty: true}) && node.getClientRects().length > 0;
        const name = (node) => node.id || node.getAttribute("aria-label") || node.textContent.trim().slice(0, 30);
        if (root.scrollWidth > root.clientWidth) found.push(`the page is ${root.scrollWidth} px wide in ${root.clientWidth}`);
        // On a telephone the drawer lies over the panels.
        const parts = [...document.querySelectorAll(innerWidth > 600 ? "#bar, #left, #views, #screen, #drawer, #stats, #inspector" : "#bar, #views, #screen, #stats, #panels")].filter(seen);
        for (const [i, one] of parts.entries()) {
            for (const other of parts.slice(i + 1)) {
                const a = one.getBoundingClientRect(), b = other.getBoundingClientRect();
                if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1)
                    found.push(`${name(one)} lies over ${name(other)}`);
            }
        }
        for (const node of [...document.querySelectorAll("button, label, h2, h3, .label")].filter(seen)) {
            if (node.scrollWidth > node.clientWidth + 1 && node.clientWidth > 0 && getComputedStyle(node).display !== "inline") found.push(`"${name(node)}" is cut`);
        }
        for (const node of [...document.querySelectorAll("input[type=number], #look input[type=text]")].filter(seen))
            if (node.scrollWidth > node.clientWidth + 1) found.push(`field "${name(node)}" cuts "${node.value}"`);
        for (const node of [...document.querySelectorAll("select")].filter(seen)) {
            const text = document.createElement("canvas").getContext("2d"), style = getComputedStyle(node);
            text.font = style.font;
            const needs = text.measureText(node.selectedOptions[0]?.textContent ?? "").width + parseFloat(style.paddingLeft) + parseFloat(style.paddingRight);
            if (needs > node.clientWidth + 2 && !/^[/.]|upload:/.test(node.value) && node.clientWidth < 200) found.push(`select "${name(node)}" cuts "${node.value}"`);
        }
        for (const node of document.querySelectorAll(".slider input[type=range]"))
            if (!node.closest(".slider").querySelector("input[type=number]")) found.push(`${name(node)} has no number`);
        return found;
    });
}

async function look(page, what, part) {
    const wrong = [...await misplaced(page), ...await findings(page, part)];
    check(wrong.length === 0, what, wrong.join("\n"));
}

async function shots(page, name) {
    if (screenshot) await page.screenshot({path: screenshot.replace(/(\.\w+)?$/, `-${name}$1`)});
}

async function run(browser, server, size, scheme) {
    const [width, height] = kSizes[size], small = !size.endsWith("desktop");
    const context = await browser.newContext({viewport: {width, height}, hasTouch: small, isMobile: size.startsWith("phone"), colorScheme: scheme, reducedMotion: "reduce"});
    const page = await context.newPage();
    listen(page);
    await page.goto(server.url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    await settled(page);
    await page.evaluate(`${kAxe}; undefined`);
    const at = `${size}, ${scheme}`;
    await shots(page, `${size}-${scheme}`);
    await look(page, `the page as it opens: ${at}`);
    check(await page.evaluate(() => document.getAnimations().length) === 0, `nothing moves by itself where less motion is asked for: ${at}`);

    const tabs = await page.locator(".drawer-tabs button").all(), places = new Set();
    for (const tab of tabs) {
        await tab.click();
        const id = await tab.getAttribute("aria-controls");
        await page.waitForTimeout(300);    // its table is asked for
        await shots(page, `${size}-${scheme}-${id}`);
        await look(page, `the tool "${await tab.textContent()}": ${at}`, "#drawer");
        places.add(JSON.stringify(await page.locator("#screen").boundingBox()));
    }
    check(places.size === 1, `the picture rests while its tools change: ${at}`, [...places].join(" "));
    await tabs.at(-1).click();
    check(await page.locator(".drawer-body").isHidden(), `a second click closes the drawer: ${at}`);

    await page.locator("#profile-file").setInputFiles({name: "bad.ies", mimeType: "text/plain", buffer: Buffer.from("no photometry")});
    await page.locator("#profile-error").waitFor();
    await page.locator("#scene select").selectOption("");
    await page.locator("#scene form input").fill("/no/such/file.glb");
    await page.locator("#scene form input").press("Enter");
    if (await page.evaluate(() => window.gonio.state.show.unsaved)) {
        await page.locator("#unsaved-dialog").waitFor();
        await shots(page, `${size}-${scheme}-unsaved`);
        await look(page, `what is not saved: ${at}`, "#unsaved-dialog");
        await page.locator("#unsaved-discard").click();
    }
    await page.locator(".toast").waitFor();
    await shots(page, `${size}-${scheme}-refused`);
    await look(page, `what was refused: ${at}`);
    await page.locator("#scene form input").press("Escape");
    await page.locator(".toast button").click();
    await page.locator("#help").click();
    await shots(page, `${size}-${scheme}-help`);
    await look(page, `keys and pointer: ${at}`);
    await page.keyboard.press("Escape");
    await page.locator("#views button[data-value=illuminance]").click();
    await until("the legend", () => page.locator("#legend").isVisible());
    await settled(page);
    await shots(page, `${size}-${scheme}-illuminance`);
    await look(page, `lux in false colour: ${at}`);
    const share = await page.evaluate(() => {
        const area = (selector) => { const {width, height} = document.querySelector(selector).getBoundingClientRect(); return width * height; };
        return area("#legend") / area("#screen");
    });
    check(share < 0.2, `the legend covers at most a fifth of the picture: ${at}`, `${(100 * share).toFixed(0)} %`);
    await page.locator("#views button[data-value=beauty]").click();
    await settled(page);
    await context.close();
}

// What stands over the picture while a token is asked for.
async function locked(browser) {
    const token = join(mkdtempSync(join(tmpdir(), "gonio-")), "token");
    writeFileSync(token, "a-token-for-this-test\n", {mode: 0o600});
    const server = await startServer("127.0.0.1:0", ["--renderer", "null", "--token-file", token]);
    for (const [size, [width, height]] of Object.entries(kSizes)) {
        for (const colorScheme of schemes(size)) {
            const page = await browser.newPage({viewport: {width, height}, colorScheme});
            await page.goto(server.url);
            await page.locator("#token").waitFor();
            await page.evaluate(`${kAxe}; undefined`);
            await shots(page, `${size}-${colorScheme}-locked`);
            await look(page, `a page that asks for a token: ${size}, ${colorScheme}`);
            await page.close();
        }
    }
    await end(server.child, "SIGTERM");
}

// By hand, and kept.
async function themes(browser, server) {
    const page = await browser.newPage({colorScheme: "dark"});
    listen(page);
    const dark = async () => {
        const [r, g, b] = (await page.evaluate(() => getComputedStyle(document.documentElement).backgroundColor)).match(/\d+/g).map(Number);
        return r + g + b < 384;
    };
    await page.goto(server.url);
    check(await dark(), "dark where the system is");
    await page.locator("#theme").click();
    check(!await dark(), "light by a click", await page.locator("#theme").getAttribute("aria-label"));
    await page.reload();
    check(!await dark(), "and still after the page is opened anew");
    await page.locator("#theme").click();
    check(await dark(), "dark by another");
    await page.locator("#theme").click();
    await page.emulateMedia({colorScheme: "light"});
    check(!await dark(), "and as the system again");
    await page.close();
}

// The drawer and the list of keys without a pointer.
async function keyboard(browser, server) {
    const page = await browser.newPage();
    listen(page);
    await page.goto(server.url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    const focused = () => page.evaluate(() => document.activeElement.id);
    let stops = 0;
    for (; stops < 10 && await focused() !== "canvas"; ++stops) {
        await page.keyboard.press("Tab");
        if (await focused() === "skip") await page.keyboard.press("Enter");
    }
    check(await focused() === "canvas", "the picture is reached by at most ten stops of the Tab key", String(stops));
    const level = async () => (await page.evaluate(() => window.gonio.state.lights[0].level_ratio)), before = await level();
    await page.locator("#light-list .pick").first().focus();
    await page.keyboard.press("Shift+ArrowLeft");
    await until("a lower level", async () => Math.abs(await level() - before + 0.1) < 1e-9);
    await page.keyboard.press("Tab");
    check(await page.evaluate(() => document.activeElement.closest("#light-list")) === null, "a luminaire is one stop; left and right ride its level");
    await page.locator("#light-list .pick").first().focus();
    await page.keyboard.press("Shift+ArrowRight");
    await until("the level of before", async () => Math.abs(await level() - before) < 1e-9);
    await page.locator("#meter-toggle").focus();
    await page.keyboard.press("Enter");
    check(await page.locator("#meter").isVisible(), "Enter opens a tool");
    await page.keyboard.press("ArrowLeft");
    check(await focused() === "report-toggle", "arrow keys go around the tabs");
    await page.keyboard.press(" ");
    check(await page.locator("#report").isVisible() && await page.locator("#meter").isHidden(), "one tool at a time");
    await page.locator("#report .scroll").focus();
    await page.keyboard.press("Escape");
    check(await page.locator(".drawer-body").isHidden() && await focused() === "report-toggle", "Escape closes the drawer and goes to its tab");
    await page.keyboard.press("?");
    check(await page.locator("#shortcuts").isVisible(), "? lists the keys", `${await page.locator("#shortcuts dt").count()} rows`);
    await page.keyboard.press("Escape");
    check(await page.locator("#shortcuts").isHidden(), "Escape closes the list");
    await page.close();
}

// Panels are as large as somebody drags them, parts of them fold, and both stay so.
async function panels(browser, server) {
    const context = await browser.newContext({viewport: {width: 1440, height: 900}});
    const page = await context.newPage();
    listen(page);
    await page.goto(server.url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    const name = (await page.evaluate(() => window.gonio.state.lights[0].name));
    for (const group of ["front", "side"]) await asked(page, {command: {set_group: {name: group, lights: [name]}}});
    await page.locator("#groups li").nth(1).waitFor();
    for (const [width, height] of [[1440, 900], [1920, 1080], [1024, 768]]) {
        await page.setViewportSize({width, height});
        const {panel, last} = await page.evaluate(() => ({panel: document.querySelector("#groups").getBoundingClientRect().bottom,
            last: document.querySelector("#groups li:last-child").getBoundingClientRect().bottom}));
        check(last <= panel && last <= height, `both groups are seen at ${width} × ${height}`, `${last.toFixed(0)} of ${panel.toFixed(0)}`);
    }
    await page.setViewportSize({width: 1440, height: 900});
    const width = async (selector) => Math.round((await page.locator(selector).boundingBox()).width);
    const edge = await page.locator(".edge.left").boundingBox(), at = [edge.x + edge.width / 2, edge.y + 200], before = await width("#left");
    await page.mouse.move(...at);
    await page.mouse.down();
    await page.mouse.move(at[0] + 80, at[1], {steps: 4});
    await page.mouse.up();
    check(await width("#left") === before + 80, "an edge is dragged", `${before} to ${await width("#left")} px`);
    await page.locator(".edge.right").focus();
    const right = await width("#inspector");
    await page.keyboard.press("ArrowLeft");
    check(await width("#inspector") === right + 16, "and moved by arrow keys");
    await page.locator("#haze .fold").click();
    check(await page.locator("#haze select, #haze button.chip").first().isHidden() && await page.locator("#haze h2").isVisible(), "a heading folds its part");
    await page.reload();
    await until("the page again", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    check(await width("#left") === before + 80 && await width("#inspector") === right + 16
        && await page.locator("#haze .fold").getAttribute("aria-expanded") === "false", "both stay when the page is opened anew");
    await page.locator(".edge.left").dblclick();
    check(await width("#left") === before, "a double click sets an edge back");
    for (const group of ["front", "side"]) await asked(page, {command: {set_group: {name: group, lights: []}}});
    await context.close();
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null"]));
    for (const size of Object.keys(kSizes)) for (const scheme of schemes(size)) await run(browser, servers[0], size, scheme);
    await locked(browser);
    await themes(browser, servers[0]);
    await keyboard(browser, servers[0]);
    await panels(browser, servers[0]);
});
