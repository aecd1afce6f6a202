// The list of lights with 500 of them: rows that are made are few, and list, search and selection change
// little of the page.
//   node many_lights_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, screenshot, startServer, until} from "./harness.mjs";
import {names} from "./place.mjs";

const kLights = 500, kMostRows = 60, kMostNodes = 25 * kMostRows;

// Types into the filter, or presses a button, and has the page drawn, three times. Result: the most nodes that came into
// the page, how many rows are in it, and the least ms, which are only told: other programs run beside this one.
const changed = (page, selector, text = null) => page.evaluate(async ([wanted, typed]) => {
    const list = document.querySelector("#light-list");
    let ms = Infinity, nodes = 0, records = [];
    const observer = new MutationObserver((changes) => records.push(...changes));
    observer.observe(document.body, {childList: true, subtree: true});
    const count = (node) => 1 + [...node.childNodes].reduce((sum, child) => sum + count(child), 0);
    const type = (text) => {
        const field = document.querySelector("#light-filter");
        field.value = text;
        field.dispatchEvent(new Event("input"));
    };
    for (let i = 0; i < 3; ++i) {
        if (typed !== null) type(typed === "" ? "none" : "");    // from another list each time
        await Promise.resolve();
        records = [];
        const node = document.querySelector(wanted), begin = performance.now();
        if (typed === null) {
            node.click();
        } else {
            type(typed);
        }
        await Promise.resolve();
        await Promise.resolve();
        list.getBoundingClientRect();
        ms = Math.min(ms, performance.now() - begin);
        records.push(...observer.takeRecords());
        nodes = Math.max(nodes, records.flatMap((record) => [...record.addedNodes]).reduce((sum, one) => sum + count(one), 0));
    }
    observer.disconnect();
    return {ms, nodes, rows: list.querySelectorAll("li[data-name]").length};
}, [selector, text]);

const told = ({nodes, rows, ms}) => `${nodes} nodes, ${rows} rows, ${ms.toFixed(1)} ms`;

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null"]));
    const page = await browser.newPage({viewport: {width: 1280, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await until("the state", () => page.evaluate(() => window.gonio?.state?.lights.length === 1));
    const [first] = await names(page);
    const add = Array.from({length: kLights - 1}, (_, i) => ({like: first, light: {name: `${i % 2 ? "spot" : "wash"} ${i}`, position_m: [-2 + (i % 20) / 5, 3, -2 + Math.floor(i / 20) / 6]}}));
    check((await asked(page, {command: {edit_lights: {add}}})).result.code === "ok", `${kLights} lights are added by one command`);
    await until("all of them", async () => (await names(page)).length === kLights);
    await until("the rows", () => page.locator("#light-list li[data-name]").count());
    const rows = () => page.locator("#light-list li[data-name]").count();
    check(await rows() <= kMostRows, "only rows that can be seen are in the page", `${await rows()} rows`);

    const search = await changed(page, "#light-filter", "wash");
    check(search.nodes < kMostNodes && search.rows <= kMostRows, "search", told(search));
    check(await page.locator("#light-all").textContent() === "Select 250", "the button says how many match");
    const choose = await changed(page, "#light-all");
    check(choose.nodes < kMostNodes, "select all that match", told(choose));
    check(await page.locator("#many-name").textContent() === "250 lights", "they are selected");
    const whole = await changed(page, "#light-filter", "");
    check(whole.nodes < kMostNodes, "the whole list", told(whole));
    const select = await changed(page, "#light-list .pick");
    check(select.nodes < kMostNodes, "select one", told(select));

    // By keyboard to the end: rows come and go, and the focus stays on the light.
    await page.locator("#light-list .pick").first().focus();
    await page.keyboard.press("End");
    const last = `${(kLights - 2) % 2 ? "spot" : "wash"} ${kLights - 2}`;
    await until("the last light", async () => await page.locator("#light-name").textContent() === last);
    const focused = () => page.evaluate(() => document.activeElement.closest("li")?.dataset.name);
    check(await focused() === last && await rows() <= kMostRows, "End goes to the last light", `${await rows()} rows`);
    await page.keyboard.press("Shift+ArrowUp");
    await page.keyboard.press("Shift+ArrowUp");
    await until("three lights", async () => await page.locator("#many-name").textContent() === "3 lights");
    check(true, "shift and arrows select a range");
    await page.keyboard.press("Control+a");
    await until("all lights", async () => await page.locator("#many-name").textContent() === `${kLights} lights`);
    check(true, "Ctrl+A selects all");
    await page.locator("#many-view input[type=number][aria-label='Level of the selected lights']").fill("25");
    await page.keyboard.press("Enter");
    await until("all dimmed", () => page.evaluate(() => window.gonio.state.lights.every((light) => light.level_ratio === 0.25)));
    check(true, "one command dims all of them");
    await page.locator("#undo").click();
    await until("all back", () => page.evaluate(() => window.gonio.state.lights.every((light) => light.level_ratio === 1)));
    check(true, "one undo sets all of them back");
    if (screenshot) await page.screenshot({path: screenshot});
});
