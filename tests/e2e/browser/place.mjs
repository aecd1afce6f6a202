// Where things of the scene are on the page, for tests that press on the picture.

import {sleep, state, until} from "./harness.mjs";

export const distance = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));
export const light = async (page, name) => (await state(page)).lights.find((one) => one.name === name);
export const names = async (page) => (await state(page)).lights.map(({name}) => name);

// Where a point of the picture is on the page, px. place: 0..1.
export async function onPage(page, place) {
    const box = await page.locator("#screen").boundingBox(), [width, height] = (await state(page)).size_px;
    const s = Math.min(box.width / width, box.height / height);
    return [box.x + (box.width - s * width) / 2 + place[0] * s * width, box.y + (box.height - s * height) / 2 + place[1] * s * height];
}

// The middle of a handle, px.
export async function handle(page, selector) {
    const box = await page.locator(`#handles ${selector}`).first().boundingBox();
    return [box.x + box.width / 2, box.y + box.height / 2];
}

export async function drag(page, from, by, during = async () => {}) {
    await page.mouse.move(...from);
    await page.mouse.down();
    for (let i = 1; i <= 5; ++i) await page.mouse.move(from[0] + by[0] * i / 5, from[1] + by[1] * i / 5);
    await during();
    await page.mouse.up();
}

// A value that differs from `before` and has come to rest: two readings agree, and the server has answered all commands
// of the page.
export async function changed(page, what, before, read) {
    let last = before;
    return until(what, async () => {
        const previous = last, answered = await page.evaluate(() => window.gonio.answered);
        last = await read();
        await sleep(250);
        return answered && JSON.stringify(last) !== JSON.stringify(before) && JSON.stringify(last) === JSON.stringify(previous) && last;
    });
}
