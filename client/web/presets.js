// Presets: the list on the left, each recalled by a click over the fade time, saved and removed.

import {h} from "./dom.js";
import {nameForm} from "./controls.js";

export function presetPanel(store, node, connection) {
    const fade = h("input", {type: "number", min: 0, max: 3600, step: 0.5, value: "0", id: "preset-fade", "aria-label": "Fade in seconds"});
    const list = h("ul", {class: "list presets"});
    const {open, form} = nameForm({title: "Save what the lights are now", opens: "New preset", placeholder: "Name of the preset",
        label: "Name of the new preset", verb: "Save",
        submit: async (name) => (await connection.command({save_preset: {name}}))?.code === "ok"});
    node.append(h("h2", {}, "Presets", h("span", {class: "grow"}), h("label", {class: "faint"}, "Fade ", fade, " s"), open), form, list);
    const recall = (name) => connection.command({recall_preset: {name, fade_s: Math.min(3600, Math.max(0, Number(fade.value) || 0))}});
    let shown = "";
    return {update() {
        const {names = [], recalled = ""} = store.state.presets ?? {};
        const signature = JSON.stringify([names, recalled]);
        if (signature === shown) return;
        shown = signature;
        list.replaceChildren(...names.map((name) => h("li", {"data-name": name, class: name === recalled ? "on" : null},
            h("button", {type: "button", class: "pick", "aria-pressed": String(name === recalled), onclick: () => recall(name)},
                h("span", {class: "name"}, name)),
            h("button", {type: "button", class: "quiet", title: `Save the lights as ${name} again`, onclick: () => connection.command({save_preset: {name}})}, "Save"),
            h("button", {type: "button", class: "quiet", title: `Remove ${name}`, "aria-label": `Remove ${name}`,
                onclick: () => connection.command({remove_preset: {name}})}, "×"))));
    }};
}
