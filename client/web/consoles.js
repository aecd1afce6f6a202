// The consoles panel: who sends sACN, Art-Net and OSC, what arrives, who wins. Asked for once a second while it is open.

import {h, setText, formatNumber} from "./dom.js";
import {PolledPanel} from "./panel.js";

const kPollMs = 1000;
const kShownLevels = 24;    // the first slots; the others are in the cell's title

export class ConsolesPanel extends PolledPanel {
    #hint = h("p", {class: "hint"});

    constructor(connection, node) {
        super(node, {title: "Consoles", period_ms: kPollMs,
            columns: ["From", "Universe#", "Name", "Address", "State", "Priority#", "Rate /s#", "Lost#", "Order#", "Wins#", "Levels"],
            poll: async () => {
                const {sources} = await connection.request({sources: {}});
                if (sources && this.open) this.#show(sources);
            }});
        this.rows.closest(".scroll").prepend(this.#hint);
    }

    #show({endpoints = [], sources = [], discovered = []}) {
        setText(this.head, endpoints.length ? endpoints.map((one) => `${one.protocol} on ${one.address}: ${one.packets} packets` +
            (one.bad_packets ? `, ${one.bad_packets} bad` : "") + (one.kernel_drops ? `, ${one.kernel_drops} dropped` : "")).join(" · ")
            : "None is listened to");
        const hints = endpoints.filter((one) => one.last_error).map((one) => `${one.protocol}: ${one.last_error}`);
        for (const one of discovered) hints.push(`${one.name} at ${one.address} says it sends universes ${one.universes.join(", ")}`);
        if (!endpoints.some((one) => one.protocol !== "box")) hints.push("Start goniod with --sacn, --artnet or --osc to listen to consoles.");
        else if (!sources.length) hints.push("Nothing arrives yet.");
        setText(this.#hint, hints.join(" · "));
        this.#hint.hidden = hints.length === 0;
        this.rows.replaceChildren(...sources.map((row) => h("tr", {"data-state": {live: "clean", subscribed: "clean", waiting: "ran"}[row.state] ?? "gone"},
            h("td", {}, row.protocol), h("td", {class: "figure"}, row.protocol === "osc" ? "" : String(row.universe)),
            h("td", {}, row.name), h("td", {}, row.address), h("td", {}, h("i"), row.state),
            h("td", {class: "figure"}, row.protocol !== "sacn" ? "" : row.slot_priorities ? "per slot" : String(row.priority)),
            h("td", {class: "figure"}, formatNumber(row.rate_hz, 1)), h("td", {class: "figure"}, String(row.lost)),
            h("td", {class: "figure"}, String(row.out_of_order)), h("td", {class: "figure"}, String(row.winning_slots || "")),
            h("td", {title: (row.levels ?? []).join(" ")}, (row.levels ?? []).slice(0, kShownLevels).join(" ")))));
    }
}
