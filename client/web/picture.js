// What is shown and how: view tabs, exposure, gain, camera, and the scene itself.

import {h, setText, onPageKey} from "./dom.js";
import {pageRole} from "./control.js";
import {fitSizeButton} from "./fit_size.js";
import {property, mapped, slider, select, tabs} from "./controls.js";
import {debugViews} from "./debug.js";

const kDegree = Math.PI / 180;
const kViews = [
    ["beauty", "Beauty", "Direct and indirect light, exposed"], ["direct", "Direct", "Direct light only"],
    ["indirect", "Indirect", "Indirect light only, times the gain"], ["illuminance", "Illuminance", "Lux on the surfaces"],
    ["luminance", "Luminance", "cd/m² towards the camera"],
];
const kLightViews = debugViews.map(([name]) => name);    // these show one light
const kSizes = ["480x480", "800x800", "1280x720", "1920x1080"];

export function viewProperty(store) {
    return property(store, () => "view", () => store.state.view,
        (name) => ({set_view: {view: name, ...lightOfView(store, name)}}));
}

export function viewTabs(store, node) {
    const view = viewProperty(store);
    const control = tabs(view, node, kViews.map(([value, text, title], i) => [value, text, `${title} (key ${i + 1})`]));
    onPageKey((event) => {
        if (event.ctrlKey || event.metaKey || event.altKey || event.code.startsWith("Numpad") || event.target.closest("input, select, textarea")) return;
        const at = Number(event.key) - 1;
        if (at in kViews && store.state) view.set(kViews[at][0]);
    });
    return control;
}

// A view of one light follows the selection.
function lightOfView(store, view) {
    return kLightViews.includes(view) && store.selected?.kind === "light" ? {light: store.selected.name} : {};
}

export function followSelection(store, connection) {
    let last = null;
    store.addEventListener("update", () => {
        const selected = store.selected?.kind === "light" ? store.selected.name : null;
        const before = last;
        last = selected;
        if (!selected || before === null || before === selected || !kLightViews.includes(store.state.view)) return;
        if (store.state.view_light !== selected) connection.command({set_view: {view: store.state.view, light: selected}});
    });
}

export function picturePanel(store, node, cameraHand, connection) {
    const exposure = slider(property(store, () => "exposure", () => store.state.exposure_ev100,
        (ev100) => ({set_exposure: {ev100}})),
    {label: "Exposure", id: "exposure", min: -10, max: 24, step: 0.05, digits: 2, unit: "EV"});
    const automatic = h("button", {type: "button", class: "quiet", id: "exposure-auto",
        title: "Metered when a scene is loaded, and again when it gets much brighter or darker and rests",
        onclick: () => connection.command({set_exposure: store.state.exposure_auto
            ? {ev100: store.state.exposure_ev100} : {automatic: true}})}, "Auto");
    const gain = slider(property(store, () => "gain", () => store.state.view_gain,
        (value) => ({set_view: {view: store.state.view, gain: value}})),
    {label: "Indirect gain", caption: "Gain", min: 0.01, max: 1000, step: 0.01, origin: 1, digits: 2, unit: "×",
        toTrack: Math.log10, fromTrack: (x) => 10 ** x});
    gain.node.title = "How much brighter the view Indirect shows indirect light";
    const size = select(property(store, () => "size", () => store.state.size_px?.join("x"),
        (text) => ({set_size: {width_px: Number(text.split("x")[0]), height_px: Number(text.split("x")[1])}})),
    {label: "Picture size", options: () => [...new Set([...kSizes, store.state.size_px?.join("x") ?? kSizes[0]])].map((text) => [text, text.replace("x", " × ")])});
    const fov = slider(mapped(property(store, () => "fov", () => store.state.camera?.fov_rad,
        (fov_rad) => ({set_camera: {fov_rad}})), (rad) => rad / kDegree, (deg) => deg * kDegree),
    {label: "Field of view", caption: "FOV", min: 2, max: 170, step: 0.5, digits: 1, unit: "°",
        toTrack: (deg) => Math.log(Math.tan(deg * kDegree / 4)), fromTrack: (x) => 4 * Math.atan(Math.exp(x)) / kDegree});
    const home = h("button", {type: "button", class: "quiet", title: "Back to the camera that the scene came with"}, "Reset");
    home.addEventListener("click", () => {
        if (store.state?.home_camera?.eye) cameraHand.take(store.state.home_camera);
    });
    node.append(h("h2", {}, "Picture", h("span", {class: "grow"}), automatic), exposure.node, gain.node,
        h("div", {class: "slider"}, h("span", {class: "label"}, "Size, px"), h("span", {class: "row pair size"}, size.node, fitSizeButton(connection))),
        h("h2", {}, "Camera", h("span", {class: "grow"}), home), fov.node);
    const parts = [exposure, gain, size, fov];
    return {update() {
        parts.forEach((part) => part.update());
        automatic.setAttribute("aria-pressed", String(store.state.exposure_auto === true));
    }};
}

// loadScene(file, began): asks first where something is not saved, then tells that it begins. Result: null where the user
// stays.
export function scenePanel(store, node, connection, loadScene) {
    const scene = h("select", {"aria-label": "Scene"});
    const path = h("input", {type: "text", placeholder: "/path/on/the/server/scene.glb", "aria-label": "Path of a .gltf, .glb or .mvr on the server", spellcheck: "false"});
    const load = h("button", {}, "Load");
    const form = h("form", {class: "inline", hidden: true}, path, load);
    const busy = h("span", {class: "faint busy", role: "status"});
    const list = h("ul");
    const told = h("dialog", {id: "scene-warnings", "aria-labelledby": "scene-warnings-title"},
        h("header", {class: "row"}, h("h2", {id: "scene-warnings-title"}, "What loading the scene said"), h("span", {class: "grow"}),
            h("button", {type: "button", class: "quiet", "aria-label": "Close", onclick: () => told.close()}, "×")),
        h("div", {class: "scroll warnings", tabindex: "0"}, list));
    told.addEventListener("click", (event) => { if (event.target === told) told.close(); });    // beside it
    document.body.append(told);
    const warnings = h("button", {type: "button", class: "quiet warn", id: "scene-warned", hidden: true, "aria-haspopup": "dialog", onclick: () => told.showModal()});
    const failed = h("span", {class: "warn bad", id: "picture-error", role: "alert", tabindex: "0", hidden: true}, "The picture cannot be made; the last one stays");
    let loading = false;
    const start = async (file) => {
        loading = true;
        const result = await loadScene(file, () => setText(busy, "Loading…"));
        loading = false;
        setText(busy, "");
        if (result?.code === "ok") form.hidden = true;
        update();
    };
    scene.addEventListener("change", () => {
        form.hidden = scene.value !== "";
        if (scene.value) start(scene.value);
        else path.focus();
    });
    form.addEventListener("submit", (event) => {
        event.preventDefault();
        if (path.value.trim()) start(path.value.trim());
    });
    form.addEventListener("keydown", (event) => {
        if (event.key !== "Escape") return;
        form.hidden = true;
        update();
        scene.focus();
    });
    // With the button that mends it, where there is such a command; the row goes when the server says that it is mended.
    const warningRow = (text) => {
        const light = pageRole === "viewer" ? undefined : store.hiddenLight(text);
        return h("li", {}, text, light ? " " : null, light ? h("button", {type: "button", class: "quiet recess", "aria-label": `Recess ${light.name}`,
            title: "To 1 mm before the surface that hides it", onclick: () => connection.command({recess_light: {name: light.name}})}, "Recess") : null);
    };
    let shown = "";
    function update() {
        const name = store.state?.scene ?? "";
        const scenes = [["cornell", "Cornell box"], ["atrium", "Atrium"]];
        if (name && !scenes.some(([known]) => known === name)) scenes.push([name, name.split("/").at(-1)]);
        scenes.push(["", "File on the server…"]);
        if (JSON.stringify(scenes) !== shown) {
            shown = JSON.stringify(scenes);
            scene.replaceChildren(...scenes.map(([value, text]) => h("option", {value, title: value}, text)));
        }
        if (!loading && form.hidden && scene.value !== name) scene.value = name;
        scene.title = name;
        const texts = store.loadWarnings, notes = store.loadNotes, all = [...texts, ...notes];
        warnings.hidden = all.length === 0;
        if (all.length === 0 && told.open) told.close();
        warnings.classList.toggle("warn", texts.length > 0);
        setText(warnings, texts.length === 0 ? "What was loaded" : `${texts.length} ${texts.length === 1 ? "warning" : "warnings"}`);
        warnings.title = all.join("\n");
        if (JSON.stringify(all) !== told.dataset.texts) {    // a text that is being read stays
            told.dataset.texts = JSON.stringify(all);
            list.replaceChildren(...texts.map(warningRow), ...notes.map((text) => h("li", {class: "faint"}, text)));
        }
        failed.hidden = !store.state?.picture_error;
        failed.title = store.state?.picture_error ?? "";
    }
    node.append(scene, form, busy, warnings, failed);
    return {update};
}
