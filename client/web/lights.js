// The lists on the left: lights and groups, each row with its fader; and the master.

import {h, setText} from "./dom.js";
import {property, mapped, nameForm, range, slider} from "./controls.js";
import {LightList} from "./light_list.js";
import {luminaireOf} from "./profile.js";
import {workLightButton} from "./work_light.js";

export function lightLevel(store, name) {
    return property(store, () => `level:${name()}`, () => store.light(name())?.level_ratio,
        (value) => ({set_light: {name: name(), level_ratio: value}}));
}

// A group shows the mean of its lights: faders of its lights may differ.
export function groupLevel(store, name) {
    const mean = () => {
        const levels = (store.group(name())?.lights ?? []).map((light) => store.light(light)?.level_ratio)
            .filter(Number.isFinite);
        return levels.length ? levels.reduce((sum, level) => sum + level, 0) / levels.length : undefined;
    };
    return property(store, () => `group:${name()}`, mean,
        (value) => ({set_light: {name: name(), level_ratio: value}}));
}

export const percent = (prop) => mapped(prop, (ratio) => ratio * 100, (shown) => shown / 100);

const percentText = (value) => `${Math.round(value)} %`;
const countOf = (lights) => (lights === 1 ? "1 light" : `${lights} lights`);

export const kMissing = "Its fixture is not in the MVR show that was merged last: it stays dark";

function row(store, kind, name, level, press = () => store.select(kind, name)) {
    const title = h("span", {class: "name"}, name);
    const detail = h("span", {class: "detail"});
    const button = h("button", {type: "button", class: "pick", onclick: press}, title, detail);
    const shown = percent(level);
    const fader = range(shown, {label: `Level of ${name}`, min: 0, max: 100, step: 0.5, text: percentText});
    // One stop of the Tab key: left and right on the name ride the level.
    fader.node.tabIndex = -1;
    button.addEventListener("keydown", (event) => {
        const way = {ArrowLeft: -1, ArrowRight: 1}[event.key], value = shown.value();
        if (!way || !Number.isFinite(value) || event.ctrlKey || event.metaKey || event.altKey) return;
        event.preventDefault();
        shown.set(Math.min(100, Math.max(0, Math.round(value + way * (event.shiftKey ? 10 : 1)))));
    });
    const figure = h("span", {class: "figure"});
    const node = h("li", {"data-name": name}, button, fader.node, figure);
    const update = () => {
        const on = kind === "light" ? store.isChosen(name) : store.selected?.kind === kind && store.selected.name === name;
        node.classList.toggle("on", on);
        button.setAttribute("aria-pressed", String(on));
        fader.update();
        setText(figure, Number.isFinite(shown.value()) ? percentText(shown.value()) : "–");
        const missing = kind === "light" && Boolean(store.light(name)?.missing);
        node.classList.toggle("missing", missing);
        button.title = missing ? kMissing : "Left and right arrow change its level";
        setText(detail, missing ? "missing, dark" : kind === "light" ? luminaireOf(store.light(name))
            : countOf(store.group(name)?.lights?.length ?? 0));
    };
    return {node, update};
}

// Keeps rows of names that stay, so that a fader in the hand is not rebuilt under it.
function list(store, kind, names, levelOf) {
    const node = h("ul", {class: "list"});
    const rows = new Map();
    return {
        node,
        update() {
            const current = names();
            for (const name of [...rows.keys()].filter((known) => !current.includes(known))) {
                rows.get(name).node.remove();
                rows.delete(name);
            }
            current.forEach((name, i) => {
                if (!rows.has(name)) rows.set(name, row(store, kind, name, levelOf(store, () => name)));
                const item = rows.get(name).node;
                if (node.children[i] !== item) node.insertBefore(item, node.children[i] ?? null);
            });
            for (const {update} of rows.values()) update();
        },
    };
}

export function masterPanel(store, node) {
    const master = percent(property(store, () => "master", () => store.state.master_ratio,
        (ratio) => ({set_master: {ratio}})));
    const fader = slider(master, {label: "Master", min: 0, max: 100, step: 0.5, digits: 0, unit: "%"});
    node.append(fader.node);
    return fader;
}

// Where a new light goes: a metre before what the middle of the picture shows, aimed at it.
async function freePlace(connection) {
    const {pick} = await connection.request({pick: {x: 0.5, y: 0.5}});
    if (!pick?.hit) return {};
    const off_m = Math.min(1, pick.distance_m / 2);
    return {position_m: pick.point_m.map((x, i) => x + off_m * pick.normal[i]), aim: pick.normal.map((x) => -x)};
}

// several(): whether a press selects beside the others.
export function lightPanel(store, node, connection, several) {
    const count = h("span", {class: "count"});
    const lights = new LightList(store, (name) => row(store, "light", name, lightLevel(store, () => name),
        (event) => lights.press(name, event, several())));
    const {open, form} = nameForm({title: "New light before what the middle of the picture shows", opens: "New light",
        placeholder: "Name of the light", label: "Name of the new light", verb: "Add",
        submit: async (name) => {
            const light = {name, profile: {name: store.state.profiles[0]}, ...await freePlace(connection)};
            if ((await connection.command({add_light: {light}}))?.code !== "ok") return false;
            store.select("light", name);
            return true;
        }});
    const workLight = workLightButton(store, connection);
    const empty = h("p", {class: "hint"}, "This scene has no lights. ",
        h("button", {type: "button", class: "quiet", id: "first-light", onclick: () => open.click()}, "Add a light"), workLight.node);
    node.append(h("h2", {}, "Lights", count, h("span", {class: "grow"}), open), form, lights.tools, lights.node, empty);
    return {list: lights, update() {
        lights.update();
        empty.hidden = store.state.lights.length > 0;
        workLight.update();
        const chosen = store.chosen.length;
        setText(count, chosen > 1 ? `${chosen} of ${store.state.lights.length}` : String(store.state.lights.length));
    }};
}

export function groupPanel(store, node, connection) {
    const groups = list(store, "group", () => store.state.groups.map((group) => group.name), groupLevel);
    const {open, form} = nameForm({title: "New group of the selected lights", opens: "New group", placeholder: "Name of the group",
        label: "Name of the new group", verb: "Create",
        submit: async (name) => {
            const lights = (store.chosen.length ? store.chosen : store.state.lights.slice(0, 1)).map((light) => light.name);
            if (!lights.length || (await connection.command({set_group: {name, lights}}))?.code !== "ok") return false;
            store.select("group", name);
            return true;
        }});
    node.append(h("h2", {}, "Groups", h("span", {class: "grow"}), open), form, groups.node);
    return groups;
}
