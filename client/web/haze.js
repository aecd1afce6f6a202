// The air: haze that absorbs and scatters light.

import {h} from "./dom.js";
import {labelled, property, select, slider} from "./controls.js";

// As `set haze PRESET` has them (server/scene/apply_haze.cpp).
const kPresets = [["off", "None", 0], ["faint", "Faint", 0.003], ["show", "Show", 0.01], ["fog", "Fog", 0.1]];
const kLeastShown = 1e-4, kMost = 10;   // extinction, 1/m; the slider's left end is none
const kMostLayer_m = 100;

export function hazePanel(store, node, connection) {
    const haze = (name, fallback) => property(store, () => `haze.${name}`, () => store.state.haze?.[name] ?? fallback,
        (value) => ({set_haze: {[name]: value}}));
    const preset = select({store, key: () => "haze.preset", set: (name) => name !== "custom" && connection.command({set_haze: {preset: name}}),
        value: () => {
            const now = store.state.haze;
            if (!now) return "off";
            const plain = now.albedo === 1 && now.g === 0.7 && now.layer_height_m === 0;
            return kPresets.find(([name, , extinction]) => extinction === now.extinction_per_m && (plain || name === "off"))?.[0] ?? "custom";
        }}, {label: "Haze", options: () => [...kPresets.map(([name, text]) => [name, text]), ["custom", "Own values"]]});
    const extinction = slider(haze("extinction_per_m", 0), {label: "Extinction, 1/m", caption: "Density", min: 0, max: kMost, step: 0.001,
        digits: (value) => (value < 0.1 ? 4 : 2), unit: "1/m",
        toTrack: (x) => Math.log10(Math.max(x, kLeastShown)), fromTrack: (t) => (t <= Math.log10(kLeastShown) ? 0 : 10 ** t)});
    const albedo = slider(haze("albedo", 1), {label: "Albedo: the part of it that is scattered", caption: "Albedo", min: 0, max: 1, step: 0.01});
    const g = slider(haze("g", 0.7), {label: "Forward scattering, g", caption: "Forward", min: -0.95, max: 0.95, step: 0.01, origin: 0});
    const layer = slider(haze("layer_height_m", 0), {label: "Height at which it is e times thinner, m; 0: the same everywhere",
        caption: "Layer", min: 0, max: kMostLayer_m, step: 0.01, digits: 2, unit: "m",
        toTrack: (x) => Math.sqrt(x), fromTrack: (t) => (t < 0.1 ? 0 : t * t)});
    const own = h("div", {}, extinction.node, albedo.node, g.node, layer.node);
    node.append(h("h2", {}, "Haze"), labelled("Haze", preset.node), own);
    return {update() {
        own.hidden = !(store.state.haze?.extinction_per_m > 0);
        [preset, extinction, albedo, g, layer].forEach((part) => part.update());
    }};
}
