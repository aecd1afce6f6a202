// The tool "Compare": pictures are kept in a strip, two of them, or one and the live picture, are laid over each other.
// Kept pictures live in the page alone, and end with it.

import {h, setText, onPageKey} from "./dom.js";
import {pictureOf} from "./capture.js";
import {pageRole} from "./control.js";
import {scaleOf} from "./legend.js";
import {formatProgress} from "./meter.js";
import {sentence} from "./toast.js";
import {Wipe} from "./wipe.js";

const kMostKept = 12;
const kRestMs = 20000;    // a picture that does not come to rest is taken as it is
const kModes = [["off", "Off"], ["a", "A"], ["b", "B"], ["side", "Side by side"], ["wipe", "Wipe"]];

export class ComparePanel {
    #store; #connection; #video; #screen; #live; #wipe;
    #kept = [];                       // {name, url, node}
    #chosen = {a: null, b: null};     // of the kept; null: the live picture
    #strip = h("ul", {class: "kept", "aria-label": "Kept pictures"});
    #hint = h("p", {class: "hint", role: "status"});
    #preset = h("select", {"aria-label": "Preset to keep a picture of"});
    #buttons; #modes; #number; #presets;
    #taken = 0;
    #undoes = "";                     // what this page's undo would do

    constructor(store, connection, video, node, screen) {
        this.#store = store;
        this.#connection = connection;
        this.#video = video;
        this.#screen = screen;
        this.#live = () => screen.querySelector(video.mode === "h264" ? "#canvas" : "#still");
        this.#wipe = new Wipe(screen, this.#live);
        const button = (id, text, title, run) => h("button", {type: "button", id, title, onclick: run}, text);
        const keep = (side) => this.#work(async () => this.#choose(side, await this.#keepShown(this.#nameNow())));
        this.#buttons = [button("keep-a", "Keep as A", "A picture of what is shown now", () => keep("a")),
            button("keep-b", "Keep as B", "A picture of what is shown now", () => keep("b")),
            button("keep-capture", "Capture", "A picture without video compression, with every edge smooth: takes longer", () => this.#work(() => this.#capture(this.#nameNow())))];
        const ofPreset = button("keep-preset", "Keep preset", "The lights go to the preset for this picture, and back", () => this.#work(() => this.#capturePreset(this.#preset.value)));
        this.#presets = h("span", {class: "row", hidden: true}, this.#preset, ofPreset);
        this.#buttons.push(ofPreset);
        this.#modes = h("div", {class: "row modes", role: "radiogroup", "aria-label": "Comparison"}, ...kModes.map(([mode, text]) =>
            h("button", {type: "button", role: "radio", "data-mode": mode, onclick: () => this.#setMode(mode)}, text)));
        this.#modes.addEventListener("keydown", (event) => this.#arrows(event));
        this.#number = h("input", {type: "number", min: 0, max: 100, step: 1, "aria-label": "Divider, percent"});
        this.#number.addEventListener("change", () => this.#wipe.move(Number(this.#number.value) || 0));
        this.#wipe.addEventListener("moved", () => { this.#number.value = Math.round(this.#wipe.divider); });
        this.#number.value = this.#wipe.divider;
        node.append(h("div", {class: "row wrap compare-bar"}, ...this.#buttons.slice(0, 3), this.#presets, this.#modes,
            h("label", {class: "meter-field"}, h("span", {class: "faint"}, "Divider, %"), this.#number), this.#hint), this.#strip);
        this.#setMode("off");
        for (const side of ["a", "b"]) this.#choose(side, null);
        video.addEventListener("shown", () => this.#wipe.mirror());
        connection.addEventListener("undo", ({detail}) => { this.#undoes = detail.undo_label ?? ""; });
        store.addEventListener("update", () => {
            this.#offerPresets();
            this.#showScale();
        });
        onPageKey((event) => {
            if (event.key === "Escape" && this.#wipe.mode !== "off" && !event.target.closest("input, select")) this.#setMode("off");
        });
    }

    #offerPresets() {
        const names = pageRole === "viewer" ? [] : this.#store.state.presets?.names ?? [];
        this.#presets.hidden = names.length === 0;
        if (JSON.stringify(names) === this.#preset.dataset.names) return;
        this.#preset.dataset.names = JSON.stringify(names);
        this.#preset.replaceChildren(...names.map((name) => h("option", {value: name}, name)));
    }

    #nameNow() {
        return `${++this.#taken}: ${this.#store.state.presets?.recalled || "without a preset"}`;
    }

    // One picture at a time; a refusal is told in the panel.
    async #work(take) {
        this.#buttons.forEach((button) => { button.disabled = true; });
        setText(this.#hint, "Taking the picture…");
        try {
            await take();
            setText(this.#hint, "");
        } catch (error) {
            setText(this.#hint, error.message || "Not connected");
        }
        this.#buttons.forEach((button) => { button.disabled = false; });
    }

    // Result: the kept picture. Rejects with what the server says.
    async #capture(name) {
        const {capture, result} = await this.#connection.request({capture: {format: "png"}},
            {progress: (progress) => setText(this.#hint, formatProgress(progress))});
        if (!capture) throw new Error(sentence(result ?? {code: "no answer"}));
        return this.keep(name, pictureOf(capture, this.#store.state, {}).blob);
    }

    async #keepShown(name) {
        const live = this.#live(), copy = document.createElement("canvas");
        Object.assign(copy, {width: live.naturalWidth ?? live.width, height: live.naturalHeight ?? live.height});
        copy.getContext("2d").drawImage(live, 0, 0);
        const blob = await new Promise((resolve) => copy.toBlob(resolve));
        if (!blob) throw new Error("There is no picture yet.");
        return this.keep(name, blob);
    }

    // Into the strip; beyond kMostKept the oldest goes. Result: the kept picture.
    keep(name, blob) {
        const kept = {name, url: URL.createObjectURL(blob), scale: this.#scale()};
        kept.node = this.#row(kept);
        this.#kept.push(kept);
        this.#strip.append(kept.node);
        if (this.#kept.length > kMostKept) this.#forget(this.#kept[0]);
        return kept;
    }

    // The lights go there and come back: undo sets back what this page's recall changed.
    async #capturePreset(name) {
        const before = this.#store.state.scene_rev;
        const recalled = await this.#connection.command({recall_preset: {name}});
        if (recalled?.code !== "ok") return;
        try {
            await this.#rested(recalled.scene_rev);
            await this.#keepShown(`${++this.#taken}: ${name}`);
        } finally {
            if (recalled.scene_rev > before && this.#undoes === `recall preset ${name}`) await this.#connection.command({undo: {}});
        }
    }

    // Resolves when the picture shows a revision and rests; of a stream that tells neither, after a while.
    #rested(scene_rev) {
        return new Promise((resolve) => {
            const end = () => {
                clearTimeout(timer);
                this.#video.removeEventListener("shown", seen);
                resolve();
            };
            const seen = ({detail}) => { if (detail.final && detail.scene_rev >= scene_rev) end(); };
            const timer = setTimeout(end, this.#video.mode === "h264" ? kRestMs : kRestMs / 10);
            this.#video.addEventListener("shown", seen);
        });
    }

    #row(kept) {
        const side = (name) => h("button", {type: "button", class: "quiet", "data-side": name, "aria-label": `${kept.name} is ${name.toUpperCase()}`, "aria-pressed": "false",
            onclick: () => this.#choose(name, this.#chosen[name] === kept ? null : kept)}, name.toUpperCase());
        return h("li", {}, h("img", {src: kept.url, alt: "", draggable: "false"}), h("span", {class: "name", title: kept.name}, kept.name),
            h("span", {class: "row"}, side("a"), side("b"),
                h("button", {type: "button", class: "quiet", "aria-label": `Forget ${kept.name}`, title: "Forget this picture", onclick: () => this.#forget(kept)}, "×")));
    }

    #forget(kept) {
        for (const side of ["a", "b"]) if (this.#chosen[side] === kept) this.#choose(side, null);
        this.#kept = this.#kept.filter((other) => other !== kept);
        kept.node.remove();
        URL.revokeObjectURL(kept.url);
    }

    #choose(side, kept) {
        this.#chosen[side] = kept;
        this.#wipe.show(side, kept);
        for (const one of this.#kept) one.node.querySelector(`[data-side=${side}]`).setAttribute("aria-pressed", String(one === kept));
        this.#showScale();
    }

    // What the colours of the live picture stand for; "" where it is none of false colour.
    #scale() {
        const scale = scaleOf(this.#store.state);
        return scale ? JSON.stringify({...scale, palette: scale.palette.help}) : "";
    }

    // The legend is of both pictures, or it is hidden.
    #showScale() {
        const sides = {a: ["a"], b: ["b"]}[this.#wipe.mode] ?? ["a", "b"], now = this.#scale();
        this.#screen.classList.toggle("one-scale", sides.every((side) => (this.#chosen[side]?.scale ?? now) === now));
    }

    #setMode(mode) {
        this.#wipe.setMode(mode);
        this.#showScale();
        for (const button of this.#modes.children) {
            const on = button.dataset.mode === mode;
            button.setAttribute("aria-checked", String(on));
            button.tabIndex = on ? 0 : -1;
        }
    }

    #arrows(event) {
        const buttons = [...this.#modes.children], step = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
        if (!step) return;
        event.preventDefault();
        const next = buttons[(buttons.indexOf(document.activeElement) + step + buttons.length) % buttons.length];
        next.focus();
        next.click();
    }
}
