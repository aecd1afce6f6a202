// What the colours of the false-colour views stand for: shaders/lib/display.glsl in the browser.

import {svg, setText, h} from "./dom.js";

const kStops = [[0.02, 0.02, 0.12], [0.05, 0.16, 0.45], [0.05, 0.42, 0.35], [0.55, 0.62, 0.10], [1.0, 0.95, 0.8]];
const kDecades = 4;
const kViews = {illuminance: {least: 1, unit: "lx", name: "Illuminance"}, luminance: {least: 0.1, unit: "cd/m²", name: "Luminance"}};

const shoulder = (x) => (x < 0.7 ? x : 1 - 0.3 * Math.exp(-(x - 0.7) / 0.3));
const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);

// Result: the colour that a view shows for t of its range, 0..1: R'G'B' of 0..255.
export function falseColor(t) {
    const s = Math.min(Math.max(t, 0), 1) * (kStops.length - 1), i = Math.min(Math.floor(s), kStops.length - 2);
    return kStops[i].map((low, k) => Math.round(255 * encode(shoulder(low + (kStops[i + 1][k] - low) * (s - i)))));
}

// Result: the value of a pixel of that view, lx or cd/m², by the nearest colour of its scale.
export function valueOf(view, rgb) {
    let best = 0, least = Infinity;
    for (let step = 0; step <= 1000; ++step) {
        const color = falseColor(step / 1000), off = color.reduce((sum, x, k) => sum + (x - rgb[k]) ** 2, 0);
        if (off < least) [best, least] = [step / 1000, off];
    }
    return kViews[view].least * 10 ** (kDecades * best);
}

// A scale beside the picture while a false-colour view is shown.
export function legend(store, screen) {
    const kHeight = 200, kWidth = 14, steps = 64;
    const bars = Array.from({length: steps}, (_, i) => svg("rect", {x: 0, y: kHeight * (1 - (i + 1) / steps), width: kWidth, height: kHeight / steps + 0.5,
        fill: `rgb(${falseColor((i + 0.5) / steps).join(",")})`}));
    const labels = Array.from({length: kDecades + 1}, (_, i) => svg("text", {x: kWidth + 6, y: kHeight * (1 - i / kDecades) + 4}));
    const title = h("p");
    const node = h("figure", {id: "legend", hidden: true}, title,
        svg("svg", {viewBox: `0 -8 ${kWidth + 56} ${kHeight + 16}`, width: kWidth + 56, height: kHeight + 16, "aria-hidden": "true"}, ...bars, ...labels));
    screen.querySelector("#veil").before(node);
    return {update() {
        const view = kViews[store.state.view];
        node.hidden = !view;
        if (!view) return;
        setText(title, `${view.name}, ${view.unit}`);
        node.setAttribute("aria-label", `${view.name}: dark blue ${view.least} ${view.unit} to white ${view.least * 10 ** kDecades} ${view.unit}, logarithmic`);
        labels.forEach((label, i) => setText(label, String(Number((view.least * 10 ** i).toPrecision(3)))));
    }};
}
