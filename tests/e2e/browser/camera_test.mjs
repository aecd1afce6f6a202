// The camera: orbit by both schemes, standard and saved views, walking, its numbers, and a picture of the window's size.
// And how soon the picture follows a drag.
//   node camera_test.mjs GONIOD_BINARY [SCREENSHOT.png]

import {asked, check, inBrowser, listen, screenshot, settled, sleep, startServer, state, until} from "./harness.mjs";

const distance = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));
const camera = async (page) => (await state(page)).camera;

// Where the camera came to rest after `act`.
async function after(page, act) {
    const before = await camera(page);
    await act();
    let last = before;
    return until("a camera that has moved and rests", async () => {
        const now = await camera(page), rests = distance(now.eye, last.eye) + distance(now.target, last.target) < 1e-9;
        last = now;
        if (rests && distance(now.eye, before.eye) + distance(now.target, before.target) > 1e-3) return now;
        await sleep(250);
        return false;
    });
}

const go = (page, side) => after(page, () => page.locator(`#cameras button[data-view=${side}]`).click());

async function empty(page) {
    const box = await page.locator("#canvas").boundingBox();
    return [box.x + box.width * 0.35, box.y + box.height * 0.85];    // beside all handles
}

async function drag(page, button, by, during = async () => {}) {
    const from = await empty(page);
    await page.mouse.move(...from);
    await page.mouse.down({button});
    await page.mouse.move(from[0] + by[0], from[1] + by[1], {steps: 5});
    await during();
    await page.mouse.up({button});
}

async function schemes(page) {
    const far = ({eye, target}) => distance(eye, target);
    const start = await camera(page);
    const orbited = await after(page, () => drag(page, "middle", [60, 0]));
    check(distance(orbited.eye, start.eye) > 0.01 && Math.abs(far(orbited) - far(start)) < 1e-6, "the middle button orbits");
    await page.keyboard.down("Shift");
    const panned = await after(page, () => drag(page, "middle", [40, 20]));
    await page.keyboard.up("Shift");
    check(distance(panned.target, orbited.target) > 0.01 && Math.abs(far(panned) - far(start)) < 1e-6, "with Shift it pans");
    await page.keyboard.down("Control");
    const nearer = await after(page, () => drag(page, "middle", [0, -50]));
    await page.keyboard.up("Control");
    check(far(nearer) < 0.9 * far(panned) && distance(nearer.target, panned.target) < 1e-9, "with Ctrl it goes nearer", far(nearer).toFixed(2));
}

// About what is under the pointer; and an eye in the building stays in it.
async function turns(page) {
    await page.evaluate(() => new Promise((resolve) => setTimeout(resolve, 300)));
    const at = await empty(page);
    await page.mouse.move(at[0] - 30, at[1] - 30);
    await page.mouse.move(...at);
    await until("what is under the pointer", () => page.locator("#under").isVisible());
    await sleep(300);    // the newest place is told
    const {pick} = await asked(page, {pick: await page.locator("#canvas").boundingBox().then(async (box) => {
        const [width, height] = (await state(page)).size_px, side = Math.min(box.width / width, box.height / height);
        return {x: (at[0] - box.x - (box.width - side * width) / 2) / (side * width), y: (at[1] - box.y - (box.height - side * height) / 2) / (side * height)};
    })});
    const start = await camera(page);
    const turned = await after(page, () => drag(page, "left", [50, 20]));
    check(Math.abs(distance(turned.eye, pick.point_m) - distance(start.eye, pick.point_m)) < 0.02 && distance(turned.target, start.target) > 0.05,
        "a drag turns about what is under the pointer", pick.point_m.map((x) => x.toFixed(2)).join(" "));
    const inside = await page.evaluate(async () => {
        const {orbitAbout} = await import("/camera.js"), box = {min_m: [-2, 0, -2], max_m: [2, 3, 2]};
        let pose = {eye: [1, 1.6, 1.5], target: [0, 1.5, -1]};
        for (let i = 0; i < 400; ++i) {
            pose = orbitAbout(pose, [0, 0, -1.9], 9, i % 2 ? 3 : -2, box);
            if (!pose.eye.every((x, k) => x >= box.min_m[k] - 1e-9 && x <= box.max_m[k] + 1e-9)) return pose.eye.join(" ");
        }
        return "";
    });
    check(inside === "", "an eye inside stays inside, however far the hand goes", inside);
}

async function walking(page) {
    const start = await go(page, "front");
    const turned = await after(page, () => drag(page, "right", [50, 0]));
    check(distance(turned.eye, start.eye) < 1e-9 && turned.target[0] > start.target[0], "the right button looks around", turned.target.map((x) => x.toFixed(2)).join(" "));
    const aims = await page.locator("#aim-here").getAttribute("aria-pressed");
    const walk = (key, during = async () => {}) => after(page, () => drag(page, "right", [0, 0], async () => {
        await during();
        await page.keyboard.down(key);
        await sleep(400);
        await page.keyboard.up(key);
    }));
    const ahead = await walk("w");
    const way = (a, b) => b.eye.map((x, i) => x - a.eye[i]), look = turned.target.map((x, i) => x - turned.eye[i]);
    const along = (v) => v.reduce((sum, x, i) => sum + x * look[i], 0) / (Math.hypot(...v) * Math.hypot(...look));
    check(along(way(turned, ahead)) > 0.999, "W walks ahead", `${distance(turned.eye, ahead.eye).toFixed(2)} m`);
    const left = await walk("a");
    check(Math.abs(along(way(ahead, left))) < 1e-3 && left.eye[0] < ahead.eye[0], "A to the left");
    check(await page.locator("#aim-here").getAttribute("aria-pressed") === aims, "and does not aim a light meanwhile");
    const kept = await state(page);
    await drag(page, "right", [0, 0], async () => { for (const key of ["Delete", "f", "n", "2"]) await page.keyboard.press(key); });
    await sleep(300);
    const held = await state(page);
    check(held.lights.length === kept.lights.length && held.view === kept.view && distance(held.camera.eye, kept.camera.eye) < 1e-9
        && await page.locator("#tool-add").getAttribute("aria-pressed") === "false", "nor do Delete, F, N and 2 anything");
    const up = await walk("e");
    check(up.eye[1] > left.eye[1] && Math.abs(up.eye[0] - left.eye[0]) < 1e-9, "E up");
    const before = distance(left.eye, up.eye);
    const fast = await walk("q", async () => { for (let i = 0; i < 6; ++i) await page.mouse.wheel(0, -100); });
    check(distance(fast.eye, up.eye) > 1.5 * before, "the wheel makes it faster", `${before.toFixed(2)} m, ${distance(fast.eye, up.eye).toFixed(2)} m`);
    const rest = await camera(page);
    await page.keyboard.press("w");
    await sleep(400);
    check(distance((await camera(page)).eye, rest.eye) < 1e-9, "without the right button W does not walk");
    await page.keyboard.press("Escape");    // it moves the light
}

// All that there is lies in the picture, and fills it one way.
async function standard(page) {
    const {bounds} = await state(page);
    for (const [name, axis, sign] of [["front", 2, 1], ["back", 2, -1], ["left", 0, -1], ["right", 0, 1], ["top", 1, 1], ["fit", null]]) {
        if (name === "fit") await after(page, () => drag(page, "left", [70, 30]));
        const now = await go(page, name), off = now.eye.map((x, i) => x - now.target[i]);
        if (axis !== null) check(sign * off[axis] > 0.999 * Math.hypot(...off), `the view from ${name}`, now.eye.map((x) => x.toFixed(2)).join(" "));
        const most = await page.evaluate(async ([box, pose, size]) => {
            const {eyeOf, project} = await import("/projection.js");
            const eye = eyeOf(pose, size);
            return Math.max(...Array.from({length: 8}, (_, corner) => {
                const at = project(eye, [0, 1, 2].map((i) => (corner >> i & 1 ? box.max_m : box.min_m)[i]));
                return at ? 2 * Math.max(Math.abs(at.x - 0.5), Math.abs(at.y - 0.5)) : Infinity;
            }));
        }, [bounds, now, (await state(page)).size_px]);
        check(most <= 1 && most > 0.9, `${name} shows all of the scene`, `${(100 * most).toFixed(0)} % of the picture`);
    }
    const down = await page.evaluate(async () => {
        const {framed} = await import("/views.js");
        return framed({min_m: [-2, 0, -2], max_m: [2, 4, 2]}, [0, 5, 0], 0.7, [100, 100]).eye;
    });
    check(down[1] > 4 + 2 / Math.tan(0.35) && Math.abs(down[2]) < 0.1, "straight from above too", down.map((x) => x.toFixed(2)).join(" "));
    await page.locator("#canvas").focus();
    const right = await after(page, () => page.keyboard.press("Numpad3"));
    check(right.eye[0] - right.target[0] > 1, "numpad 3 is the right side");
    check((await state(page)).view === "beauty", "and no other picture");
    const back = await after(page, () => page.keyboard.press("Control+Numpad1"));
    check(back.eye[2] - back.target[2] < -1, "Ctrl numpad 1 is the back");
    await after(page, () => drag(page, "left", [70, 30]));
    await page.mouse.wheel(0, 300);
    await sleep(500);
    await page.locator("#help").focus();
    await after(page, () => page.keyboard.press("Home"));
    check(true, "Home shows all of the scene, wherever the focus is");
    await page.locator("#exposure").focus();
    const still = await camera(page);
    await page.keyboard.press("Home");
    await sleep(300);
    check(distance((await camera(page)).eye, still.eye) < 1e-9, "but in a slider, which has a Home of its own");
    await asked(page, {command: {set_exposure: {automatic: true}}});
}

// A page that was opened later knows the camera that the scene began with, too.
async function home(page, other) {
    const {home_camera, file_cameras} = await state(page), isHome = async () => distance((await camera(page)).eye, home_camera.eye) < 1e-9;
    await go(page, "top");
    await other.locator("button[title='Back to the camera that the scene came with']").click();
    await until("the scene's own camera", isHome);
    check((await camera(page)).fov_rad === home_camera.fov_rad, "Reset goes to the camera that the scene came with");
    await go(page, "top");
    check(file_cameras.views.length === 1 && await other.locator("#file-cameras button").count() === 1, "the file's cameras are under Views", file_cameras.views[0].name);
    await other.locator("#file-cameras button").click();
    await until("the file's camera", isHome);
}

async function saved(page, other) {
    const kept = await go(page, "front");
    await page.locator("#cameras button[aria-label='Save this view']").click();
    await page.locator("#cameras form input").fill("from the door");
    await page.locator("#cameras form button").click();
    await other.locator("#cameras li[data-name='from the door']").waitFor();
    check(true, "a saved view is in the list of another page");
    await go(page, "top");
    await other.locator("#cameras li[data-name='from the door'] .pick").click();
    await until("the camera at the saved view", async () => distance((await camera(page)).eye, kept.eye) < 1e-9);
    check(true, "which goes there by it");
    await asked(page, {command: {save_view: {name: "by another hand", eye_m: [0, 1, 4]}}});
    await page.locator("#cameras li[data-name='by another hand']").waitFor();
    await page.locator("#cameras button[aria-label='Remove view from the door']").click();
    await until("one view", () => other.locator("#cameras li").count().then((count) => count === 1));
    check(true, "and it is removed for all");

    const field = page.locator("input[aria-label='Eye y, m']");
    await field.fill("2.5");
    await field.press("Enter");
    await until("the typed height", async () => Math.abs((await camera(page)).eye[1] - 2.5) < 1e-9);
    check(true, "the camera's place is typed as numbers");
}

async function size(page) {
    const box = await page.locator("#screen").boundingBox();
    await page.locator("#fit-size").click();
    const fitted = await until("another size", async () => {
        const {size_px} = await state(page);
        return size_px[0] !== 400 && size_px;
    });
    check(fitted.every((x) => x % 2 === 0) && Math.abs(fitted[0] - box.width) < 2 && Math.abs(fitted[1] - box.height) < 2, "the picture has the window's size", fitted.join(" × "));
    const bounded = await page.evaluate(async () => {
        const {fittingSize} = await import("/fit_size.js");
        const of = (width, height) => ({getBoundingClientRect: () => ({width, height})});
        return [fittingSize(of(3000.5, 5), 2), fittingSize(of(641, 481), 1.5)];
    });
    check(JSON.stringify(bounded) === "[[4096,16],[960,720]]", "in device pixels, even, within the server's bounds", JSON.stringify(bounded));
    await settled(page);
    await asked(page, {command: {set_size: {width_px: 400, height_px: 400}}});
    await until("the old size", async () => (await state(page)).size_px[0] === 400);
}

// Where nobody has asked for a size the first page chooses one, and no other page does.
async function unasked(open, server) {
    const page = await open({viewport: {width: 1440, height: 900}}, server);
    const fitted = await until("a size", async () => {
        const {size_px, size_auto} = await state(page);
        return !size_auto && size_px;
    });
    const box = await page.locator("#screen").boundingBox(), [width, height] = fitted;
    check(Math.abs(width / height / (box.width / box.height) - 1) < 0.01 && width * height <= 1e6 && width > 600, "an unasked size fits the first page's window", fitted.join(" × "));
    const other = await open({viewport: {width: 700, height: 700}}, server);
    await sleep(500);
    check(JSON.stringify((await state(other)).size_px) === JSON.stringify(fitted), "and stays when another page opens");
    await Promise.all([page.close(), other.close()]);
}

// Of frames that come after the last event of a drag the second one shows it, whichever is still on its way.
async function follows(page) {
    const light = (await state(page)).lights[0].name;
    await asked(page, {command: {set_camera: {eye_m: [0, 2, 7.75], target_m: [0, 2, 0]}}});
    await settled(page);
    const lag = [];
    for (let i = 0; i < 5; ++i) {
        const box = await page.locator(`#handles circle[data-light="${light}"]`).boundingBox();
        const from = [box.x + box.width / 2, box.y + box.height / 2];
        await page.mouse.move(...from);
        await page.mouse.down();
        // From here on every picture's revision is noted, and when the last answer came.
        await page.evaluate(() => {
            const tick = () => {
                const {framesDecoded, shownRev, sceneRev} = window.gonio;
                const last = window.seen.at(-1);
                if (!last || last.framesDecoded !== framesDecoded || last.shownRev !== shownRev || last.sceneRev !== sceneRev) window.seen.push({framesDecoded, shownRev, sceneRev});
                if (window.watching) channel.port2.postMessage(0);
            };
            const channel = new MessageChannel();
            Object.assign(window, {seen: [], watching: true});
            channel.port1.onmessage = tick;
            tick();
        });
        for (let step = 1; step <= 6; ++step) {
            await page.mouse.move(from[0] + (i % 2 ? -5 : 5) * step, from[1] + 2 * step);
            await sleep(30);
        }
        await sleep(300);
        const seen = await until("the last revision in the picture", () => page.evaluate(() => {
            const {shownRev, sceneRev} = window.seen.at(-1);
            return shownRev >= sceneRev && window.seen;
        }));
        await page.mouse.up();
        await page.evaluate(() => { window.watching = false; });
        const rev = seen.at(-1).sceneRev, told = seen.find(({sceneRev}) => sceneRev === rev), shown = seen.find(({shownRev}) => shownRev >= rev);
        lag.push(Math.max(0, shown.framesDecoded - told.framesDecoded));
    }
    // A busy machine may have more pictures on their way, once.
    const [, , middle, fourth] = [...lag].sort();
    check(middle <= 2 && fourth <= 4, "the second picture after a drag's last event shows it", `${lag.join(", ")} pictures`);
}

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null", "--size", "400x400"]));
    const open = async (options, server = servers[0]) => {
        const page = await browser.newPage(options);
        listen(page);
        await page.goto(server.url);
        await until("the first picture", () => page.evaluate(() => window.gonio?.framesDecoded > 0));
        return page;
    };
    const page = await open({viewport: {width: 1280, height: 900}});
    await settled(page);
    await schemes(page);
    await turns(page);
    await standard(page);
    await walking(page);
    const other = await open();
    await home(page, other);
    await saved(page, other);
    await other.close();
    await size(page);
    await page.close();
    servers.push(await startServer("127.0.0.1:0", ["--renderer", "null"], {sized: false}));
    await unasked(open, servers[1]);
    // How soon pictures follow is asked of those that are rendered.
    servers.push(await startServer("127.0.0.1:0", ["--size", "400x400"]));
    const rendered = await open({viewport: {width: 1280, height: 900}}, servers[2]);
    await follows(rendered);
    if (screenshot) await rendered.screenshot({path: screenshot});
});
