// The look of the pictures that are not measured: tone curve, white, and an exposure as a camera has it.

import {h} from "./dom.js";
import {labelled, property, select, slider} from "./controls.js";

const kTones = [["knee", "Soft highlights"], ["linear", "Linear"], ["aces", "ACES"], ["agx", "AgX"], ["neutral", "Neutral"]];
const kD65 = 6504;

export function lookPanel(store, node, connection) {
    const look = (name, fallback) => property(store, () => `look.${name}`, () => store.state.look?.[name] ?? fallback,
        (value) => ({set_look: {[name]: value}}));
    const tone = select(look("tone", "knee"), {label: "Tone curve", options: () => kTones});
    // 0 is D65, as all is rendered; the slider stands at its temperature then.
    const kelvin = look("white_k", 0);
    const white = slider({...kelvin, value: () => kelvin.value() || kD65},
        {label: "White, K", caption: "White", min: 1000, max: 15000, step: 0.001, origin: kD65, digits: 0, unit: "K",
            toTrack: (k) => -1e3 / k, fromTrack: (x) => -1e3 / x});
    const tint = slider(look("white_duv", 0), {label: "Tint of the white, Duv", caption: "Tint", min: -0.05, max: 0.05, step: 0.001, origin: 0, digits: 3});
    const reset = h("button", {type: "button", class: "quiet", title: "Soft highlights, and white as it is rendered: D65",
        onclick: () => connection.command({set_look: {tone: "knee", white_k: 0, white_duv: 0}})}, "Reset");
    const input = (label, value) => h("input", {type: "text", inputmode: "decimal", "aria-label": label, value});
    const aperture = input("Aperture, f-number", "5.6"), shutter = input("Shutter, s, like 1/60", "1/60"), iso = input("ISO speed", "400");
    const seconds = (text) => {
        const [part, whole = "1"] = text.split("/");
        return Number(part) / Number(whole);
    };
    const form = h("form", {class: "row camera", title: "EV100 = log2(N² / t · 100 / ISO)"},
        h("span", {class: "faint"}, "f/"), aperture, shutter, h("span", {class: "faint"}, "s ISO"), iso, h("button", {}, "Set"));
    form.addEventListener("submit", (event) => {
        event.preventDefault();
        connection.command({set_exposure: {aperture: Number(aperture.value), shutter_s: seconds(shutter.value), iso: Number(iso.value)}});
    });
    node.append(h("h2", {}, "Look", h("span", {class: "grow"}), reset),
        labelled("Tone", tone.node), white.node, tint.node, form);
    return {update() {
        node.hidden = !["beauty", "direct", "indirect"].includes(store.state.view);
        [tone, white, tint].forEach((part) => part.update());
    }};
}
