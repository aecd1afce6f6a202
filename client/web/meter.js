// The meter: illuminance at a point, in the quality that is asked for. Reference work goes on beside the live picture.

import {h, setText, formatNumber} from "./dom.js";
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
    const [unit_s, unit_name] = seconds_left < 600 ? [1, "s"] : seconds_left < 7200 ? [60, "min"] : [3600, "h"];
    const left = seconds_left === undefined ? "" : ` · ${formatNumber(seconds_left / unit_s, 0)} ${unit_name} left`;
    return `${formatNumber(seconds, 0)} s · ${done}${left}`;
}

export class MeterPanel {
    #connection; #result; #read; #quality; #noise; #vectors;

    constructor(connection, node) {
        this.#connection = connection;
        const vector = (name, values) => ["x", "y", "z"].map((letter, i) => h("input", {type: "number", step: "any",
            value: values[i], "aria-label": `${name} ${letter}`, required: true}));
        this.#vectors = {point_m: vector("Point", [0, 0, 0]), normal: vector("Normal", [0, 1, 0])};
        this.#quality = h("select", {"aria-label": "Quality", id: "meter-quality",
            title: "Live: at once, every bounce. One bounce: direct light and one reflection, summed exactly. Reference: path-traced, and says its error"}, ...options(kQualities, "interactive"));
        this.#noise = h("select", {"aria-label": "Noise of reference quality", title: "Standard error at which reference quality stops"},
            ...options(kNoises, "0.01"));
        this.#result = h("output", {id: "meter-result", role: "status"}, "");
        this.#read = h("button", {id: "meter-read"}, "Read");
        const field = (label, ...inputs) => h("span", {class: "meter-field"}, h("span", {class: "faint"}, label), ...inputs);
        const form = h("form", {}, field("Point, m", ...this.#vectors.point_m), field("Normal", ...this.#vectors.normal),
            field("Quality", this.#quality, this.#noise), this.#read);
        form.addEventListener("submit", (event) => {
            event.preventDefault();
            this.#work("Reading…", () => this.#reading());
        });
        const show = () => { this.#noise.hidden = this.#quality.value !== "reference"; };
        this.#quality.addEventListener("change", show);
        show();
        node.append(form, this.#result);
    }

    // One question at a time; its refusal is told in the result's place.
    async #work(text, ask) {
        this.#read.disabled = true;
        setText(this.#result, text);
        this.#result.classList.remove("bad");
        try {
            setText(this.#result, await ask());
        } catch (error) {
            setText(this.#result, error.message);
            this.#result.classList.add("bad");
        }
        this.#read.disabled = false;
    }

    #settings() {
        const quality = this.#quality.value;
        return quality === "reference" ? {quality, noise_ratio: Number(this.#noise.value)} : {quality};
    }

    async #reading() {
        const numbers = (inputs) => inputs.map((input) => Number(input.value));
        const {meter, result} = await this.#connection.request({meter: {point_m: numbers(this.#vectors.point_m),
            normal: numbers(this.#vectors.normal), ...this.#settings()}}, {progress: (progress) => setText(this.#result, formatProgress(progress))});
        if (!meter) throw new Error(sentence(result ?? {code: "no answer"}));
        const error = Math.hypot(meter.direct_error_lx ?? 0, meter.indirect_error_lx ?? 0);
        return `${formatLux(meter.total_lx, error)} · direct ${formatLux(meter.direct_lx, meter.direct_error_lx)} · `
            + `indirect ${formatLux(meter.indirect_lx, meter.indirect_error_lx)} · ${meter.samples} samples`;
    }
}
