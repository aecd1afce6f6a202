// The profile of the selected light: built-in luminaires, upload of a photometric file, and its polar curve.

import {h, setText, formatLarge, formatNumber} from "./dom.js";
import {property, select} from "./controls.js";
import {setAll} from "./many.js";
import {polarDiagram} from "./polar.js";
import {sentence} from "./toast.js";
import {putFile} from "./upload_file.js";

const kMaxBytes = 1 << 20;    // of a profile in a message
const kDegree = Math.PI / 180;

const angle = (rad) => (rad === undefined || rad === null ? "–" : `${formatNumber(rad / kDegree, 1)}°`);

// Result: an angle in plane C0, and the widest one where that is wider: the same text wherever a beam is shown.
export const beamText = (rad, widest) => (widest > rad * 1.001 ? `${angle(rad)}, widest ${angle(widest)}` : angle(rad));

// Result: what a light's luminaire is called in lists: maker and luminaire, else the file's name without its folders.
export const luminaireOf = ({profile = "", product = ""} = {}) => product || profile.replace(/^.*\//, "");

// Result: rows of what a file says: [what, figure].
function factsOf({beam_rad, field_rad, widest_beam_rad, widest_field_rad, opening = "", length_m, width_m, height_m, input_watts, format, description}) {
    const size = [length_m, width_m, height_m].map((x) => formatNumber(x, 3)).join(" × ");
    return [["Beam, 50 %", beamText(beam_rad, widest_beam_rad)], ["Field, 10 %", beamText(field_rad, widest_field_rad)],
        ["Opening", opening === "point" ? "point" : `${opening.replaceAll("_", " ")}, ${size} m`],
        ...(input_watts > 0 ? [["Power", `${formatLarge(input_watts)} W`]] : []), ["File", [format, description].filter(Boolean).join(", ")]];
}

export const kPhotometry = [".ies", ".ldt", ".xml", ".iesxml", ".gldf", ".gdtf", ".zip"];
export const kPhotometryAccepted = [...kPhotometry, ".IES", ".LDT", "text/plain"].join(",");    // by a file input

// Result: a profile as SetLight has it; or {refused}, why the file cannot be one. What is too large for a message is uploaded.
async function profileOf(connection, file) {
    if (file.size > kMaxBytes) return putFile(connection, file);
    return {name: file.name.slice(0, 100), photometry: toBase64(new Uint8Array(await file.arrayBuffer()))};
}

// The file becomes the profile of the lights. Result: the answer to the command, or what the answer to it would say.
export async function giveProfile(connection, lights, file) {
    const {refused, ...profile} = await profileOf(connection, file);
    return refused ?? await connection.command(setAll(lights, {profile}), {quiet: true})
        ?? {code: "disconnected", field: "", message: "The connection ended before the server answered."};
}

// Base64 without a call per byte and without a stack of arguments.
function toBase64(bytes) {
    let text = "";
    for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
    return btoa(text);
}

export class ProfilePanel {
    #store; #connection;
    #select; #error; #warnings; #diagram; #figures; #facts; #output; #notes;
    #tilt_factor = 1; #input; #zone; #button;
    #shown = "";        // what the diagram shows
    #asked = "";        // what was asked for last
    #uploads = 0;

    constructor(store, connection) {
        this.#store = store;
        this.#connection = connection;
        const light = () => store.light(this.#name);
        const profile = property(store, () => `profile:${this.#name}`, () => light()?.profile,
            (name) => ({set_light: {name: this.#name, profile: {name}}}));
        const choose = {...profile, set: (name) => { this.#clear(); profile.set(name); }};
        this.#select = select(choose, {label: "Profile", options: () => store.state.profiles.map((name) => [name, name])});
        this.#input = h("input", {type: "file", id: "profile-file", accept: kPhotometryAccepted, hidden: true,
            "aria-label": "Photometric file", onchange: () => this.#take(this.#input.files[0])});
        this.#button = h("button", {type: "button", onclick: () => this.#input.click()}, "Upload…");
        this.#error = h("div", {class: "problem", role: "alert", id: "profile-error", hidden: true});
        this.#warnings = h("ul", {class: "warnings", hidden: true});
        this.#diagram = h("div", {class: "diagram"});
        this.#figures = h("p", {class: "figures"});
        this.#facts = h("dl", {class: "facts", id: "profile-facts"});
        this.#output = h("dd", {id: "light-output"});
        this.#notes = h("ul", {class: "warnings", id: "profile-notes", hidden: true, "aria-label": "Diagnostics of the file"});
        const legend = h("p", {class: "legend"}, h("i", {class: "solid"}), "C0–180", h("i", {class: "dashed"}), "C90–270");
        this.#zone = h("section", {id: "profile", "aria-label": "Profile"}, h("h3", {}, "Profile"),
            h("div", {class: "row"}, this.#select.node, this.#button, this.#input),
            this.#error, this.#warnings, this.#diagram, h("div", {class: "row wrap"}, this.#figures, legend), this.#facts, this.#notes);
        this.#acceptDrops();
        // A restarted server may know another profile by the same name.
        connection.addEventListener("ready", () => { this.#asked = ""; });
    }

    get node() { return this.#zone; }

    get #name() { return this.#store.selected?.kind === "light" ? this.#store.selected.name : ""; }

    update() {
        this.#select.update();
        const light = this.#store.light(this.#name);
        if (!light) return;
        this.#zone.hidden = Boolean(light.sun);    // it has no candela
        if (light.sun) return;
        const level = this.#store.value(`level:${light.name}`, light.level_ratio);
        setText(this.#output, `${formatLarge(light.flux_lm * light.multiplier * this.#tilt_factor * level)} lm at ${formatNumber(100 * level, 0)} %`);
        const wanted = JSON.stringify([light.name, light.profile, light.max_cd, light.flux_lm]);
        if (wanted !== this.#asked) {
            if (this.#shown && JSON.parse(this.#shown)[0] !== light.name) this.#clear();
            this.#asked = wanted;
            this.#draw(light.name, wanted);
        }
    }

    async #draw(light, wanted) {
        let reply;
        try {
            reply = await this.#connection.request({profile: {light}});
        } catch {
            return;
        }
        if (wanted !== this.#asked || !reply.profile) return;
        this.#shown = wanted;
        this.#diagram.replaceChildren(polarDiagram(reply.profile));
        const {summary = {}, tilt_factor = 1} = reply.profile;
        this.#tilt_factor = tilt_factor;
        this.#facts.replaceChildren(...factsOf(summary).flatMap(([what, figure]) => [h("dt", {}, what), h("dd", {}, figure)]),
            h("dt", {title: "Flux times multiplier and level"}, "Flux now"), this.#output);
        this.#notes.replaceChildren(...(summary.diagnostics ?? []).map((text) => h("li", {}, text)));
        this.#notes.hidden = this.#notes.childElementCount === 0;
        this.update();
        setText(this.#figures, `Peak ${formatLarge(reply.profile.max_cd)} cd · ${formatLarge(reply.profile.flux_lm)} lm`);
    }

    #clear() {
        this.#error.hidden = true;
        this.#warnings.hidden = true;
    }

    #acceptDrops() {
        const stop = (event) => {
            event.preventDefault();
            this.#zone.classList.toggle("over", event.type === "dragover");
        };
        for (const type of ["dragover", "dragleave", "drop"]) this.#zone.addEventListener(type, stop);
        this.#zone.addEventListener("drop", (event) => this.#take(event.dataTransfer.files[0]));
    }

    async #take(file) {
        const name = this.#name;
        if (!file || !name) return;
        this.#clear();
        const upload = ++this.#uploads;
        this.#button.disabled = true;
        const result = await giveProfile(this.#connection, [{name}], file);
        this.#button.disabled = false;
        this.#input.value = "";    // the same file again is a new choice
        if (upload !== this.#uploads || name !== this.#name) return;
        if (result.code !== "ok") this.#refuse(file.name, result);
        else {
            this.#asked = "";    // also where name, peak and flux are those of the old profile
            this.#warn(result.warnings ?? []);
            this.update();
        }
    }

    #refuse(file, result) {
        const {code, field, value} = result;
        this.#error.replaceChildren(h("strong", {}, `${file} was not taken`), h("p", {}, sentence(result)),
            h("p", {class: "faint"}, [code, field, value].filter(Boolean).join(" · ")));
        this.#error.hidden = false;
    }

    #warn(warnings) {
        this.#warnings.replaceChildren(...warnings.map((text) => h("li", {}, text)));
        this.#warnings.hidden = warnings.length === 0;
    }
}
