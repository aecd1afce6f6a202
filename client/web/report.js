// The frame report: what the newest change made run, and what that cost. Asked for only while the panel is open, because
// asking renders, and once per revision: of each the server keeps the frame that shows the cost of the change.

import {h, setText, formatNumber} from "./dom.js";

const kPollMs = 250;

export class ReportPanel {
    #store; #connection; #node; #head; #rows;
    #shownRev = 0;
    #timer = 0;
    #open = false;

    constructor(store, connection, node) {
        this.#store = store;
        this.#connection = connection;
        connection.addEventListener("ready", () => { this.#shownRev = 0; });
        this.#node = node;
        this.#head = h("p", {class: "faint"});
        this.#rows = h("tbody");
        const column = (text, figure) => h("th", {scope: "col", class: figure ? "figure" : null}, text);
        node.append(h("header", {}, h("h2", {}, "Frame report"), this.#head),
            h("div", {class: "scroll", tabindex: "0"}, h("table", {}, h("thead", {}, h("tr", {}, column("Pass"), column("Light"),
                column("State"), column("Faces", true), column("Draws", true), column("CPU ms", true),
                column("GPU ms", true))), this.#rows)));
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
            const rev = this.#store.state?.scene_rev ?? 0;
            if (!document.hidden && rev !== this.#shownRev) {
                const {report} = await this.#connection.request({report: {rev}});
                if (report && this.#open) this.#show(report);
            }
        } catch {
            setText(this.#head, "Not connected");
        }
        clearTimeout(this.#timer);
        if (this.#open) this.#timer = setTimeout(() => this.#poll(), kPollMs);
    }

    #show({scene_rev, frame_ms, settled, passes = []}) {
        this.#shownRev = scene_rev;
        const ran = passes.filter((pass) => pass.state === "ran").length;
        setText(this.#head, `Revision ${scene_rev} · ${formatNumber(frame_ms, 2)} ms · ${ran} of ${passes.length} passes ran` +
            (settled ? " · settled" : ""));
        this.#rows.replaceChildren(...passes.map((pass) => h("tr", {"data-state": pass.state},
            h("td", {}, pass.name), h("td", {}, pass.light ?? ""), h("td", {}, h("i"), pass.state),
            h("td", {class: "figure"}, String(pass.faces || "")), h("td", {class: "figure"}, String(pass.draws || "")),
            ...[pass.cpu_ms, pass.gpu_ms].map((ms) => h("td", {class: "figure"}, ms > 0 ? formatNumber(ms, 2) : "")))));
    }
}
