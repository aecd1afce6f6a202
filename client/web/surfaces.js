// The fader boxes panel: which boxes are there, what their controls say and drive; and learning: choose what shall be driven,
// move a control, done. Asked for twice a second while it is open.

import {h, setText, formatNumber} from "./dom.js";
import {PolledPanel} from "./panel.js";
import {properties} from "./properties.js";    // made of the server's table

const kPollMs = 500;
const kLearnSeconds = 30;
const kRanges = {x: [-5, 5], y: [0, 5], z: [-5, 5], distance: [1, 20]};    // m, of those that the table has none for
const driven = (ofScene) => properties.filter((row) => row.of_scene === ofScene && row.values === 1 && !row.by_name).map((row) => row.name);

function drivesText(row) {
    const what = [row.target, row.property, row.preset, row.cue].filter(Boolean).join(" ");
    const manner = [row.mode, row.curve !== "linear" && row.curve, row.takeover, row.page ? `page ${row.page}` : ""].filter(Boolean);
    return [what, ...manner].join(", ");
}

// "*", "vvvv:pppp" or all of the identity, as the server reads it.
const means = (device, identity) => device === "*" || device === identity
    || (device.includes(":") && (identity.startsWith(`${device}:`) || identity.startsWith(`${device}@`)));

export class SurfacesPanel extends PolledPanel {
    #store; #connection;
    #hint = h("p", {class: "hint", role: "status"});
    #target = h("select", {"aria-label": "What shall be driven", id: "learn-target"});
    #property = h("select", {"aria-label": "Which property", id: "learn-property"});
    #learn = h("button", {type: "button", id: "learn", onclick: () => this.#startLearning()}, "Learn");
    #learning = false;

    constructor(store, connection, node) {
        super(node, {title: "Fader boxes", period_ms: kPollMs, columns: ["Box", "Control", "Kind", "Value#", "Drives", "~Forget"],
            poll: async () => {
                const {surfaces} = await connection.request({surfaces: {}});
                if (surfaces && this.open) this.#show(surfaces);
            }});
        this.#store = store;
        this.#connection = connection;
        this.head.after(h("span", {class: "grow"}), this.#target, this.#property, this.#learn);
        this.rows.closest(".scroll").prepend(this.#hint);
        this.#target.addEventListener("change", () => this.#offerProperties());
        store.addEventListener("update", () => { if (this.open) this.#offerTargets(); });
    }

    toggle(open) {
        super.toggle(open);
        if (open) this.#offerTargets();
    }

    #offerTargets() {
        const {lights, groups, presets} = this.#store.state;
        const wanted = [...lights.map(({name}) => [`light ${name}`, name]), ...groups.map(({name}) => [`group ${name}`, `${name} (group)`]),
            ["scene", "Scene"], ["cue", "Cues"], ...(presets?.names ?? []).map((name) => [`preset ${name}`, `Preset ${name}`])];
        const signature = JSON.stringify(wanted);
        if (this.#target.dataset.signature === signature) return;
        const before = this.#target.value || (this.#store.selected ? `${this.#store.selected.kind} ${this.#store.selected.name}` : "");
        this.#target.dataset.signature = signature;
        this.#target.replaceChildren(...wanted.map(([value, text]) => h("option", {value}, text)));
        if (wanted.some(([value]) => value === before)) this.#target.value = before;
        this.#offerProperties();
    }

    #offerProperties() {
        const kind = this.#target.value.split(" ")[0];
        const names = kind === "scene" ? [...driven(true), "page on", "page back"] : kind === "preset" ? ["recall", "save"] : kind === "cue" ? ["go", "back", "stop"] : driven(false);
        const before = this.#property.value;
        this.#property.replaceChildren(...names.map((name) => h("option", {value: name}, name)));
        if (names.includes(before)) this.#property.value = before;
    }

    // The row that the next moved control gets.
    #wish() {
        const [kind, ...rest] = this.#target.value.split(" "), name = rest.join(" "), property = this.#property.value;
        if (kind === "preset") return {property: "preset", preset: name, ...(property === "save" ? {mode: "save"} : {fade_s: 0})};
        if (kind === "cue") return {property: "cue", cue: property};
        if (property.startsWith("page")) return {property: "page", step: property === "page on" ? 1 : -1};
        const range = kRanges[property];
        return {target: kind === "scene" ? "" : name, property, ...(range ? {low: range[0], high: range[1]} : {})};
    }

    async #startLearning() {
        if (this.#learning) return;
        const row = this.#wish();
        this.#learning = true;
        this.#learn.disabled = true;
        setText(this.#learn, "Move a control…");
        try {
            const {learned} = await this.#connection.request({learn: {timeout_s: kLearnSeconds}});
            if (learned?.device) {
                const result = await this.#connection.command({map_control: {row: {...row, device: learned.device, control: learned.control}}});
                setText(this.head, result?.code === "ok" ? `${learned.control} of ${learned.product || learned.device} drives ${drivesText(row)}` : "Not learned");
            } else {
                setText(this.head, `Nothing moved within ${kLearnSeconds} s`);
            }
        } catch {
            setText(this.head, "Not connected");
        }
        this.#learning = false;
        this.#learn.disabled = false;
        setText(this.#learn, "Learn");
        if (this.open) this.refresh();
    }

    #show({devices = [], rows = [], default_rows: defaults = [], warnings = [], page = 1, latency_ms: latency}) {
        const live = devices.filter((device) => device.state === "live");
        const hints = devices.filter((device) => device.error).map((device) => `${device.product || device.device}: ${device.error}`);
        hints.push(...warnings);
        if (!devices.length) hints.push("No fader box is plugged in, or goniod may not use it: docs/faders.md says how.");
        setText(this.#hint, hints.join(" · "));
        this.#hint.hidden = hints.length === 0;
        this.head.title = live.map((device) => `${device.device} by ${device.transport}`).join(", ");
        if (!this.#learning && !/drives|moved/.test(this.head.textContent)) setText(this.head, [live.map((device) => device.product || device.device).join(", "),
            page > 1 ? `page ${page}` : "", latency ? `${formatNumber(latency, 0)} ms to the picture` : ""].filter(Boolean).join(" · "));
        const drawn = [];
        for (const device of live) {
            for (const control of device.controls) {
                const own = rows.filter((row) => row.control === control.name && means(row.device, device.device));
                const given = own.length ? own : defaults.filter((row) => row.control === control.name && means(row.device, device.device));
                if (!given.length && !control.heard) continue;    // what does nothing and was never moved would only fill the page
                const value = !control.heard ? "" : control.kind === "absolute" ? formatNumber(control.value, 4) : String(control.value);
                drawn.push(h("tr", {"data-control": control.name}, h("td", {}, device.product || device.device), h("td", {}, control.name),
                    h("td", {}, control.steps ? `${control.kind}, ${control.steps + 1} steps` : control.kind), h("td", {class: "figure"}, value),
                    h("td", {}, given.map(drivesText).join("; ")), h("td", {}, ...own.map((row) => h("button", {type: "button", class: "quiet",
                        title: "It drives nothing of its own any more", onclick: () => this.#connection.command({map_control: {row, remove: true}})}, "Forget")))));
            }
        }
        // A table under the pointer is not rebuilt while nothing changed, so that its buttons can be pressed.
        const signature = drawn.map((row) => row.textContent).join("\n");
        if (this.rows.dataset.signature === signature) return;
        this.rows.dataset.signature = signature;
        this.rows.replaceChildren(...drawn);
    }
}
