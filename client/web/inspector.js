// The right side: everything about the selected light or group.

import {h, setText, formatLarge} from "./dom.js";
import {property, nameForm, slider} from "./controls.js";
import {pageRole} from "./control.js";
import {kMissing, lightLevel, groupLevel, percent} from "./lights.js";
import {temperatureControl, gelControl} from "./white.js";
import {openingControl} from "./opening.js";
import {colorSection, section} from "./inspector_parts.js";
import {capital, kSections, lightControl, lightRows} from "./light_control.js";
import {duplicate, removeChosen} from "./many.js";
import {manyView} from "./many_view.js";
import {ProfilePanel, luminaireOf} from "./profile.js";

function lightView(store, connection, {aimButton, duplicate, remove}) {
    const name = () => (store.selected?.kind === "light" ? store.selected.name : "");
    const light = () => store.light(name());
    const bound = (row) => property(store, () => `${row.name}:${name()}`, () => light()?.[row.state_field],
        (value) => ({set_light: {name: name(), [row.field]: value}}));

    const title = h("h2", {id: "light-name"});
    const summary = h("p", {class: "faint"});
    const missing = h("p", {class: "warnings", id: "light-missing", hidden: true}, `${kMissing}. It comes back with its values when the fixture does.`);
    const rows = lightRows;
    const controls = new Map(rows.map((row) => [row.name, lightControl(row, bound(row), lightLevel(store, name), light)]));
    for (const row of rows) if (row.help) controls.get(row.name).node.title = capital(row.help);
    const gel = gelControl(connection, property(store, () => `gel:${name()}`, () => light()?.gel ?? "", (gel) => ({set_light: {name: name(), gel}})));
    const opening = openingControl(property(store, () => `opening:${name()}`,
        () => (light()?.sun ? undefined : light()?.opening_of_file ? "file" : light()?.opening), (text) => ({set_light: {name: name(), opening: text}})), () => light()?.opening ?? "");
    const placed = new Set(kSections.flatMap(([, names]) => names));
    const sections = kSections.map(([heading, names], first) => {
        const nodes = rows.filter((row) => names.includes(row.name) || (first === 0 && !placed.has(row.name)))
            .map((row) => controls.get(row.name).node);
        return first === 0 ? h("section", {"aria-label": heading}, ...nodes, gel.node, opening.node) : section(heading, ...nodes);
    });
    const profile = new ProfilePanel(store, connection);
    const parts = [...controls.values(), gel, opening, profile];
    const rename = nameForm({title: "Another name for this light", opens: "Rename this light", placeholder: "Name of the light",
        label: "New name of the light", verb: "Rename", sign: "Rename", before: name,
        submit: async (new_name) => new_name === name()
            || (await connection.command({rename_light: {name: name(), new_name}}))?.code === "ok"});
    const recess = h("button", {type: "button", id: "recess-light", title: "To 1 mm before the surface that it is let into, or that its housing ends in: at most 0.5 m",
        onclick: () => connection.command({recess_light: {name: name()}})}, "Recess");
    const tools = h("div", {class: "row wrap"});
    const node = h("div", {id: "light-view"}, h("header", {}, title, summary, missing, tools, rename.form),
        ...sections, profile.node);
    return {node, update() {
        const shown = light();
        node.hidden = !shown || store.chosen.length > 1;
        if (node.hidden) return;
        if (aimButton.parentNode !== tools) tools.append(aimButton, duplicate, rename.open, recess, remove);    // shared with the view of several
        for (const ofWheel of ["gobo", "gobo-turn"]) controls.get(ofWheel).node.hidden = !shown.gobos?.length;
        recess.hidden = Boolean(shown.sun) || pageRole === "viewer";
        setText(title, shown.name);
        const times = shown.multiplier !== undefined && shown.multiplier !== 1 ? ` · ×${shown.multiplier}` : "";
        setText(summary, shown.sun ? `sun · ${formatLarge(shown.sun_lx ?? 0)} lx facing it` : `${luminaireOf(shown)} · ${formatLarge(shown.max_cd)} cd · ${formatLarge(shown.flux_lm)} lm${times}`);
        missing.hidden = !shown.missing;
        parts.forEach((part) => part.update());
    }};
}

function groupView(store, connection) {
    const name = () => (store.selected?.kind === "group" ? store.selected.name : "");
    const title = h("h2");
    const level = slider(percent(groupLevel(store, name)), {label: "Level of all", caption: "Level", min: 0, max: 100, step: 0.5, digits: 1, unit: "%"});
    const color = colorSection(property(store, () => `groupcolor:${name()}`,
        () => store.light(store.group(name())?.lights[0])?.color_rgb,
        (color_rgb) => ({set_light: {name: name(), color_rgb}})), " of all");
    const firstLight = () => store.light(store.group(name())?.lights[0]);
    const white = temperatureControl(property(store, () => `groupcct:${name()}`, () => firstLight()?.cct_k, (cct_k) => ({set_light: {name: name(), cct_k}})), " of all");
    const gel = gelControl(connection, property(store, () => `gel:${name()}`, () => firstLight()?.gel ?? "", (gel) => ({set_light: {name: name(), gel}})), " of all");
    const members = h("ul", {class: "members"});
    const remove = h("button", {type: "button", class: "quiet", onclick: () => connection.command({set_group: {name: name(), lights: []}})}, "Remove group");
    const node = h("div", {}, h("header", {}, title, h("p", {class: "faint"}, "Group")),
        h("section", {"aria-label": "Level and colour of all"}, level.node, color.node, white.node, gel.node), section("Lights", members, remove));
    let shown = "";
    return {node, update() {
        const group = store.group(name());
        node.hidden = !group;
        if (!group) return;
        setText(title, group.name);
        level.update();
        color.update();
        white.update();
        gel.update();
        const all = store.state.lights.map((light) => light.name);
        const signature = JSON.stringify([group, all]);
        if (signature === shown) return;
        shown = signature;
        members.replaceChildren(...all.map((light) => {
            const box = h("input", {type: "checkbox"});
            box.checked = group.lights.includes(light);
            // The last light stays: a group without lights is a removed one, and that has its own button.
            box.disabled = box.checked && group.lights.length === 1;
            box.addEventListener("change", () => connection.command({set_group: {name: group.name,
                lights: box.checked ? [...group.lights, light] : group.lights.filter((other) => other !== light)}}));
            return h("li", {}, h("label", {}, box, light));
        }));
    }};
}

// handles: whose button aims the selected lights, and who knows where the camera's right is.
export function inspector(store, node, connection, handles) {
    const button = (id, text, title, onclick) => h("button", {type: "button", class: "quiet", id, title, onclick}, text);
    const shared = {aimButton: handles.aimButton,
        duplicate: button("light-duplicate", "Duplicate", "A copy of what is selected (Ctrl+D)", () => duplicate(store, connection, handles.eye.right)),
        remove: button("light-remove", "Remove", "Remove what is selected (Delete)", () => removeChosen(store, connection))};
    const views = [lightView(store, connection, shared), manyView(store, connection, shared), groupView(store, connection)];
    const none = h("p", {class: "hint"}, "Select a light to see and change it.");
    node.append(...views.map((view) => view.node), none);
    return {update() {
        views.forEach((view) => view.update());
        none.hidden = store.selected !== null;
    }};
}
