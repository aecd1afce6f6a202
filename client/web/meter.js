// The meter: illuminance at a point, and captures, in the quality that is asked for. Reference work goes on beside the
// live picture; how far it is comes as "progress" events.

import {h, setText, formatNumber} from "./dom.js";
import {saveCapture} from "./capture.js";
import {sentence} from "./toast.js";

const kQualities = [["interactive", "Live"], ["rsm", "One bounce"], ["reference", "Reference"]];
const kNoises = [["0.05", "5 %"], ["0.02", "2 %"], ["0.01", "1 %"], ["0.005", "0.5 %"], ["0.002", "0.2 %"]];

const options = (list, chosen) => list.map(([value, text]) => h("option", {value, selected: value === chosen}, text));

// "250.0 lx ± 0.2": as many digits as its error leaves sense for.
export function formatLux(lx, error_lx = 0) {
    const digits = error_lx > 0 ? Math.min(3, Math.max(0, Math.ceil(1 - Math.log10(error_lx)))) : lx < 10 ? 3 : lx < 1000 ? 1 : 0;
    return `${formatNumber(lx, digits)} lx` + (error_lx > 0 ? ` ± ${formatNumber(error_lx, digits)}` : "");
}

export function formatProgress({jobs_before = 0, samples = 0, total, unit = "done", noise_ratio = 0, seconds = 0, seconds_left}) {
    if (jobs_before > 0) return `Waiting: ${jobs_before} ${jobs_before === 1 ? "job comes" : "jobs come"} first`;
    const done = `${samples}${total === undefined ? "" : ` of ${total}`} ${unit}`
        + (noise_ratio > 0 ? ` · noise ${formatNumber(100 * noise_ratio, 2)} %` : "");
    const left = seconds_left === undefined ? "" : ` · ${formatNumber(seconds_left, 0)} s left`;
    return `${formatNumber(seconds, 0)} s · ${done}${left}`;
}

export class MeterPanel {
    #store; #connection; #result; #buttons; #quality; #noise; #denoise;
    #vectors;

    constructor(store, connection, node) {
        this.#store = store;
        this.#connection = connection;
        const vector = (name, values) => ["x", "y", "z"].map((letter, i) => h("input", {type: "number", step: "any",
            value: values[i], "aria-label": `${name} ${letter}`, required: true}));
        this.#vectors = {point_m: vector("Point", [0, 0, 0]), normal: vector("Normal", [0, 1, 0])};
        this.#quality = h("select", {"aria-label": "Quality", id: "meter-quality",
            title: "Live: at once, every bounce. One bounce: direct light and one reflection, summed exactly. Reference: path-traced, and says its error"}, ...options(kQualities, "interactive"));
        this.#noise = h("select", {"aria-label": "Noise of reference quality", title: "Standard error at which reference quality stops"},
            ...options(kNoises, "0.01"));
        this.#denoise = h("input", {type: "checkbox", id: "meter-denoise"});
        const denoise = h("label", {class: "meter-field", title: "Filters a reference capture of the beauty view: to look at, not to measure"},
            this.#denoise, "Denoise");
        this.#result = h("output", {id: "meter-result", role: "status"}, "");
        const capture = h("button", {type: "button", id: "meter-capture", onclick: () => this.#work("Capturing…", () => this.#capture())}, "Capture");
        this.#buttons = [h("button", {id: "meter-read"}, "Read"), capture];
        const field = (label, ...inputs) => h("span", {class: "meter-field"}, h("span", {class: "faint"}, label), ...inputs);
        const form = h("form", {}, field("Point, m", ...this.#vectors.point_m), field("Normal", ...this.#vectors.normal),
            field("Quality", this.#quality, this.#noise), denoise, ...this.#buttons);
        form.addEventListener("submit", (event) => {
            event.preventDefault();
            this.#work("Reading…", () => this.#read());
        });
        const show = () => {
            this.#noise.hidden = denoise.hidden = this.#quality.value !== "reference";
            capture.hidden = this.#quality.value === "rsm";    // a meter only
        };
        this.#quality.addEventListener("change", show);
        show();
        connection.addEventListener("progress", (event) => {
            if (this.#buttons[0].disabled) setText(this.#result, formatProgress(event.detail));
        });
        node.append(form, this.#result);
    }

    // One question at a time; its refusal is told in the result's place.
    async #work(text, ask) {
        this.#buttons.forEach((button) => { button.disabled = true; });
        setText(this.#result, text);
        this.#result.classList.remove("bad");
        try {
            setText(this.#result, await ask());
        } catch (error) {
            setText(this.#result, error.message);
            this.#result.classList.add("bad");
        }
        this.#buttons.forEach((button) => { button.disabled = false; });
    }

    #settings() {
        const quality = this.#quality.value;
        return quality === "reference" ? {quality, noise_ratio: Number(this.#noise.value)} : {quality};
    }
    // Fewer samples are enough for the filter: as many as the server takes by itself.
    get #denoises() { return this.#quality.value === "reference" && this.#denoise.checked; }

    async #read() {
        const numbers = (inputs) => inputs.map((input) => Number(input.value));
        const {meter, result} = await this.#connection.request({meter: {point_m: numbers(this.#vectors.point_m),
            normal: numbers(this.#vectors.normal), ...this.#settings()}});
        if (!meter) throw new Error(sentence(result ?? {code: "no answer"}));
        const error = Math.hypot(meter.direct_error_lx ?? 0, meter.indirect_error_lx ?? 0);
        return `${formatLux(meter.total_lx, error)} · direct ${formatLux(meter.direct_lx, meter.direct_error_lx)} · `
            + `indirect ${formatLux(meter.indirect_lx, meter.indirect_error_lx)} · ${meter.samples} samples`;
    }

    async #capture() {
        const {capture, result} = await saveCapture(this.#connection, this.#store, {format: "png",
            ...(this.#denoises ? {quality: "reference", denoise: true} : this.#settings())});
        if (!capture) throw new Error(sentence(result ?? {code: "no answer"}));
        const known = capture.noise_ratio === undefined ? "noise not known: 8 samples are the fewest that tell it"
            : `noise ${formatNumber(100 * capture.noise_ratio, 2)} %`;
        const noise = capture.samples === undefined ? "" : ` · ${capture.samples} samples, ${known}${capture.denoised ? ", denoised" : ""}`;
        return `Saved ${capture.width_px} × ${capture.height_px} of revision ${capture.scene_rev}${noise}`;
    }
}
