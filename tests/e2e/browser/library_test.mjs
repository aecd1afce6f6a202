// The library of photometry: files of a folder, search, "Use", a drag onto a light, files that are none.
//   node library_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {mkdirSync, mkdtempSync, rmSync, symlinkSync, writeFileSync} from "node:fs";
import {tmpdir} from "node:os";
import {join} from "node:path";
import {asked, check, inBrowser, listen, screenshot, startServer, until} from "./harness.mjs";
import {light} from "./place.mjs";

// LM-63-2002 of intensity peak·cos²(v) in the lower half, which gives 2π·peak/3 lm.
function lm63(maker, peak) {
    const angles = Array.from({length: 37}, (_, i) => 2.5 * i), candela = angles.map((v) => (peak * Math.cos(v * Math.PI / 180) ** 2).toFixed(2));
    return ["IESNA:LM-63-2002", `[MANUFAC] ${maker}`, "[LUMCAT] K7", "TILT=NONE", "1 -1 1 37 1 1 2 0.1 0.2 0", "1 1 12", angles.join(" "), "0", candela.join(" "), ""].join("\n");
}

await inBrowser(async (browser, servers) => {
    const folder = mkdtempSync(join(tmpdir(), "gonio-library-")), outside = mkdtempSync(join(tmpdir(), "gonio-outside-"));
    mkdirSync(join(folder, "spots"));
    writeFileSync(join(folder, "spots", "wide.ies"), lm63("Acme Lumen", 500));
    writeFileSync(join(folder, "large.ies"), lm63("Bright Works", 9000));
    writeFileSync(join(folder, "broken.ies"), "this is no photometry\n");
    writeFileSync(join(outside, "secret.ies"), lm63("Secret", 1));
    symlinkSync(join(outside, "secret.ies"), join(folder, "link.ies"));
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null", "--library", folder]));
    const page = await browser.newPage({viewport: {width: 1280, height: 900}});
    listen(page);
    await page.goto(servers[0].url);
    await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
    await page.locator("#library-toggle").click();
    const row = (name) => page.locator(`#library tr[data-profile="${name}"]`);
    await until("the folder's files", () => row("spots/wide.ies").isVisible());
    const text = await row("spots/wide.ies").textContent();
    check(text.includes("Acme Lumen K7") && text.includes("spots/wide.ies") && /1.04[78] lm/.test(text) && /500 cd/.test(text) && /90.0°/.test(text) && /12.0 W/.test(text),
        "a row has maker and product, file, lm, cd, beam angle and watts", text);
    check(await row("spots/wide.ies").locator("svg.small path.c0").getAttribute("d") !== "", "and its polar curve");
    check((await row("broken.ies").textContent()).includes("Not usable") && (await row("link.ies").textContent()).includes("out of the folder"), "files that are none say why");
    if (screenshot) await page.screenshot({path: screenshot});
    await page.locator("#library-text").fill("acme k7");
    await until("one row", async () => await page.locator("#library tbody tr").count() === 1);
    check(await row("spots/wide.ies").isVisible(), "words of the maker find it");
    await page.locator("#library-text").fill("");
    await page.locator("#library input[aria-label='Least flux, lm']").fill("15000");
    await until("bright ones alone", async () => await row("large.ies").isVisible() && !await row("spots/wide.ies").isVisible());
    check(!await row("broken.ies").isVisible(), "a least flux finds the bright ones");
    await page.locator("#library input[aria-label='Least flux, lm']").fill("");
    await page.locator("#library input[aria-label='Greatest beam angle, °']").fill("20");
    await until("narrow ones alone", async () => await row("narrow_spot").isVisible() && !await row("large.ies").isVisible());
    check(true, "a greatest beam angle finds the narrow ones");
    await page.locator("#library input[aria-label='Greatest beam angle, °']").fill("");
    await until("all rows", () => row("large.ies").isVisible());
    const [name] = await page.evaluate(() => window.gonio.state.lights.map((one) => one.name));
    await row("large.ies").locator("button").focus();
    await page.keyboard.press("Enter");
    await until("the light's new profile", async () => (await light(page, name)).profile === "large.ies");
    check(Math.abs((await light(page, name)).flux_lm - 2 * Math.PI * 9000 / 3) < 100, "Use gives it to the selected light", `${(await light(page, name)).flux_lm.toFixed(0)} lm`);
    await row("spots/wide.ies").dragTo(page.locator(`#light-list li[data-name="${name}"]`));
    await until("the dragged profile", async () => (await light(page, name)).profile === "spots/wide.ies");
    check(true, "a row is dragged onto a light of the list");
    await row("narrow_spot").dragTo(page.locator("#screen"), {targetPosition: await page.evaluate(() => {
        const circle = document.querySelector("#handles circle.light").getBoundingClientRect(), screen = document.querySelector("#screen").getBoundingClientRect();
        return {x: circle.x + circle.width / 2 - screen.x, y: circle.y + circle.height / 2 - screen.y};
    })});
    await until("the profile on the picture's light", async () => (await light(page, name)).profile === "narrow_spot");
    check(true, "a row is dragged onto a light of the picture");
    writeFileSync(join(folder, "new.ies"), lm63("Later", 100));
    await page.locator("#library button", {hasText: "Read again"}).click();
    await until("the new file", () => row("new.ies").isVisible());
    check(true, "Read again finds new files");
    const refused = await asked(page, {command: {set_light: {name, profile: {name: "../secret.ies"}}}});
    check(refused.result.code === "not_found", "a name that no row has is refused", refused.result.message);
    const linked = await asked(page, {command: {set_light: {name, profile: {name: "link.ies"}}}});
    check(linked.result.code === "not_found", "a link out of the folder is no profile");
    rmSync(folder, {recursive: true});
    rmSync(outside, {recursive: true});
});
