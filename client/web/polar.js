// The polar curve of a profile: C0-C180 solid, C90-C270 dashed, rings in candela. Pure drawing, from a ProfileReply.

import {bytesOf} from "./connection.js";
import {svg, formatLarge} from "./dom.js";

const kRadius = 100;
const kEmptyHalf = 0.02;    // a hemisphere below this part of the peak is not drawn

// 3 to 5 rings at 1, 2 or 5 times a power of ten, the last at or above the peak.
export function ringsFor(peak) {
    if (!(peak > 0)) return [1];
    for (let power = Math.floor(Math.log10(peak)) - 2; ; power++) {
        for (const digit of [1, 2, 2.5, 5]) {
            const step = digit * 10 ** power;
            const count = Math.ceil(peak / step - 1e-9);
            if (count <= 4) return Array.from({length: count}, (_, i) => step * (i + 1));
        }
    }
}

// v 0 points down; side +1 is the right half (C0, C90), -1 the left (C180, C270).
function point(v_deg, radius, side) {
    const v = (v_deg * Math.PI) / 180;
    return [side * radius * Math.sin(v), radius * Math.cos(v)];
}

const text = ([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`;

function curvePath(v_deg, right, left, scale) {
    const there = v_deg.map((v, i) => point(v, (right[i] ?? 0) * scale, 1));
    const back = v_deg.map((v, i) => point(v, (left[i] ?? 0) * scale, -1)).reverse();
    return `M${[...there, ...back].map(text).join("L")}Z`;
}

// Result: an <svg> for the profile.
export function polarDiagram(reply) {
    const {v_deg, c0_cd, c90_cd, c180_cd, c270_cd} = reply;
    const planes = [c0_cd, c90_cd, c180_cd, c270_cd];
    const peakIn = (from, to) => Math.max(0, ...planes.flatMap((plane) =>
        plane.filter((_, i) => v_deg[i] >= from && v_deg[i] <= to)));
    const peak = peakIn(0, 180);
    const down = peakIn(0, 89.99) > peak * kEmptyHalf || peak === 0, up = peakIn(90.01, 180) > peak * kEmptyHalf;
    const rings = ringsFor(peak);
    const scale = kRadius / rings.at(-1);
    const top = up ? -kRadius - 14 : -14, bottom = down ? kRadius + 14 : 14;

    const grid = svg("g", {class: "grid"});
    for (const ring of rings) grid.append(arc(ring * scale, down, up));
    const from = down ? 0 : 90, to = up ? 180 : 90;
    for (let v = from; v <= to; v += 30) {
        for (const side of v % 180 ? [1, -1] : [1]) {
            const [x, y] = point(v, kRadius, side);
            grid.append(svg("line", {x1: 0, y1: 0, x2: x.toFixed(2), y2: y.toFixed(2)}));
            const [tx, ty] = point(v, kRadius + 8, side);
            grid.append(svg("text", {x: tx.toFixed(2), y: (ty + 2.5).toFixed(2), class: "angle",
                "text-anchor": v % 180 === 0 ? "middle" : side > 0 ? "start" : "end"}, `${v}°`));
        }
    }
    const labels = svg("g", {class: "cd"});
    for (const ring of rings) {
        // Beside the vertical, where the curves leave room most often.
        const [x, y] = point(down ? 15 : 165, ring * scale, 1);
        labels.append(svg("text", {x: x.toFixed(2), y: (y + (down ? -1.5 : 5)).toFixed(2), "text-anchor": "middle"},
            formatLarge(ring).replace(/\.0+$/, "")));
    }
    const caption = `Polar curve of ${reply.profile}: peak ${formatLarge(reply.max_cd)} candela, ` +
        `${formatLarge(reply.flux_lm)} lumens`;
    return svg("svg", {viewBox: `-126 ${top} 252 ${bottom - top}`, class: "polar", role: "img", "aria-label": caption},
        grid,
        svg("path", {class: "c90", d: curvePath(v_deg, c90_cd, c270_cd, scale)}),
        svg("path", {class: "c0", d: curvePath(v_deg, c0_cd, c180_cd, scale)}),
        labels);
}

// Result: a thumbnail of a row of the library. curve: LibraryRow.curve, base64.
export function smallPolar(curve) {
    const bytes = bytesOf(curve ?? ""), count = bytes.length / 4;
    const v_deg = Array.from({length: count}, (_, i) => (180 * i) / (count - 1)), plane = (k) => [...bytes.subarray(k * count, (k + 1) * count)];
    return svg("svg", {viewBox: "-104 -104 208 208", class: "polar small", "aria-hidden": "true"}, svg("g", {class: "grid"}, arc(kRadius, true, true)),
        svg("path", {class: "c90", d: curve ? curveOf(v_deg, plane(1), plane(3)) : ""}), svg("path", {class: "c0", d: curve ? curveOf(v_deg, plane(0), plane(2)) : ""}));
}
const curveOf = (v_deg, right, left) => curvePath(v_deg, right, left, kRadius / 255);

function arc(r, down, up) {
    if (down && up) return svg("circle", {r: r.toFixed(2)});
    return svg("path", {d: `M${-r.toFixed(2)},0A${r.toFixed(2)},${r.toFixed(2)} 0 0 ${down ? 0 : 1} ${r.toFixed(2)},0Z`});
}
