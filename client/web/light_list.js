// The list of lights: only the rows that can be seen are in the page, so that hundreds of lights cost no more than a few.
// One field filters it by name or profile; shift, Ctrl, the arrow keys and "Select all" select several.

import {h, setText} from "./dom.js";

const kWhole = 40;        // so many rows are all there
const kBeyond = 6;        // rows above and below those that are seen
const kUsualRow_px = 48;  // until one has been measured

const wordsOf = (text) => text.toLowerCase().split(/\s+/).filter(Boolean);

// Result: the lights whose name and profile have every word of the text, in their order.
export function matching(lights, text) {
    const words = wordsOf(text);
    if (words.length === 0) return lights;
    return lights.filter(({name, profile, product = ""}) => {
        const both = `${name} ${product} ${profile}`.toLowerCase();
        return words.every((word) => both.includes(word));
    });
}

export class LightList {
    node; tools;
    drawn = 0;                 // rows that were made, for tests

    #store; #makeRow;
    #list = h("ul", {class: "list", id: "light-list"});
    #above = h("li", {class: "space", "aria-hidden": "true"});
    #below = h("li", {class: "space", "aria-hidden": "true"});
    #filter = h("input", {type: "search", id: "light-filter", placeholder: "Name or profile", "aria-label": "Filter lights by name or profile", spellcheck: "false"});
    #all = h("button", {type: "button", class: "quiet", id: "light-all", title: "Select all lights that match (Ctrl+A in the list)"});
    #rows = new Map();         // name -> {node, update}
    #row_px = kUsualRow_px;
    #shown = []; #text = "";
    #anchor = null;            // where a range begins
    #planned = false;

    // makeRow(name): {node, update}; its first button selects the light.
    constructor(store, makeRow) {
        this.#store = store;
        this.#makeRow = makeRow;
        this.node = this.#list;
        this.tools = h("div", {class: "row", id: "light-tools"}, this.#filter, this.#all);
        this.#list.append(this.#above, this.#below);
        this.#filter.addEventListener("input", () => { this.#text = this.#filter.value; this.update(); });
        this.#filter.addEventListener("keydown", (event) => this.#leaveFilter(event));
        this.#all.addEventListener("click", () => this.#chooseAll());
        this.#list.addEventListener("keydown", (event) => this.#key(event));
        const again = () => this.#plan();
        document.addEventListener("scroll", again, {capture: true, passive: true});
        addEventListener("resize", again);
    }

    // A click on a row: alone; Ctrl or "several" beside the others; shift up to here.
    press(name, event, several = false) {
        if (event.shiftKey && this.#anchor !== null) return this.#chooseTo(name, event.ctrlKey || event.metaKey);
        this.#anchor = name;
        if (event.ctrlKey || event.metaKey || several) this.#store.toggle(name);
        else this.#store.select("light", name);
    }

    update() {
        const {lights} = this.#store.state;
        this.#shown = matching(lights, this.#text);
        this.tools.hidden = lights.length < 2;
        setText(this.#all, this.#text.trim() ? `Select ${this.#shown.length}` : "Select all");
        this.#all.disabled = this.#shown.length === 0;
        this.#draw();
    }

    #plan() {
        if (this.#planned || !this.#store.state) return;
        this.#planned = true;
        requestAnimationFrame(() => { this.#planned = false; this.#draw(); });
    }

    // Result: first and last row (behind it) that can be seen, and some beyond.
    #window() {
        const count = this.#shown.length;
        if (count <= kWhole) return [0, count];
        const list = this.#list.getBoundingClientRect(), panel = this.#list.parentElement.getBoundingClientRect();
        const top = Math.max(0, panel.top) - list.top, bottom = Math.min(innerHeight, panel.bottom) - list.top;
        const first = Math.floor(top / this.#row_px) - kBeyond, last = Math.ceil(bottom / this.#row_px) + kBeyond;
        return [Math.max(0, Math.min(count, first)), Math.max(0, Math.min(count, last))];
    }

    // Rows of names that stay are kept, so that a fader in the hand is not rebuilt under it.
    #draw() {
        const [first, last] = this.#window(), names = this.#shown.slice(first, last).map(({name}) => name);
        const focused = this.#focusedName();
        if (focused !== undefined && !names.includes(focused) && this.#shown.some(({name}) => name === focused)) names.push(focused);
        const wanted = new Set(names);
        for (const [name, {node}] of this.#rows) {
            if (wanted.has(name)) continue;
            node.remove();
            this.#rows.delete(name);
        }
        let before = this.#above;
        names.forEach((name, i) => {
            if (!this.#rows.has(name)) {
                this.#rows.set(name, this.#makeRow(name));
                this.drawn++;
            }
            const {node} = this.#rows.get(name);
            if (before.nextSibling !== node) before.after(node);
            before = node;
            const place = first + i + 1;
            node.setAttribute("aria-setsize", this.#shown.length);
            node.setAttribute("aria-posinset", i < last - first ? place : this.#shown.findIndex((light) => light.name === name) + 1);
        });
        for (const {update} of this.#rows.values()) update();
        const height = names.length ? this.#rows.get(names[0]).node.offsetHeight : 0;
        if (height > 0) this.#row_px = height;
        this.#space(this.#above, first);
        this.#space(this.#below, this.#shown.length - last);
    }

    #space(node, rows) {
        const height = `${rows * this.#row_px}px`;
        node.hidden = rows <= 0;
        if (node.style.height !== height) node.style.height = height;
    }

    #focusedName() { return this.#list.contains(document.activeElement) ? document.activeElement.closest("li")?.dataset.name : undefined; }

    #chooseAll() {
        if (this.#shown.length) this.#store.choose(this.#shown.map(({name}) => name));
    }

    // From the anchor to the light.
    #chooseTo(name, beside = false) {
        const at = this.#shown.findIndex((light) => light.name === this.#anchor), to = this.#shown.findIndex((light) => light.name === name);
        if (at < 0 || to < 0) return this.#store.select("light", name);
        const range = this.#shown.slice(Math.min(at, to), Math.max(at, to) + 1).map((light) => light.name);
        this.#store.choose(range, {first: name, beside});
    }

    // Scrolls the row into view and gives its button the focus.
    show(name, {focus = false} = {}) {
        const at = this.#shown.findIndex((light) => light.name === name);
        if (at < 0) return;
        const panel = this.#list.parentElement, list = this.#list.getBoundingClientRect(), box = panel.getBoundingClientRect();
        const top = list.top + at * this.#row_px, bottom = top + this.#row_px;
        if (top < box.top) panel.scrollTop -= box.top - top;
        if (bottom > box.bottom) panel.scrollTop += bottom - box.bottom;
        this.#draw();
        const row = this.#rows.get(name)?.node;
        if (focus) row?.querySelector("button").focus({preventScroll: true});
    }

    #key(event) {
        const name = event.target.matches(".pick") ? event.target.closest("li").dataset.name : undefined;
        if (name === undefined || event.altKey) return;
        if (event.key === "a" && (event.ctrlKey || event.metaKey)) {
            event.preventDefault();
            return this.#chooseAll();
        }
        const at = this.#shown.findIndex((light) => light.name === name), end = this.#shown.length - 1;
        const to = {ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: end, PageDown: at + 10, PageUp: at - 10}[event.key];
        if (to === undefined || event.ctrlKey || event.metaKey) return;
        event.preventDefault();
        const next = this.#shown[Math.max(0, Math.min(end, to))].name;
        if (event.shiftKey) {
            this.#anchor ??= name;
            this.#chooseTo(next);
        } else {
            this.#anchor = next;
            this.#store.select("light", next);
        }
        this.show(next, {focus: true});
    }

    #leaveFilter(event) {
        if (event.key === "Enter") this.#chooseAll();
        if (event.key === "Escape" && this.#filter.value) {
            event.stopPropagation();
            this.#filter.value = this.#text = "";
            this.update();
        }
        if (event.key === "ArrowDown" && this.#shown.length) {
            event.preventDefault();
            this.#anchor = this.#shown[0].name;
            this.#store.select("light", this.#anchor);
            this.show(this.#anchor, {focus: true});
        }
    }
}
