// What the colours of the false-colour views stand for; palettes.js is the server's table.

import {svg, setText, h} from "./dom.js";
import {palettes, belowMark} from "./palettes.js";

export const quantities = {illuminance: {unit: "lx", name: "Illuminance"}, luminance: {unit: "cd/m²", name: "Luminance"}};

// Result: the scale in force of a false-colour view, or null: {view, unit, name, low, high, log, steps, palette, ticks,
// levels (that somebody gave, where lines show them), below, isolux, difference}.
export function scaleOf(state) {
    const quantity = quantities[state?.view], color = state?.[state?.view];
    if (!quantity || !color) return null;
    const difference = Boolean(state.view_compare), most = color.compare_range;
    return {...quantity, view: state.view, difference, only: state.view_only || "", compare: state.view_compare || "",
        low: difference ? -most : color.range_low ?? 0, high: difference ? most : color.range_high,
        log: !difference && color.scale === "log", steps: color.steps ?? 0, isolux: color.isolux === true,
        palette: palettes[difference ? "difference" : color.palette], ticks: color.ticks ?? [], below: difference ? 0 : color.below ?? 0,
        levels: color.isolux === true && !difference ? color.levels ?? [] : []};
}

// Result: where a value lies between the ends of the scale, 0..1; and the value there.
export const positionOf = ({low, high, log}, value) => (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
export const valueAt = ({low, high, log}, t) => (log ? low * (high / low) ** t : low + (high - low) * t);

// Result: the colour of t of the scale, 0..1: R'G'B' of 0..255.
export function falseColor(scale, t) {
    const at = scale.steps ? (Math.min(Math.floor(t * scale.steps), scale.steps - 1) + 0.5) / scale.steps : t;
    return scale.palette.colors[Math.round(Math.min(Math.max(at, 0), 1) * (scale.palette.colors.length - 1))];
}

// Result: the value of a pixel, lx or cd/m², by the nearest colour of the scale.
export function valueOf(scale, rgb) {
    let best = 0, least = Infinity;
    for (let step = 0; step <= 1000; ++step) {
        const off = falseColor(scale, step / 1000).reduce((sum, x, k) => sum + (x - rgb[k]) ** 2, 0);
        if (off < least) [best, least] = [step / 1000, off];
    }
    return valueAt(scale, best);
}

// Result: "500", "2k": as short as it can be told.
export const figure = (value) => (Math.abs(value) >= 1000 ? `${Number((value / 1000).toPrecision(3))}k` : String(Number(value.toPrecision(3))));
const css = (color) => `rgb(${color.join(",")})`;

// A scale beside the picture while a false-colour view is shown.
export function legend(store, screen) {
    const small = matchMedia("(max-width: 600px)"), kWidth = 14, kBars = 100, kEnd = 8, kLabel = 11;
    let height_px = 0;
    const title = h("p"), more = h("p", {class: "of"}), below = h("p", {class: "below", hidden: true}, h("i"), h("span"));
    const chart = svg("svg", {"aria-hidden": "true"});
    const node = h("figure", {id: "legend", hidden: true}, title, more, chart, below);
    screen.querySelector("#veil").before(node);
    let shown = "";
    const fit = () => {
        height_px = small.matches ? 92 : 200;    // a telephone's picture is small
        for (const [name, value] of Object.entries({viewBox: `0 -14 ${kWidth + 56} ${height_px + 28}`, width: kWidth + 56, height: height_px + 28})) chart.setAttribute(name, value);
    };
    fit();
    small.addEventListener("change", () => { fit(); shown = ""; update(); });
    const draw = (scale) => {
        const bar = (y, height, color) => svg("rect", {x: 0, y, width: kWidth, height, fill: css(color)});
        const bars = Array.from({length: kBars}, (_, i) => bar(height_px * (1 - (i + 1) / kBars), height_px / kBars + 0.5, falseColor(scale, (i + 0.5) / kBars)));
        const ends = [bar(-kEnd - 2, kEnd, scale.palette.over)];
        if (scale.low !== 0 || scale.log) ends.push(bar(height_px + 2, kEnd, scale.palette.under));
        const taken = [], within = (value) => positionOf(scale, value) > -1e-6 && positionOf(scale, value) < 1 + 1e-6;
        const label = (value) => {
            const y = height_px * (1 - positionOf(scale, value));
            if (taken.some((other) => Math.abs(other - y) < kLabel)) return [];
            taken.push(y);
            const text = svg("text", {x: kWidth + 8, y: y + 4});
            text.textContent = figure(value);
            return [svg("rect", {x: kWidth, y: y - 0.5, width: 4, height: 1, class: "tick"}), text];
        };
        const lines = scale.levels.filter(within).flatMap((level) => {
            const at = positionOf(scale, level), [r, g, b] = falseColor(scale, at);
            return [svg("rect", {x: 0, y: height_px * (1 - at) - 0.75, width: kWidth, height: 1.5, class: "level",
                fill: 0.2126 * r + 0.7152 * g + 0.0722 * b > 127 ? "#000" : "#fff"}), ...label(level)];
        });
        chart.replaceChildren(...bars, ...ends, ...lines, ...scale.ticks.flatMap(label));
        setText(title, `${scale.difference ? "Difference, " : `${scale.name}, `}${scale.unit}`);
        setText(more, [scale.only && `of ${scale.only}`, scale.compare && `from ${scale.compare}`].filter(Boolean).join(" "));
        more.hidden = !more.textContent;
        below.hidden = !(scale.below > 0);
        below.querySelector("i").style.background = css(belowMark);
        setText(below.querySelector("span"), `below ${figure(scale.below)}`);
        node.setAttribute("aria-label", `${title.textContent} ${more.textContent}: ${scale.palette.help}; ${figure(scale.low)} to ${figure(scale.high)} ${scale.unit}, ${
            scale.log ? "logarithmic" : "linear"}${scale.steps ? `, ${scale.steps} steps` : ""}${scale.levels.length ? `; lines at ${scale.levels.map(figure).join(", ")}` : ""}${scale.below > 0 ? `; below ${figure(scale.below)} is marked` : ""}`);
    };
    function update() {
        const scale = scaleOf(store.state);
        node.hidden = !scale;
        const signature = JSON.stringify(scale && {...scale, palette: scale.palette?.help});
        if (!scale || signature === shown) return;
        shown = signature;
        draw(scale);
    }
    return {update};
}
