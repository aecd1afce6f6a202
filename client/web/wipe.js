// Two pictures over the live one: one of them, both side by side, or a wipe with a divider. In the page only.

import {h} from "./dom.js";

const kStep = 1, kLargeStep = 10;    // percent

export class Wipe extends EventTarget {
    mode = "off";       // off a b side wipe
    divider = 50;       // percent of the width that shows A

    #node; #slider; #live;
    #panes = {};        // a, b: {node, image, mirror, title}

    // screen: what holds the live picture. live(): the element that shows it. Event "moved": the divider.
    constructor(screen, live) {
        super();
        this.#live = live;
        for (const side of ["a", "b"]) {
            const image = h("img", {alt: "", draggable: "false"}), mirror = h("canvas", {hidden: true}), title = h("span");
            this.#panes[side] = {image, mirror, title, node: h("figure", {class: `pane ${side}`}, image, mirror, h("figcaption", {}, h("b", {}, side.toUpperCase()), title))};
        }
        this.#slider = h("div", {class: "divider", role: "slider", tabindex: "0", "aria-label": "Divider between A and B", "aria-valuemin": "0", "aria-valuemax": "100"}, h("i"));
        this.#node = h("div", {id: "compare-view", role: "group", "aria-label": "Comparison of A and B", hidden: true}, this.#panes.a.node, this.#panes.b.node, this.#slider);
        screen.querySelector("#veil").before(this.#node);
        this.#listen();
        this.move(this.divider);
    }

    // picture: {url, name}, or null for the live picture.
    show(side, picture) {
        const {image, mirror, title} = this.#panes[side];
        image.hidden = !picture;
        mirror.hidden = Boolean(picture);
        if (picture) image.src = picture.url;
        image.alt = picture ? `${side.toUpperCase()}: ${picture.name}` : "";
        title.textContent = picture?.name ?? "Live";
        this.mirror();
    }

    setMode(mode) {
        this.mode = mode;
        this.#node.dataset.mode = mode;
        this.#node.hidden = mode === "off";
        this.mirror();
    }

    move(percent) {
        this.divider = Math.min(100, Math.max(0, Math.round(10 * percent) / 10));
        this.#node.style.setProperty("--at", `${this.divider}%`);
        this.#slider.setAttribute("aria-valuenow", String(this.divider));
        this.#slider.setAttribute("aria-valuetext", `${Math.round(this.divider)} % A`);
        this.dispatchEvent(new Event("moved"));
    }

    // Draws the live picture where it stands for A or B.
    mirror() {
        if (this.mode === "off") return;
        const live = this.#live(), width = live.naturalWidth ?? live.width, height = live.naturalHeight ?? live.height;
        for (const {mirror} of Object.values(this.#panes)) {
            if (mirror.hidden || !width) continue;
            if (mirror.width !== width || mirror.height !== height) Object.assign(mirror, {width, height});
            mirror.getContext("2d").drawImage(live, 0, 0);
        }
    }

    #listen() {
        const at = (event) => {
            const box = this.#node.getBoundingClientRect();
            this.move(100 * (event.clientX - box.left) / box.width);
        };
        this.#node.addEventListener("pointerdown", (event) => {
            if (this.mode !== "wipe" || event.button !== 0) return;
            event.preventDefault();
            this.#slider.focus();
            this.#node.setPointerCapture(event.pointerId);
            at(event);
        });
        this.#node.addEventListener("pointermove", (event) => { if (this.#node.hasPointerCapture(event.pointerId)) at(event); });
        this.#slider.addEventListener("keydown", (event) => {
            const step = event.shiftKey ? kLargeStep : kStep;
            const to = {ArrowLeft: this.divider - step, ArrowDown: this.divider - step, ArrowRight: this.divider + step, ArrowUp: this.divider + step,
                PageDown: this.divider - kLargeStep, PageUp: this.divider + kLargeStep, Home: 0, End: 100}[event.key];
            if (to === undefined) return;
            event.preventDefault();
            event.stopPropagation();
            this.move(to);
        });
    }
}
