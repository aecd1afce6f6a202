// Who holds the camera, and a button to take or release it. Held by this page it is kept until it is released.
// A page with ?role=viewer only looks: what would change something is inert. Whose token is a viewer's comes there by itself.

import {h, setText} from "./dom.js";

// Who that is, as people would say it: pages and programs identify themselves by one word.
const otherName = (name, holder) => (name === "page" ? "Another page" : name === "gonio" ? "The command line" : name || `Client ${holder}`);

const kRenewMs = 10000;    // the lease ends 30 s after its last renewal

export const pageRole = new URLSearchParams(location.search).get("role") === "viewer" ? "viewer" : "";

export function controlPanel(store, node, connection) {
    const note = h("span", {class: "faint"});
    const button = h("button", {type: "button", class: "quiet", id: "take-camera"}, "Take camera");
    let timer = 0;
    const ask = async (message) => {
        try {
            const {result} = await connection.request(message);
            if (result && result.code !== "ok") connection.dispatchEvent(new CustomEvent("refused", {detail: result}));
        } catch { /* the connection has ended, and the lease with it */ }
    };
    button.addEventListener("click", () =>
        ask(store.holdsCamera ? {release_control: {}} : {acquire_control: {take: store.cameraIsOthers}}));
    if (pageRole !== "viewer") node.append(note, button);
    else node.append(h("span", {class: "faint"}, "Viewing only"));
    return {update() {
        const {holder = 0, name = ""} = store.state.control ?? {};
        setText(note, store.holdsCamera ? "You have the camera" : holder ? `${otherName(name, holder)} has the camera` : "");
        setText(button, store.holdsCamera ? "Release" : "Take camera");
        button.title = store.holdsCamera ? "Let others move the camera" : "Nobody else moves the camera then";
        if (store.holdsCamera && !timer) timer = setInterval(() => ask({acquire_control: {}}), kRenewMs);
        if (!store.holdsCamera && timer) timer = clearInterval(timer) ?? 0;
    }};
}

// Result: the address of this page as the server lets it be, where it is another than that of `pageRole`; else null.
export function addressOf(role) {
    if (role !== "viewer" || pageRole === "viewer") return null;
    const address = new URL(location.href);
    address.searchParams.set("role", "viewer");
    return address.href;
}

// Everything but the picture and what only asks.
export function onlyLook(elements) {
    if (pageRole !== "viewer") return;
    document.body.classList.add("viewer");
    for (const element of elements) element.inert = true;
}
