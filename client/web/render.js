// The tool "Render": stills of chosen quality, size and file type. They go into a strip, from which they are saved or
// compared. Stills live in the page alone, and end with it; the live picture goes on meanwhile.

import {h, setText, formatNumber} from "./dom.js";
import {pictureOf, saveFile} from "./capture.js";
import {formatProgress} from "./meter.js";
import {sentence} from "./toast.js";

const kMostStills = 24;
const kViews = [["", "As shown"], ["beauty", "Beauty"], ["direct", "Direct"], ["indirect", "Indirect"], ["illuminance", "Illuminance"], ["luminance", "Luminance"]];
const kQualities = [["interactive", "Live"], ["reference", "Reference"]];
const kSizes = [["", "As shown"], ["1280x720", "1280 × 720"], ["1920x1080", "1920 × 1080"], ["3840x2160", "3840 × 2160"], ["own", "Other…"]];
const kTypes = [["png", "PNG"], ["jpg", "JPEG"], ["exr", "EXR, linear values"]];
const kMostSide_px = 4096;

export class RenderPanel {
    #store; #connection; #compare;
    #fields; #widths; #start; #cancel; #bar; #told;
    #rows = {};                       // label -> what hides with it
    #strip = h("ul", {class: "kept", "aria-label": "Stills"});
    #aborter = null;                  // of the still that is being rendered

    // compare: has keep(name, blob).
    constructor(store, connection, node, compare) {
        this.#store = store;
        this.#connection = connection;
        this.#compare = compare;
        const select = (label, list) => h("select", {"aria-label": label}, ...list.map(([value, text]) => h("option", {value}, text)));
        const number = (label, props) => h("input", {type: "number", "aria-label": label, ...props});
        const tick = (id) => h("input", {type: "checkbox", id});
        const side = {class: "wide", min: 1, max: kMostSide_px, step: 1, required: true};
        this.#widths = [number("Width, px", {...side, value: 1600}), number("Height, px", {...side, value: 900})];
        this.#fields = {
            view: select("View to render", kViews), quality: select("Quality of the still", kQualities), size: select("Size of the still", kSizes),
            noise: number("Noise target, percent", {min: 0.05, max: 50, step: "any", value: 2, required: true}),
            seconds: number("Longest time, seconds", {min: 0.1, max: 86400, step: "any", placeholder: "none"}),
            type: select("File type", kTypes), denoise: tick("render-denoise"), legend: tick("render-legend"),
        };
        const {view, quality, size, noise, seconds, type, denoise, legend} = this.#fields;
        const row = (name, text, title, ...inputs) => this.#rows[name] = h(inputs.length === 1 ? "label" : "span", {class: "meter-field", title}, h("span", {class: "faint"}, text), ...inputs);
        this.#start = h("button", {id: "render-start"}, "Render");
        this.#cancel = h("button", {type: "button", id: "render-cancel", class: "quiet", hidden: true, onclick: () => this.#aborter?.abort()}, "Cancel");
        this.#bar = h("progress", {id: "render-bar", max: 1, "aria-label": "How far the still is", hidden: true});
        this.#told = h("output", {id: "render-told", role: "status"});
        const form = h("form", {},
            row("view", "View", null, view), row("quality", "Quality", "Live: every bounce, in seconds. Reference: path-traced, and says its noise", quality),
            row("size", "Size", null, size), row("own", "px", null, this.#widths[0], "×", this.#widths[1]),
            row("noise", "Noise target, %", "Standard error of the pixels at which it ends, of their mean", noise),
            row("seconds", "At most, s", "It ends then with what it has; empty: no limit", seconds),
            row("denoise", "Denoise", "Few samples and a filter: to look at, not to measure", denoise),
            row("type", "File", null, type), row("legend", "Legend", "The scale of the colours is drawn into the picture", legend),
            this.#start, this.#cancel, this.#bar);
        form.addEventListener("submit", (event) => {
            event.preventDefault();
            this.#render();
        });
        form.addEventListener("change", () => this.#offer());
        store.addEventListener("update", () => this.#offer());
        node.append(form, this.#told, this.#strip);
        this.#offer();
    }

    // What a still of the chosen kind can have.
    #offer() {
        const {view, quality, size, type, denoise} = this.#fields, name = view.value || this.#store.state?.view;
        const reference = quality.value === "reference";
        const shown = {own: size.value === "own", noise: reference && !(denoise.checked && name === "beauty"), seconds: reference,
            denoise: reference && name === "beauty", legend: type.value !== "exr" && ["illuminance", "luminance"].includes(name)};
        for (const [row, visible] of Object.entries(shown)) {
            this.#rows[row].hidden = !visible;
            for (const input of this.#rows[row].querySelectorAll("input")) input.disabled = !visible;    // hidden fields are not checked
        }
    }

    // Result: the CaptureQuery of the fields that are offered.
    #query() {
        const {view, quality, size, noise, seconds, type, denoise, legend} = this.#fields;
        const on = (tick) => !tick.disabled && tick.checked;
        const query = {format: type.value, quality: quality.value};
        if (view.value) query.view = view.value;
        const sides = size.value === "own" ? this.#widths.map((input) => Number(input.value)) : size.value.split("x").map(Number);
        if (size.value) [query.width_px, query.height_px] = sides;
        if (!noise.disabled) query.noise_ratio = Number(noise.value) / 100;
        if (!seconds.disabled && seconds.value) query.max_seconds = Number(seconds.value);
        for (const [name, tick] of Object.entries({denoise, legend})) if (on(tick)) query[name] = true;
        return query;
    }

    async #render() {
        if (this.#aborter) return;
        const query = this.#query();
        this.#aborter = new AbortController();
        this.#start.disabled = true;
        this.#cancel.hidden = this.#bar.hidden = false;
        this.#bar.removeAttribute("value");
        this.#tell("Rendering…");
        try {
            const {capture, result} = await this.#connection.request({capture: query},
                {signal: this.#aborter.signal, progress: (progress) => this.#progress(progress)});
            if (result?.code === "cancelled") this.#tell("Cancelled");
            else if (!capture) throw new Error(sentence(result ?? {code: "no answer"}));
            else this.#keep(capture, query);
        } catch (error) {
            this.#tell(error.message, true);
        }
        this.#aborter = null;
        this.#start.disabled = false;
        this.#cancel.hidden = this.#bar.hidden = true;
    }

    #progress(progress) {
        const {samples = 0, total, seconds = 0, seconds_left, jobs_before = 0} = progress;
        const share = jobs_before > 0 ? undefined : total ? samples / total : seconds_left === undefined ? undefined : seconds / Math.max(1e-9, seconds + seconds_left);
        if (share === undefined) this.#bar.removeAttribute("value");
        else this.#bar.value = share;
        this.#tell(formatProgress(progress));
    }

    #tell(text, bad = false) {
        setText(this.#told, text);
        this.#told.classList.toggle("bad", bad);
    }

    #keep(capture, query) {
        const picture = pictureOf(capture, this.#store.state, query);
        const {width_px, height_px, samples, noise_ratio, denoised, warnings = []} = capture;
        const facts = [`${width_px} × ${height_px}`];
        if (samples !== undefined) facts.push(`${samples} samples`, noise_ratio === undefined ? "noise not known: 8 samples are the fewest that tell it" : `noise ${formatNumber(100 * noise_ratio, 2)} %`);
        if (denoised) facts.push("denoised");
        const text = facts.join(", ");
        const shown = query.format !== "exr", url = URL.createObjectURL(picture.blob);
        const item = h("li", {},
            shown ? h("img", {src: url, alt: "", draggable: "false"}) : h("span", {class: "no-image faint"}, "EXR"),
            h("span", {class: "name", title: `${picture.name}: ${text}`}, picture.name), h("span", {class: "facts faint"}, text),
            h("span", {class: "row"},
                h("button", {type: "button", class: "quiet", "aria-label": `Save ${picture.name}`, onclick: () => saveFile(picture.blob, picture.name)}, "Save"),
                shown ? h("button", {type: "button", class: "quiet", "aria-label": `Compare ${picture.name}`, title: "Puts it into the strip of Compare", onclick: (event) => {
                    this.#compare.keep(picture.name, picture.blob);
                    event.target.disabled = true;
                }}, "Compare") : null,
                h("button", {type: "button", class: "quiet", "aria-label": `Forget ${picture.name}`, title: "Forget this still", onclick: forget}, "×")));
        function forget() {
            URL.revokeObjectURL(url);
            item.remove();
        }
        this.#strip.prepend(item);
        if (this.#strip.children.length > kMostStills) this.#strip.lastElementChild.querySelector("button:last-child").click();
        this.#tell([`Rendered ${text}`, ...warnings].join(". "), warnings.length > 0);
    }
}
