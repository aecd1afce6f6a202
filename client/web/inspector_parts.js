// Parts that the views of one light, of several and of a group share.

import {h} from "./dom.js";
import {component, scrub} from "./controls.js";
import {toHex, fromHex} from "./color.js";

export function section(title, ...children) {
    return h("section", {"aria-label": title}, h("h3", {}, title), ...children);
}

// colorOf: a property of three factors. name: goes behind the labels.
export function colorSection(colorOf, name) {
    const picker = h("input", {type: "color", "aria-label": "Colour"});
    let held = null;    // the property that the open picker holds
    picker.addEventListener("click", () => { held = colorOf.key(); colorOf.hold(); });
    picker.addEventListener("input", () => colorOf.set(fromHex(picker.value)));
    for (const type of ["change", "blur"]) {
        picker.addEventListener(type, () => { if (held !== null) colorOf.store.release(held); held = null; });
    }
    const fields = ["R", "G", "B"].map((letter, i) => scrub(component(colorOf, i),
        {letter, label: `${letter} factor${name}`, min: 0, max: 10000, step: 0.01, digits: 3, perPixel: 0.005}));
    const neutral = h("button", {type: "button", class: "chip neutral", title: "As measured", onclick: () => colorOf.set([1, 1, 1])}, "Neutral");
    neutral.setAttribute("aria-label", `Neutral colour${name}`);
    return {
        node: h("div", {class: "color"}, h("div", {class: "row vector"}, picker, ...fields.map((field) => field.node), neutral)),
        update() {
            const rgb = colorOf.value();
            if (rgb?.length === 3 && held === null && picker.value !== toHex(rgb)) picker.value = toHex(rgb);
            fields.forEach((field) => field.update());
        },
    };
}
