// What shows how the picture is made rather than what it shows: views of one luminaire's maps, techniques, samples.

import {h} from "./dom.js";
import {labelled, property, select} from "./controls.js";

export const debugViews = [
    ["mask", "Mask", "IES light mask cube"],
    ["rsm-depth", "RSM depth", "Reflective shadow map: radial depth"], ["rsm-normal", "RSM normal", "Reflective shadow map: normal"],
    ["rsm-flux", "RSM flux", "Reflective shadow map: derived flux"], ["solid", "Solid", "Photometric solid over the picture"],
];
const kSamples = {default: [64, 256, 1024, 2048, 4096], seed: [100, 400, 1024], "seed-disk": [100, 400, 1024]};

// view: the property of the view, as the tabs have it.
export function debugPanel(store, node, view) {
    const technique = select(property(store, () => "technique", () => store.state.technique,
        (name) => ({set_technique: {technique: name}})),
    {label: "Technique", options: () => [["default", "Default"], ["seed", "Seed"], ["seed-disk", "Seed, disk"]]});
    const samples = select(property(store, () => "samples", () => store.state.samples?.toString(),
        (count) => ({set_technique: {technique: store.state.technique, samples: Number(count)}})),
    {label: "Samples", options: () => {
        const known = kSamples[store.state.technique] ?? [];
        return [...new Set([...known, store.state.samples])].sort((a, b) => a - b).map((n) => [String(n), String(n)]);
    }});
    const buttons = debugViews.map(([name, text, title]) => h("button", {type: "button", class: "chip", "data-view": name, title,
        onclick: () => view.set(view.value() === name ? "beauty" : name)}, text));
    node.append(h("details", {}, h("summary", {}, "Under the hood"),
        h("div", {class: "chips wrap", role: "group", "aria-label": "Views of the renderer"}, ...buttons),
        labelled("Technique", technique.node, samples.node)));
    return {update() {
        technique.update();
        samples.update();
        for (const button of buttons) button.setAttribute("aria-pressed", String(view.value() === button.dataset.view));
    }};
}
