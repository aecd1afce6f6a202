// The library of photometry: a panel of the drawer with a row for each profile that lights can have. Rows are found by
// text, flux and beam angle; dragged onto a light in the picture or the list, or given to the selected lights by "Use".

import {h, setText, formatNumber, formatLarge, tableHead} from "./dom.js";
import {pageRole} from "./control.js";
import {setAll} from "./many.js";
import {beamText} from "./profile.js";
import {smallPolar} from "./polar.js";

const kRows = 100;
const kAgainMs = 700;          // while the server reads its folders
const kType = "application/x-gonio-profile";
const kDegree = Math.PI / 180;

export class LibraryPanel {
    #store; #connection; #node;
    #head = h("p", {class: "faint", role: "status"});
    #rows = h("tbody");
    #text = h("input", {type: "search", id: "library-text", placeholder: "Name, maker or number", "aria-label": "Search the library", spellcheck: "false"});
    #bounds = {};
    #more = h("button", {type: "button", class: "quiet", onclick: () => this.#ask(this.#found.length)}, "More");
    #found = [];
    #asking = 0; #timer = 0;

    constructor(store, connection, node, handles, screen) {
        this.#store = store;
        this.#connection = connection;
        this.#node = node;
        const bound = (name, label, unit) => {
            this.#bounds[name] = h("input", {type: "number", min: 0, step: "any", "aria-label": `${label}, ${unit}`, placeholder: unit});
            return this.#bounds[name];
        };
        const again = h("button", {type: "button", class: "quiet", title: "The server reads its folders again",
            onclick: () => this.#ask(0, {read_again: true})}, "Read again");
        const form = h("form", {class: "row wrap"}, this.#text,
            h("span", {class: "meter-field"}, h("span", {class: "faint"}, "Flux"), bound("min_flux_lm", "Least flux", "lm"), "–", bound("max_flux_lm", "Greatest flux", "lm")),
            h("span", {class: "meter-field"}, h("span", {class: "faint"}, "Beam"), bound("min_beam_rad", "Least beam angle", "°"), "–", bound("max_beam_rad", "Greatest beam angle", "°")), again);
        form.addEventListener("input", () => this.#soon());
        form.addEventListener("submit", (event) => { event.preventDefault(); this.#ask(0); });
        node.append(h("header", {}, h("h2", {}, "Library"), this.#head), form,
            h("div", {class: "scroll", tabindex: "0"}, h("table", {},
                tableHead(["~Curve", "~Use", "Profile", "Flux#", "Peak#", "Beam#", "Field#", "Power#", "Opening"]), this.#rows), this.#more));
        connection.addEventListener("ready", () => { if (this.open) this.#ask(0); });
        this.#takeDrops(handles, screen);
    }

    get open() { return !this.#node.hidden; }

    toggle(open) {
        clearTimeout(this.#timer);
        if (open) this.#ask(0);
    }

    #soon() {
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => this.#ask(0), 150);
    }

    // from: rows that are shown already; 0 begins anew.
    async #ask(from, more = {}) {
        clearTimeout(this.#timer);
        const asking = ++this.#asking, query = {text: this.#text.value, offset: from, count: kRows, curves: true, ...more};
        for (const [name, input] of Object.entries(this.#bounds)) {
            const value = Number(input.value);
            if (input.value.trim() !== "" && Number.isFinite(value)) query[name] = name.endsWith("rad") ? value * kDegree : value;
        }
        let answer;
        try {
            answer = await this.#connection.request({library: query});
        } catch {
            return setText(this.#head, "Not connected");
        }
        if (asking !== this.#asking) return;
        if (!answer.library) return setText(this.#head, answer.result?.message ?? "No answer");
        const {rows = [], found = 0, total = 0, reading, warnings = []} = answer.library;
        this.#found = [...this.#found.slice(0, from), ...rows];
        setText(this.#head, [`${found} of ${total}`, reading ? "folders are being read…" : "", ...warnings].filter(Boolean).join(" · "));
        this.#more.hidden = this.#found.length >= found;
        this.#show();
        if (reading && this.open) this.#timer = setTimeout(() => this.#ask(0), kAgainMs);
    }

    // A table under the pointer is not rebuilt while nothing changed, so that its buttons can be pressed.
    #show() {
        const signature = JSON.stringify(this.#found.map(({name, source, error, summary}) => [name, source, error, summary?.max_cd]));
        if (this.#rows.dataset.signature === signature) return;
        this.#rows.dataset.signature = signature;
        this.#rows.replaceChildren(...this.#found.map((row) => this.#row(row)));
    }

    #row({name, source, summary, error, curve}) {
        if (!summary) {
            return h("tr", {"data-profile": name, class: "bad"}, h("td"), h("td"), h("td", {class: "wrapped"}, name, h("span", {class: "faint"}, ` ${source}`)), h("td", {colspan: 6, class: "wrapped"}, `Not usable: ${error}`));
        }
        const {flux_lm, max_cd, beam_rad, widest_beam_rad, field_rad, widest_field_rad, input_watts, opening, length_m, width_m, height_m,
            description, product, diagnostics = []} = summary;
        const size = opening === "point" ? "" : ` ${[length_m, width_m, height_m].map((x) => formatNumber(x, 2)).join(" × ")} m`;
        const figure = (text) => h("td", {class: "figure"}, text);
        const use = h("button", {type: "button", class: "quiet", title: `Gives ${name} to the selected lights`, "aria-label": `Use ${name}`,
            onclick: () => this.#give(name, this.#store.chosen)}, "Use");
        const row = h("tr", {"data-profile": name, draggable: "true"}, h("td", {}, smallPolar(curve)), h("td", {}, use),
            h("td", {class: "wrapped"}, product || name, h("span", {class: "faint told", title: description}, [product && name, source, description !== product && description].filter(Boolean).join(" · ")),
                diagnostics.length ? h("span", {class: "warn", title: diagnostics.join("\n"), tabindex: "0"}, ` ${diagnostics.length} ${diagnostics.length === 1 ? "note" : "notes"}`) : null),
            figure(`${formatLarge(flux_lm)} lm`), figure(`${formatLarge(max_cd)} cd`), figure(beamText(beam_rad, widest_beam_rad)), figure(beamText(field_rad, widest_field_rad)),
            figure(input_watts > 0 ? `${formatLarge(input_watts)} W` : "–"), h("td", {class: "wrapped small"}, `${opening.replaceAll("_", " ")}${size}`));
        row.addEventListener("dragstart", (event) => {
            event.dataTransfer.setData(kType, name);
            event.dataTransfer.effectAllowed = "copy";
        });
        return row;
    }

    #give(name, lights) {
        const fitting = lights.filter((light) => !light.sun);
        if (pageRole !== "viewer" && fitting.length) this.#connection.command(setAll(fitting, {profile: {name}}));
    }

    // Dropped on a light: of the picture, or of the list. One of the selected lights stands for all of them.
    #takeDrops(handles, screen) {
        const targets = [[screen, (event) => handles.lightUnder(event)], [document.querySelector("#lights"), (event) => event.target.closest("li")?.dataset.name]];
        for (const [element, find] of targets) {
            element.addEventListener("dragover", (event) => {
                if (event.dataTransfer?.types.includes(kType) && find(event) !== undefined) event.preventDefault();
            });
            element.addEventListener("drop", (event) => {
                const name = event.dataTransfer?.getData(kType), light = this.#store.light(find(event));
                if (!name || !light) return;
                event.preventDefault();
                this.#give(name, this.#store.isChosen(light.name) ? this.#store.chosen : [light]);
            });
        }
    }
}
