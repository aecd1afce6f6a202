// The work light: a scene without luminaires is shaded towards the camera instead of black. Over the picture stands that it
// is not part of the design; a button switches it off and on.

import {h, setText} from "./dom.js";
import {pageRole} from "./control.js";

const switchOn = (connection, on) => connection.command({set_view: {work_light: on}});

// Over the picture, while it shows.
export function workLightBadge(store, connection, screen) {
    const off = h("button", {type: "button", class: "quiet", onclick: () => switchOn(connection, false)}, "Switch off");
    const node = h("p", {id: "work-light", role: "status", hidden: true}, h("span", {}, "Work light: not part of the design, and in no lux"),
        pageRole === "viewer" ? null : off);
    screen.append(node);
    return {update() { node.hidden = !store.state.work_light_on; }};
}

// Beside the offer of a first light.
export function workLightButton(store, connection) {
    const node = h("button", {type: "button", class: "quiet", id: "work-light-toggle", onclick: () => switchOn(connection, !store.state.work_light)});
    return {node, update() {
        node.setAttribute("aria-pressed", String(store.state.work_light === true));
        const {work_light, work_light_on, view} = store.state;
        setText(node, work_light && !work_light_on && view === "beauty" ? "Work light: not needed, surfaces give light" : "Work light");
        node.title = "Shows the scene without any light; it is not part of the design";
    }};
}
