// Where the camera stands: views from the sides and of all of the scene, saved views, and the numbers of its place.

import {h, onPageKey} from "./dom.js";
import {component, nameForm, scrub} from "./controls.js";
import {pageRole} from "./control.js";
import {add, cross, dot, length, scale, sub, unit} from "./projection.js";

const kNearlyDown = [0, 1, 1e-3];    // from just beside the pole, so that there is an upper edge
const kSides = [["front", "Front", [0, 0, 1], "From +Z (numpad 1)"], ["back", "Back", [0, 0, -1], "From −Z (Ctrl numpad 1)"],
    ["left", "Left", [-1, 0, 0], "From −X (Ctrl numpad 3)"], ["right", "Right", [1, 0, 0], "From +X (numpad 3)"],
    ["top", "Top", kNearlyDown, "From +Y (numpad 7)"], ["fit", "Fit", null, "All of the scene, from where the camera is (Home)"]];
const kNumpad = {Numpad1: ["front", "back"], Numpad3: ["right", "left"], Numpad7: ["top", "top"]};
const kAir = 1.05;

// Result: the nearest place in a direction from the box's middle that sees all of it; fov_rad is vertical. from: any
// length but 0.
export function framed({min_m, max_m}, from, fov_rad, [width, height]) {
    const upright = Math.hypot(from[0], from[2]) < 1e-6 * length(from);
    const middle = scale(add(min_m, max_m), 0.5), back = unit(upright ? [0, Math.sign(from[1]), kNearlyDown[2]] : from);
    const right = unit(cross([0, 1, 0], back)), up = cross(back, right);
    const tanY = Math.tan(fov_rad / 2), tanX = tanY * width / height;
    let distance = 0.02;
    for (let corner = 0; corner < 8; ++corner) {
        const at = sub([0, 1, 2].map((i) => (corner >> i & 1 ? max_m : min_m)[i]), middle);
        distance = Math.max(distance, dot(at, back) + kAir * Math.max(Math.abs(dot(at, right)) / tanX, Math.abs(dot(at, up)) / tanY));
    }
    return {eye: add(middle, scale(back, distance)), target: middle};
}

// The camera's eye or target as a property of three numbers.
function place(store, hand, name) {
    return {store, key: () => "camera", value: () => hand.pose[name], set: (value) => hand.set({...hand.pose, [name]: value}), hold: () => store.hold("camera", hand.pose)};
}

function savedList(store, connection) {
    const list = h("ul", {class: "list presets"});
    let shown = "";
    return {node: list, update() {
        const names = (store.state.saved_views?.views ?? []).map(({name}) => name);
        if (JSON.stringify(names) === shown) return;
        shown = JSON.stringify(names);
        list.replaceChildren(...names.map((name) => h("li", {"data-name": name},
            h("button", {type: "button", class: "pick", title: `Go to ${name}`, onclick: () => connection.command({recall_view: {name}})}, h("span", {class: "name"}, name)),
            h("button", {type: "button", class: "quiet", title: `Save this view as ${name} again`, "aria-label": `Save this view as ${name} again`,
                onclick: () => connection.command({save_view: {name}})}, "Save"),
            h("button", {type: "button", class: "quiet", title: `Remove ${name}`, "aria-label": `Remove view ${name}`,
                onclick: () => connection.command({remove_view: {name}})}, "×"))));
    }};
}

// The cameras of the scene's file: they can be gone to, and nothing else.
function fileCameras(store, hand) {
    const chips = h("div", {class: "chips", id: "file-cameras"});
    let shown = "";
    return {node: chips, update() {
        const views = store.state.file_cameras?.views ?? [];
        if (JSON.stringify(views) === shown) return;
        shown = JSON.stringify(views);
        chips.hidden = views.length === 0;
        chips.replaceChildren(...views.map(({name, camera}) => h("button", {type: "button", class: "chip", title: `The file's camera ${name}`,
            onclick: () => hand.take(camera)}, name)));
    }};
}

export function viewPanel(store, node, hand, connection) {
    const go = (name) => {
        const {bounds, camera, size_px} = store.state ?? {}, side = kSides.find(([known]) => known === name);
        if (!bounds || !camera) return;
        const from = side[2] ?? sub(hand.pose.eye, hand.pose.target);
        hand.set(framed(bounds, length(from) > 0 ? from : [0, 0, 1], camera.fov_rad, size_px));
    };
    const sides = h("div", {class: "chips"}, ...kSides.map(([name, text, , title]) =>
        h("button", {type: "button", class: "chip", "data-view": name, title, onclick: () => go(name)}, text)));
    const vector = (caption, name) => {
        const fields = ["x", "y", "z"].map((letter, i) => scrub(component(place(store, hand, name), i),
            {letter, label: `${caption} ${letter}, m`, step: 0.05, digits: 2, perPixel: 0.01}));
        return {node: h("div", {}, h("h3", {}, `${caption}, m`), h("div", {class: "row vector"}, ...fields.map((field) => field.node))),
            update: () => fields.forEach((field) => field.update())};
    };
    const {open, form} = nameForm({title: "Save this view", opens: "Save this view", placeholder: "Name of the view", label: "Name of the view",
        verb: "Save", submit: async (name) => (await connection.command({save_view: {name}}))?.code === "ok"});
    const parts = [fileCameras(store, hand), vector("Eye", "eye"), vector("Looks at", "target"), savedList(store, connection)];
    node.append(h("h2", {}, "Views", h("span", {class: "grow"}), open), form, sides, ...parts.map((part) => part.node));
    onPageKey((event) => {
        if (event.metaKey || event.altKey || event.shiftKey || pageRole === "viewer" || event.target.closest("input, select, textarea")) return;
        const pair = kNumpad[event.code];
        if (pair) go(pair[event.ctrlKey ? 1 : 0]);
        // Lists and sliders have taken a Home of their own.
        else if (event.key === "Home" && !event.defaultPrevented) go("fit");
        else return;
        event.preventDefault();
    });
    return {update() { parts.forEach((part) => part.update()); }};
}
