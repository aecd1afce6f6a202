// One headless Chromium for all page tests of a run: each test has a context of its own in it.
//   node chromium.mjs start|end FILE   FILE: where it can be reached, while it runs
// It also ends when the process that started it does (ctest), so that an interrupted run leaves none behind.

import {spawn} from "node:child_process";
import {existsSync, readFileSync, renameSync, rmSync, writeFileSync} from "node:fs";
import {fileURLToPath} from "node:url";

const kChromium = process.env.GONIO_CHROMIUM ?? "/usr/bin/chromium";
const kArguments = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync"];
const kStartMs = 60000;
export const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

const alive = (pid) => {
    try {
        process.kill(pid, 0);
        return true;
    } catch {
        return false;
    }
};

// playwright-core, or null where it or Chromium is missing.
export async function playwright() {
    return existsSync(kChromium) ? import("playwright-core").catch(() => null) : null;
}

// A browser: the shared one where `file` names one that runs, else one for this process alone.
export async function browserOf({chromium}, file) {
    if (file && existsSync(file)) return chromium.connect(JSON.parse(readFileSync(file, "utf8")).url);
    return chromium.launch({executablePath: kChromium, args: kArguments});
}

async function serve(file, starter) {
    const {chromium} = await playwright();
    const server = await chromium.launchServer({executablePath: kChromium, args: kArguments});
    writeFileSync(`${file}.new`, JSON.stringify({url: server.wsEndpoint(), pid: process.pid}));
    renameSync(`${file}.new`, file);
    const end = async () => {
        rmSync(file, {force: true});
        await server.close();
        process.exit(0);
    };
    process.on("SIGTERM", end);
    server.on("close", () => process.exit(1));
    for (;;) {
        await sleep(1000);
        if (!alive(starter)) await end();
    }
}

async function start(file) {
    rmSync(file, {force: true});
    if (!await playwright()) return;    // the tests say so
    spawn(process.execPath, [fileURLToPath(import.meta.url), "serve", file, String(process.ppid)], {detached: true, stdio: "ignore"}).unref();
    for (const until = Date.now() + kStartMs; !existsSync(file); await sleep(50)) {
        if (Date.now() > until) throw new Error(`no Chromium in ${kStartMs} ms`);
    }
}

async function end(file) {
    if (!existsSync(file)) return;
    const {pid} = JSON.parse(readFileSync(file, "utf8"));
    process.kill(pid, "SIGTERM");
    for (let i = 0; i < 100 && alive(pid); ++i) await sleep(50);
}

const [script, verb, file, starter] = process.argv.slice(1);
if (script === fileURLToPath(import.meta.url)) await {start, end, serve}[verb](file, Number(starter));
