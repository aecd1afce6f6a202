// The settings of the false-colour views: range, colours, lines, threshold, one light alone, the difference from a preset.

import {h, setText} from "./dom.js";
import {labelled, number, property, select} from "./controls.js";
import {palettes} from "./palettes.js";
import {quantities} from "./legend.js";

const kKept = "A";    // the preset that "Keep A" saves
const digits = (value) => Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(Math.max(Math.abs(value), 1e-6)))) * (value === 0 ? 0 : 1));

// A button that is on or off.
function toggle(text, title, isOn, set) {
    const node = h("button", {type: "button", class: "quiet", title, onclick: () => set(!isOn())}, text);
    return {node, update: () => node.setAttribute("aria-pressed", String(isOn()))};
}

// Result: the numbers of "100, 200 500"; null where it holds something else.
export function readLevels(text) {
    const values = text.split(/[\s,;]+/).filter(Boolean).map(Number);
    return values.every(Number.isFinite) ? values : null;
}

// Where isolux lines run; empty: as the scale has it.
function levelField(levels, set) {
    const node = h("input", {type: "text", id: "scale-levels", "aria-label": "Isolux lines at", maxlength: 200, placeholder: "by the scale",
        title: "Up to 16 values with commas between; empty: at the borders of the steps, or at 1, 2, 5 of each decade"});
    const shown = () => levels().map((value) => String(Number(value.toPrecision(6)))).join(", ");
    node.addEventListener("change", () => {
        const values = readLevels(node.value);
        node.setAttribute("aria-invalid", String(values === null));
        if (values) set(values);
    });
    return {node, update() {
        if (document.activeElement === node) return;
        node.removeAttribute("aria-invalid");
        if (node.value !== shown()) node.value = shown();
    }};
}

export function scalePanel(store, node, connection) {
    const color = () => store.state[store.state.view] ?? {};
    const field = (name, fallback = 0) => property(store, () => `${store.state.view}.${name}`, () => color()[name] ?? fallback,
        (value) => ({set_view: {view: store.state.view, [name]: value}}));
    const low = number(field("range_low"), {label: "Lower end of the scale", min: 0, max: 1e9, step: "any", digits, id: "scale-low"});
    const high = number(field("range_high"), {label: "Upper end of the scale", min: 0, max: 1e9, step: "any", digits, id: "scale-high"});
    const automatic = toggle("Auto", "The upper end follows the picture where it rests", () => color().range_auto === true,
        (on) => connection.command({set_view: {view: store.state.view, range_auto: on}}));
    // A linear scale begins at 0, a logarithmic one four decades below its end.
    const scale = select({...field("scale"), set: (value) => connection.command({set_view: {view: store.state.view, scale: value,
        range_low: value === "log" ? color().range_high / 1e4 : 0, range_high: color().range_high, range_auto: color().range_auto === true}})},
    {label: "Scale", options: () => [["log", "Log"], ["linear", "Linear"]]});
    const text = (prop, read, write) => ({...prop, value: () => read(prop.value()), set: (value) => prop.set(write(value))});
    const steps = select(text(field("steps"), String, Number), {label: "Steps", options: () =>
        [["0", "Smooth"], ...[5, 8, 10, 15, 20, 27].map((n) => [String(n), `${n} steps`])]});
    const palette = select(field("palette"), {label: "Palette", options: () =>
        Object.keys(palettes).filter((name) => name !== "difference").map((name) => [name, name[0].toUpperCase() + name.slice(1)])});
    const isolux = toggle("Isolux lines", "Lines at the borders of the steps, or at 1, 2, 5 of each decade", () => color().isolux === true,
        (on) => connection.command({set_view: {view: store.state.view, isolux: on}}));
    const levels = levelField(() => color().levels ?? [], (values) => connection.command({set_view: {view: store.state.view, levels: {values}}}));
    const below = number(field("below"), {label: "Mark what is below", min: 0, max: 1e9, step: "any", digits, id: "scale-below"});
    const only = select(property(store, () => "only", () => store.state.view_only ?? "", (name) => ({set_view: {only: name}})),
        {label: "Light of", options: () => [["", "All lights"], ...store.state.lights.map(({name}) => [name, name])]});
    const compare = select(property(store, () => "compare", () => store.state.view_compare ?? "", (name) => ({set_view: {compare: name}})),
        {label: "Difference from", options: () => [["", "Nothing"], ...(store.state.presets?.names ?? []).map((name) => [name, name])]});
    const compareRange = number(field("compare_range"), {label: "Difference that ends the scale", min: 1e-6, max: 1e9, step: "any", digits, id: "scale-difference"});
    const keep = h("button", {type: "button", class: "quiet", title: `Keeps the lights as preset ${kKept}, and shows the difference from it`,
        onclick: async () => {
            const saved = await connection.command({save_preset: {name: kKept}});
            if (saved?.code === "ok") connection.command({set_view: {compare: kKept}});
        }}, "Keep A");
    const title = h("span");
    const linesAt = labelled("Lines at", levels.node);
    const range = labelled("Range", low.node, high.node), difference = labelled("Range ±", compareRange.node);
    node.append(h("h2", {}, title, h("span", {class: "grow"}), automatic.node), range, difference,
        labelled("Colours", palette.node), labelled("Spacing", scale.node, steps.node), labelled("Below", below.node, isolux.node), linesAt,
        labelled("Light", only.node), labelled("Compare", compare.node, keep));
    const parts = [low, high, automatic, scale, steps, palette, isolux, levels, below, only, compare, compareRange];
    return {update() {
        node.hidden = !(store.state.view in quantities);
        if (node.hidden) return;
        parts.forEach((part) => part.update());
        const compares = Boolean(store.state.view_compare);
        range.hidden = compares;
        difference.hidden = !compares;
        scale.node.disabled = palette.node.disabled = low.node.disabled = high.node.disabled = compares;
        if (!compares) low.node.disabled = color().range_auto === true;
        automatic.node.disabled = levels.node.disabled = compares;
        setText(title, `Scale, ${quantities[store.state.view].unit}`);
    }};
}
