// What the page's tests share: a goniod of their own, a context in headless Chromium, checks and waits.
// Arguments of each: GONIOD_BINARY [SCREENSHOT.png]; exit code 77: Chromium or playwright-core are missing.

import {spawn} from "node:child_process";
import {mkdtempSync, readFileSync, rmSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";

import {browserOf, playwright as installed, sleep} from "./chromium.mjs";

export {sleep};

export const kTimeoutMs = 30000;

export const [binary, screenshot] = process.argv.slice(2);
if (!binary) {
    console.error("usage: node TEST.mjs GONIOD_BINARY [SCREENSHOT.png]");
    process.exit(1);
}
export const playwright = await installed();
if (!playwright) {
    console.log("skipped: Chromium or playwright-core is missing");
    process.exit(77);
}

// ---------------------------------------------------------------------------------------------------- the server
const children = new Set();
process.on("exit", () => { for (const child of children) child.kill("SIGKILL"); });

// Unless `more` says otherwise the picture is small and its later bounces are coarse, which saves seconds of a core at each
// start. Tests that look at no pixel of it give `--renderer null`.
const kCheap = {"--scene": "cornell", "--size": "320x320", "--max-transport-mib": "16"};
export function startServer(listen, more = [], {sized = !more.includes("--state")} = {}) {    // a saved show has a size
    const kept = sized ? [] : ["--size"];
    const cheap = Object.entries(kCheap).filter(([option]) => !more.includes(option) && !kept.includes(option)).flat();
    return new Promise((resolve, reject) => {
        const child = spawn(binary, ["--listen", listen, ...cheap, ...more], {stdio: ["ignore", "pipe", "pipe"]});
        children.add(child);
        let out = "", log = "";
        const timer = setTimeout(() => reject(new Error(`no READY line in time\n${log}`)), 2 * kTimeoutMs);
        child.stderr.on("data", (data) => { log = (log + data).slice(-4000); });
        child.stdout.on("data", (data) => {
            out += data;
            const ready = /^READY (http:\/\/\S+)$/m.exec(out);
            if (!ready) return;
            clearTimeout(timer);
            resolve({child, url: ready[1], log: () => log});
        });
        child.on("error", reject);
        child.on("exit", (code) => { children.delete(child); reject(new Error(`goniod ended with ${code}\n${log}`)); });
    });
}

export function end(child, signal) {
    return new Promise((resolve) => {
        if (child.exitCode !== null || child.signalCode !== null) return resolve();
        child.on("exit", resolve);
        child.kill(signal);
    });
}

// The bytes of a file that the page saved.
export async function savedBytes(download) {
    const folder = mkdtempSync(join(tmpdir(), "gonio-saved-"));
    try {
        await download.saveAs(join(folder, "file"));
        return readFileSync(join(folder, "file"));
    } finally {
        rmSync(folder, {recursive: true});
    }
}

// ---------------------------------------------------------------------------------------------------- checks
class Failure extends Error {}

export function check(condition, text, detail = "") {
    if (!condition) throw new Failure(`${text}${detail === "" ? "" : ` (${detail})`}`);
    console.log(`ok - ${text}${detail === "" ? "" : ` (${detail})`}`);
}

export async function until(what, probe, timeout_ms = kTimeoutMs) {
    const end_ms = Date.now() + timeout_ms;
    for (let last; ; await sleep(50)) {
        last = await probe();
        if (last) return last;
        if (Date.now() > end_ms) throw new Failure(`in ${timeout_ms} ms not seen: ${what}`);
    }
}

// 64 x 64 luma values of what the page shows, and their mean and spread.
export async function picture(page, selector = "#canvas") {
    const luma = await page.evaluate((wanted) => {
        const small = document.createElement("canvas");
        small.width = small.height = 64;
        const context = small.getContext("2d", {willReadFrequently: true});
        context.drawImage(document.querySelector(wanted), 0, 0, 64, 64);
        const {data} = context.getImageData(0, 0, 64, 64);
        return Array.from({length: 4096}, (_, i) => 0.2126 * data[4 * i] + 0.7152 * data[4 * i + 1] + 0.0722 * data[4 * i + 2]);
    }, selector);
    const mean = luma.reduce((sum, value) => sum + value, 0) / luma.length;
    const spread = Math.sqrt(luma.reduce((sum, value) => sum + (value - mean) ** 2, 0) / luma.length);
    return {luma, mean, spread};
}

export const difference = (a, b) => a.luma.reduce((sum, value, i) => sum + Math.abs(value - b.luma[i]), 0) / a.luma.length;

export const state = (page) => page.evaluate(() => window.gonio.state);

// Until the picture shows everything that the page was told of, and has come to rest.
export async function settled(page) {
    await until("every bounce", () => page.evaluate(() => window.gonio.transportReady), 4 * kTimeoutMs);    // its threads yield to all others
    await until("the newest picture at rest", () => page.evaluate(() => window.gonio.shownRev >= window.gonio.sceneRev && window.gonio.shownFinal),
        4 * kTimeoutMs);
    return picture(page);
}

// What another client of the page's server is answered to a message without request_id.
export function asked(page, message) {
    return page.evaluate((wanted) => new Promise((resolve) => {
        const socket = new WebSocket(`ws://${location.host}/v1/ws`, "gonio.v1.json");
        socket.onopen = () => socket.send(JSON.stringify({request_id: 1, identify: {client: "other hand"}}));
        socket.onmessage = ({data}) => {
            const answer = JSON.parse(data);
            if (answer.ready) socket.send(JSON.stringify({request_id: 2, ...wanted}));
            if (answer.request_id === 2) { socket.close(); resolve(answer); }
        };
    }), message);
}

const complaints = [];

// Errors of the page fail the test, but for those of its console that are expected.
export function listen(page, expected = () => false) {
    page.on("pageerror", (error) => complaints.push(`page error: ${error.stack ?? error}`));
    page.on("console", (message) => {
        if (message.type() === "error" && !expected(message)) complaints.push(`console error: ${message.text()} at ${message.location().url}`);
    });
}

// Runs body(browser, servers) and ends the process. Where it fails the log of the last of `servers` is told.
export async function inBrowser(body) {
    let failed = false, browser;
    const servers = [];
    try {
        browser = await browserOf(playwright, process.env.GONIO_CHROMIUM_AT);
        await body(browser, servers);
        check(complaints.length === 0, "no page error and no console error", complaints.join("\n"));
    } catch (error) {
        failed = true;
        console.log(`not ok - ${error instanceof Failure ? error.message : error.stack}`);
        for (const complaint of complaints) console.log(`# ${complaint}`);
        if (servers.length) console.log(servers.at(-1).log().replace(/^/gm, "# "));
    } finally {
        await browser?.close();
        for (const child of [...children]) await end(child, "SIGTERM");
    }
    process.exit(failed ? 1 : 0);
}
