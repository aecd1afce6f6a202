// The renderer's steps: what the newest change made run, and what that cost. Asked for only while the panel is open, because
// asking renders, and once per revision: of each the server keeps the frame that shows the cost of the change.

import {h, setText, formatNumber} from "./dom.js";
import {PolledPanel} from "./panel.js";

const kPollMs = 250;

export class ReportPanel extends PolledPanel {
    #shownRev = 0;

    constructor(store, connection, node) {
        super(node, {title: "What the renderer did for the newest picture", period_ms: kPollMs,
            columns: ["Step", "Light", "State", "Faces#", "Draws#", "CPU ms#", "GPU ms#"],
            poll: async () => {
                const rev = store.state?.scene_rev ?? 0;
                if (rev === this.#shownRev) return;
                const {report} = await connection.request({report: {rev}});
                if (report && this.open) this.#show(report);
            }});
        connection.addEventListener("ready", () => { this.#shownRev = 0; });
    }

    #show({scene_rev, frame_ms, settled, passes = []}) {
        this.#shownRev = scene_rev;
        const ran = passes.filter((pass) => pass.state === "ran").length;
        setText(this.head, `${formatNumber(frame_ms, 2)} ms · ${ran} of ${passes.length} steps ran` +
            (settled ? " · settled" : ""));
        this.rows.replaceChildren(...passes.map((pass) => h("tr", {"data-state": pass.state},
            h("td", {}, pass.name), h("td", {}, pass.light ?? ""), h("td", {}, h("i"), pass.state),
            h("td", {class: "figure"}, String(pass.faces || "")), h("td", {class: "figure"}, String(pass.draws || "")),
            ...[pass.cpu_ms, pass.gpu_ms].map((ms) => h("td", {class: "figure"}, ms > 0 ? formatNumber(ms, 2) : "")))));
    }
}
