// A picture with as many pixels as there is room for.

import {h} from "./dom.js";

const kSizes_px = [16, 4096], kUnasked_px = 1e6;

// Result: the size of an element in the screen's own pixels, as the server takes it.
export function fittingSize(element, ratio = devicePixelRatio) {
    const {width, height} = element.getBoundingClientRect();
    return [width, height].map((x) => Math.min(kSizes_px[1], Math.max(kSizes_px[0], 2 * Math.floor(x * ratio / 2))));
}

// Where nobody has asked for a size the first page fits the picture to its window, with a million pixels at most: more is
// for those who ask for it.
export function fitUnaskedSize(connection) {
    connection.addEventListener("ready", ({detail: {state, role}}) => {
        if (!state.size_auto || role === "viewer") return;
        const [width, height] = fittingSize(document.getElementById("screen")), by = Math.min(1, Math.sqrt(kUnasked_px / (width * height)));
        const [width_px, height_px] = [width, height].map((x) => Math.max(kSizes_px[0], 2 * Math.floor(x * by / 2)));
        connection.command({set_size: {width_px, height_px}}, {quiet: true});
    });
}

export function fitSizeButton(connection) {
    return h("button", {type: "button", class: "quiet", id: "fit-size", title: "A picture with as many pixels as there is room for here", onclick: () => {
        const [width_px, height_px] = fittingSize(document.getElementById("screen"));
        connection.command({set_size: {width_px, height_px}});
    }}, "Fit");
}
