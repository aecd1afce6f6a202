// The consoles panel: who sends sACN, Art-Net and OSC, what arrives, who wins. Asked for once a second while it is open.

import {h, setText, formatNumber} from "./dom.js";

const kPollMs = 1000;
const kShownLevels = 24;    // the first slots; the others are in the cell's title

export class ConsolesPanel {
    #connection; #node; #head; #rows; #hint;
    #timer = 0;
    #open = false;

    constructor(connection, node) {
        this.#connection = connection;
        this.#node = node;
        this.#head = h("p", {class: "faint"});
        this.#hint = h("p", {class: "hint"});
        this.#rows = h("tbody");
        const column = (text, figure) => h("th", {scope: "col", class: figure ? "figure" : null}, text);
        node.append(h("header", {}, h("h2", {}, "Consoles"), this.#head),
            h("div", {class: "scroll", tabindex: "0"}, this.#hint, h("table", {}, h("thead", {}, h("tr", {}, column("From"),
                column("Universe", true), column("Name"), column("Address"), column("State"), column("Priority", true),
                column("Rate /s", true), column("Lost", true), column("Order", true), column("Wins", true), column("Levels"))),
            this.#rows)));
    }

    get open() { return this.#open; }

    toggle() {
        this.#open = !this.#open;
        this.#node.hidden = !this.#open;
        clearTimeout(this.#timer);
        if (this.#open) this.#poll();
    }

    async #poll() {
        try {
            const {sources} = document.hidden ? {} : await this.#connection.request({sources: {}});
            if (sources && this.#open) this.#show(sources);
        } catch {
            setText(this.#head, "Not connected");
        }
        clearTimeout(this.#timer);
        if (this.#open) this.#timer = setTimeout(() => this.#poll(), kPollMs);
    }

    #show({endpoints = [], sources = [], discovered = []}) {
        setText(this.#head, endpoints.length ? endpoints.map((one) => `${one.protocol} on ${one.address}: ${one.packets} packets` +
            (one.bad_packets ? `, ${one.bad_packets} bad` : "") + (one.kernel_drops ? `, ${one.kernel_drops} dropped` : "")).join(" · ")
            : "None is listened to");
        const hints = endpoints.filter((one) => one.last_error).map((one) => `${one.protocol}: ${one.last_error}`);
        for (const one of discovered) hints.push(`${one.name} at ${one.address} says it sends universes ${one.universes.join(", ")}`);
        if (!endpoints.length) hints.push("Start goniod with --sacn, --artnet or --osc to listen to consoles.");
        else if (!sources.length) hints.push("Nothing arrives yet.");
        setText(this.#hint, hints.join(" · "));
        this.#hint.hidden = hints.length === 0;
        this.#rows.replaceChildren(...sources.map((row) => h("tr", {"data-state": {live: "clean", subscribed: "clean", waiting: "ran"}[row.state] ?? "gone"},
            h("td", {}, row.protocol), h("td", {class: "figure"}, row.protocol === "osc" ? "" : String(row.universe)),
            h("td", {}, row.name), h("td", {}, row.address), h("td", {}, h("i"), row.state),
            h("td", {class: "figure"}, row.protocol !== "sacn" ? "" : row.slot_priorities ? "per slot" : String(row.priority)),
            h("td", {class: "figure"}, formatNumber(row.rate_hz, 1)), h("td", {class: "figure"}, String(row.lost)),
            h("td", {class: "figure"}, String(row.out_of_order)), h("td", {class: "figure"}, String(row.winning_slots || "")),
            h("td", {title: (row.levels ?? []).join(" ")}, (row.levels ?? []).slice(0, kShownLevels).join(" ")))));
    }
}
