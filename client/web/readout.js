// What lies under the pointer: point, lux and cd/m², which the server tells (`pick`); while a light is aimed also how far
// the point is from it.

import {h, setText, formatNumber} from "./dom.js";
import {formatLux} from "./meter.js";
import {length, sub} from "./projection.js";

const kPickEveryMs = 100;     // questions about what lies under the pointer

export class Readout {
    node = h("output", {id: "under", hidden: true, role: "status"});
    pick = null;              // the last one that is shown
    place = null;             // where that is

    #connection; #aimed; #changed;
    #asked = false; #next = null; #timer = 0;

    // aimed(): the lights that are being aimed; changed(): something else is under the pointer.
    constructor(connection, aimed, changed) {
        this.#connection = connection;
        this.#aimed = aimed;
        this.#changed = changed;
    }

    // Result: what lies at the place; null where the connection has ended.
    async at({x, y}) {
        try {
            return (await this.#connection.request({pick: {x, y}})).pick ?? null;
        } catch {
            return null;
        }
    }

    // place: what lies there is asked; null: nothing is shown any more. One question at a time, the newest next.
    ask(place) {
        this.#next = place;
        if (!place) return this.#show(null);
        if (this.#asked || this.#timer) return;
        this.#timer = setTimeout(async () => {
            this.#timer = 0;
            const now = this.#next;
            if (!now) return;
            this.#asked = true;
            const pick = await this.at(now);
            this.#asked = false;
            if (!this.#next) return;
            this.#show(pick, now);
            if (this.#next !== now) this.ask(this.#next);
        }, kPickEveryMs);
    }

    // The light may have changed: what lies under a pointer that rests is asked anew.
    again() {
        if (this.#next) this.ask({...this.#next});
    }

    #show(pick, place = null) {
        this.place = place;
        this.node.hidden = !pick?.hit;
        this.pick = pick?.hit ? pick : null;
        this.#changed();
        if (!this.pick) return;
        const {reading, luminance_nit, point_m, normal, node, distance_m} = pick;
        const vector = (v, digits) => v.map((x) => formatNumber(x, digits)).join(" ");
        const aimed = this.#aimed(), from = aimed.length === 1 ? `${formatNumber(length(sub(point_m, aimed[0].position)), 2)} m from ${aimed[0].name} · ` : "";
        const light = reading ? `${formatLux(reading.total_lx)} · ${formatNumber(luminance_nit, luminance_nit < 10 ? 3 : 1)} cd/m²` : "no lux: this technique has no sun";
        setText(this.node, `${from}${light} · `
            + `${node || "surface"} at ${vector(point_m, 2)} m · normal ${vector(normal, 2)} · ${formatNumber(distance_m, 2)} m away`);
    }
}
