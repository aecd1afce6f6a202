// The tool "Grids": calculation grids and observers of the show, what they read, and the lux report.

import {h, setText, formatNumber, onPageKey} from "./dom.js";
import {plainName, saveFile} from "./capture.js";
import {bytesOf} from "./connection.js";
import {pageRole} from "./control.js";
import {GridView, rectangleOf} from "./grid_view.js";
import {formatProgress} from "./meter.js";
import {sentence} from "./toast.js";

const kQuantities = [["plane", "On the plane"], ["horizontal", "Horizontal"], ["vertical", "Vertical"], ["camera", "Towards the camera"],
    ["cylindrical", "Cylindrical"], ["cylindrical-4", "Cylindrical, 4 readings"], ["semi-cylindrical", "Semi-cylindrical"]];
const kQualities = [["interactive", "Live"], ["reference", "Reference"]];
const kSpacings = [["nearest", "EN 12464-1, nearest"], ["up", "EN 12464-1, rounded up"], ["count", "Own numbers"]];
const kDirected = ["vertical", "semi-cylindrical"];
const kReportNoises = [["0.2", "20 %: a draft"], ["0.05", "5 %"], ["0.02", "2 %"]];
const kReferenceNoise = 0.01;

const options = (list) => list.map(([value, text]) => h("option", {value}, text));
const round = (x) => Number(x.toFixed(4));
const field = (label, ...inputs) => h("span", {class: "meter-field"}, h("span", {class: "faint"}, label), ...inputs);
const number = (label, value, more = {}) => h("input", {type: "number", step: "any", value, "aria-label": label, ...more});
const vector = (name, values) => ["x", "y", "z"].map((letter, i) => number(`${name} ${letter}`, values[i]));
const numbersOf = (inputs) => inputs.map((input) => Number(input.value) || 0);
const fill = (inputs, values) => inputs.forEach((input, i) => { input.value = round(values[i] ?? 0); });

// "✓ pass Em 520 lx, required at least 500": never by colour alone.
function checkText({name, required, reached, passed = false}) {
    const digits = name === "U0" ? 2 : name === "UGR" ? 1 : 0;
    return `${passed ? "✓ pass" : "✗ FAIL"} ${name} ${formatNumber(reached ?? 0, digits)}, required ${name === "UGR" ? "at most" : "at least"} ${formatNumber(required ?? 0, name === "U0" ? 2 : 0)}`;
}

// Result: how many points do not count, and why; a sentence each.
function leftOutTexts(leftOut) {
    return [["inside", "inside closed bodies"], ["outside", "outside of the room"]]
        .map(([reason, where]) => [leftOut.filter((point) => point.reason === reason).length, where])
        .filter(([points]) => points > 0).map(([points, where]) => `${points} points left out: they lie ${where}`);
}

export class GridPanel {
    #store; #connection; #handles; #view;
    #values = null;                 // of the last reading
    #drawing = null;                // the first corner of a rectangle: {point_m, normal}
    #work = null;                   // the AbortController of what is being computed
    #inputs; #names = {}; #lists = {}; #result; #plan; #ugr; #report; #hint; #buttons = {};

    constructor(store, connection, node, handles, before) {
        this.#store = store;
        this.#connection = connection;
        this.#handles = handles;
        this.#view = new GridView(store, handles, before);
        const viewer = pageRole === "viewer";
        const button = (id, text, title, run, edits = false) => {
            this.#buttons[id] = h("button", {type: "button", id, title, hidden: edits && viewer, onclick: run}, text);
            return this.#buttons[id];
        };
        const list = (id, label, chosen) => {
            this.#lists[id] = h("select", {id, "aria-label": label});
            this.#lists[id].addEventListener("change", chosen);
            return this.#lists[id];
        };
        const name = (id, label) => { this.#names[id] = h("input", {type: "text", id, maxlength: 128, "aria-label": label, placeholder: "name"}); return this.#names[id]; };
        const select = (label, entries, id) => h("select", {"aria-label": label, id}, ...options(entries));
        this.#inputs = {corner: vector("Corner", [0, 0, 0]), u: vector("Edge u", [1, 0, 0]), v: vector("Edge v", [0, 0, -1]), direction: vector("Direction", [0, 0, 1]),
            count: [number("Points along u", 4, {min: 1, step: 1}), number("Points along v", 4, {min: 1, step: 1})],
            above: number("Above the surface", 0), margin: number("Margin", 0, {min: 0}), factor: number("Maintenance factor", 1, {min: 0.01, max: 1}),
            quantity: select("Quantity", kQuantities, "grid-quantity"), spacing: select("Spacing", kSpacings), target: h("select", {"aria-label": "Target", id: "grid-target"}),
            em: number("Own mean, lx", ""), u0: number("Own uniformity", ""), quality: select("Quality", kQualities, "grid-quality"),
            eye: vector("Eye", [0, 1.2, 0]), sight: vector("Line of sight", [0, 0, -1]), limit: number("Greatest UGR", "", {min: 0, max: 40}),
            noise: select("Noise of the report's pictures", kReportNoises, "lux-report-noise"),
            seconds: number("Longest time of each part of the report, seconds", 60, {min: 0.1, max: 86400, id: "lux-report-seconds"})};
        this.#inputs.noise.value = "0.05";
        const i = this.#inputs;
        const direction = field("Direction", ...i.direction), count = field("Points", ...i.count), own = field("Own mean lx, U0", i.em, i.u0);
        const fit = () => {
            direction.hidden = !kDirected.includes(i.quantity.value);
            count.hidden = i.spacing.value !== "count";
            own.hidden = i.target.value !== "own";
        };
        this.#fit = fit;
        for (const input of [i.quantity, i.spacing, i.target]) input.addEventListener("change", fit);
        this.#result = h("div", {id: "grid-result", role: "status"});
        this.#plan = h("img", {id: "grid-plan", alt: "", hidden: true});
        this.#ugr = h("div", {id: "ugr-result", role: "status"});
        this.#report = h("output", {id: "lux-report-result", role: "status"});
        this.#hint = h("p", {class: "hint", id: "grid-hint", role: "status"});
        const form = h("form", {class: "row wrap"}, name("grid-name", "Name of the grid"), field("Corner, m", ...i.corner), field("Edge u, m", ...i.u), field("Edge v, m", ...i.v),
            field("Quantity", i.quantity), direction, field("Spacing", i.spacing), count, field("Margin, m", i.margin), field("Maintenance", i.factor), field("Target", i.target), own,
            h("button", {id: "grid-keep", hidden: viewer, title: "Keeps the grid in the show, under this name"}, "Keep grid"));
        form.addEventListener("submit", (event) => { event.preventDefault(); this.#keep(); });
        const observer = h("form", {class: "row wrap"}, name("observer-name", "Name of the observer"), field("Eye, m", ...i.eye), field("Line of sight", ...i.sight), field("UGR at most", i.limit),
            button("observer-camera", "As the camera", "Eye and line of sight of the camera", () => this.#asCamera(), true), h("button", {id: "observer-keep", hidden: viewer, title: "Keeps the observer in the show"}, "Keep observer"));
        observer.addEventListener("submit", (event) => { event.preventDefault(); this.#keepObserver(); });
        node.append(
            h("div", {class: "row wrap"}, list("grid-list", "Grid", () => this.#chooseGrid()), button("grid-draw", "Draw", "Then click two corners on a surface of the picture", () => this.#draw(), true),
                field("Above it, m", i.above), field("Quality", i.quality), button("grid-read", "Read", "Computes the values of the grid", () => this.#read()),
                button("grid-csv", "CSV", "The values as a table", () => this.#csv()), button("grid-remove", "Remove", "The grid goes from the show", () => this.#remove(), true), this.#hint),
            form, h("div", {class: "grid-values"}, this.#result, this.#plan),
            h("h2", {}, "Glare"),
            h("div", {class: "row wrap"}, list("observer-list", "Observer", () => this.#chooseObserver()), button("ugr-read", "Rate", "The unified glare rating of the observer", () => this.#rate()),
                button("observer-remove", "Remove", "The observer goes from the show", () => this.#removeObserver(), true), this.#ugr),
            observer,
            h("div", {class: "row wrap lux-report"}, button("lux-report", "Lux report", "A page that prints: pictures, grids, luminaires, glare. Computed in reference quality", () => this.#luxReport()),
                field("Noise", i.noise), field("At most, s", i.seconds), button("lux-report-cancel", "Cancel", "The work is given up", () => this.#work?.abort()), this.#report));
        this.#buttons["lux-report-cancel"].hidden = true;
        connection.addEventListener("ready", () => this.#askTargets());
        store.addEventListener("update", () => this.update());
        onPageKey((event) => { if (event.key === "Escape" && (this.#drawing || this.#handles.onPlace === this.#place)) this.#endDrawing(); });
        fit();
    }

    #fit = () => {};
    #open = false;
    toggle(open) {
        this.#open = open;
        if (!open) this.#endDrawing();
        this.#show();
    }

    get #grids() { return this.#store.state?.grids?.grids ?? []; }
    get #observers() { return this.#store.state?.observers?.observers ?? []; }
    get #grid() { return this.#grids.find(({name}) => name === this.#lists["grid-list"].value); }
    get #observer() { return this.#observers.find(({name}) => name === this.#lists["observer-list"].value); }

    update() {
        const offer = (list, names, none) => {
            if (list.dataset.names === JSON.stringify(names)) return;
            list.dataset.names = JSON.stringify(names);
            const chosen = list.value;
            list.replaceChildren(...(names.length ? names.map((each) => h("option", {value: each}, each)) : [h("option", {value: ""}, none)]));
            if (names.includes(chosen)) list.value = chosen;
            else if (names.length) list.dispatchEvent(new Event("change"));    // the fields are those of what is shown
        };
        offer(this.#lists["grid-list"], this.#grids.map(({name}) => name), "no grid yet");
        offer(this.#lists["observer-list"], this.#observers.map(({name}) => name), "no observer yet");
        for (const id of ["grid-read", "grid-remove"]) this.#buttons[id].disabled = !this.#grid || Boolean(this.#work);
        for (const id of ["ugr-read", "observer-remove"]) this.#buttons[id].disabled = !this.#observer || Boolean(this.#work);
        this.#buttons["lux-report"].disabled = Boolean(this.#work);
        this.#buttons["grid-csv"].disabled = !this.#values;
        this.#show();
    }

    #show() {
        const values = this.#values?.grid.name === this.#grid?.name ? this.#values : null;
        if (this.#open) this.#view.show({grid: this.#grid ?? null, values, corner: this.#drawing?.point_m ?? null});
        else this.#view.show({});
    }

    async #askTargets() {
        const rows = (await this.#connection.request({targets: {}}).catch(() => ({}))).targets?.targets ?? [];
        const text = ({task, name, em_lx, ez_lx, ugr, u0_ratio}) => `${task || name}: ` + [em_lx && `${em_lx} lx`, u0_ratio && `U0 ${u0_ratio}`, ez_lx && `Ez ${ez_lx} lx`, ugr && `UGR ${ugr}`].filter(Boolean).join(", ");
        const row = this.#grid?.target?.name, chosen = rows.some(({name}) => name === row) ? row : this.#inputs.target.value || "";
        this.#inputs.target.replaceChildren(...options([["", "None"], ["own", "Own values"], ...rows.map((row) => [row.name, text(row)])]));
        this.#inputs.target.value = chosen;
        this.#fit();
    }

    // Two clicks on the picture. The second one's own surface does not matter: its ray's point is taken.
    #draw() {
        if (this.#handles.onPlace === this.#place) return this.#endDrawing();
        this.#handles.onPlace = this.#place;
        this.#handles.cross("adding", true);
        setText(this.#hint, "Click a corner of the grid on a surface; Esc ends");
    }
    #place = async (place) => {
        const pick = await this.#handles.pickAt(place);
        if (!pick?.hit) return setText(this.#hint, "There is no surface; click another place, Esc ends");
        if (!this.#drawing) {
            this.#drawing = pick;
            setText(this.#hint, "Click the opposite corner");
            return this.#show();
        }
        const {corner_m, u_m, v_m} = rectangleOf(this.#drawing.point_m, pick.point_m, this.#drawing.normal, Number(this.#inputs.above.value) || 0);
        this.#endDrawing();
        fill(this.#inputs.corner, corner_m);
        fill(this.#inputs.u, u_m);
        fill(this.#inputs.v, v_m);
        let free = 1;
        while (this.#grids.some(({name}) => name === `grid ${free}`)) ++free;
        this.#names["grid-name"].value = `grid ${free}`;
        await this.#keep();
    };
    #endDrawing() {
        this.#drawing = null;
        if (this.#handles.onPlace === this.#place) this.#handles.onPlace = null;
        this.#handles.cross("adding", false);
        setText(this.#hint, "");
        this.#show();
    }

    #formGrid() {
        const i = this.#inputs, grid = {name: this.#names["grid-name"].value.trim(), corner_m: numbersOf(i.corner), u_m: numbersOf(i.u), v_m: numbersOf(i.v),
            quantity: i.quantity.value, margin_m: Number(i.margin.value) || 0, maintenance_factor: Number(i.factor.value)};
        if (kDirected.includes(grid.quantity)) grid.direction = numbersOf(i.direction);
        if (i.spacing.value === "count") grid.count = numbersOf(i.count);
        else grid.spacing = i.spacing.value;
        const target = i.target.value === "own" ? Object.fromEntries([["em_lx", i.em.value], ["u0_ratio", i.u0.value]].filter(([, value]) => value !== "").map(([key, value]) => [key, Number(value)]))
            : i.target.value ? {name: i.target.value} : null;
        return target ? {...grid, target} : grid;
    }
    async #keep() {
        const grid = this.#formGrid();
        if ((await this.#connection.command({set_grid: {grid}}))?.code !== "ok") return;
        this.#values = null;
        this.#choose("grid-list", grid.name);
    }
    // The list may not know the name yet: the change is told beside the answer.
    #choose(id, name) {
        const list = this.#lists[id];
        if (![...list.options].some(({value}) => value === name)) list.append(h("option", {value: name}, name));
        list.value = name;
        this.update();
    }
    async #remove() { await this.#connection.command({remove_grid: {name: this.#grid.name}}); }

    #chooseGrid() {
        const grid = this.#grid, i = this.#inputs;
        if (!grid) return;
        this.#names["grid-name"].value = grid.name;
        for (const [inputs, values] of [[i.corner, grid.corner_m], [i.u, grid.u_m], [i.v, grid.v_m]]) fill(inputs, values);
        if (grid.direction?.length) fill(i.direction, grid.direction);
        i.quantity.value = grid.quantity;
        i.spacing.value = grid.count?.length ? "count" : grid.spacing;
        if (grid.count?.length) fill(i.count, grid.count);
        i.margin.value = grid.margin_m ?? 0;
        i.factor.value = grid.maintenance_factor ?? 1;
        const row = grid.target?.name ?? "";
        i.target.value = [...i.target.options].some(({value}) => value === row) ? row : grid.target ? "own" : "";
        i.em.value = grid.target?.em_lx ?? "";
        i.u0.value = grid.target?.u0_ratio ?? "";
        this.#fit();
        this.update();
    }

    // One long work at a time. output: where its progress and its refusal are told.
    async #compute(message, kind, output, title) {
        output.classList.remove("bad");
        output.replaceChildren(title);
        this.#work = new AbortController();
        this.#buttons["lux-report-cancel"].hidden = false;
        this.update();
        try {
            const answer = await this.#connection.request(message,
                {signal: this.#work.signal, progress: (progress) => output.replaceChildren(formatProgress(progress))});
            if (answer.result?.code === "cancelled") throw new Error("Cancelled");
            if (!answer[kind]) throw new Error(sentence(answer.result ?? {code: "no answer"}));
            output.replaceChildren();
            return answer[kind];
        } catch (error) {
            output.replaceChildren(error.message);
            output.classList.add("bad");
            return null;
        } finally {
            this.#work = null;
            this.#buttons["lux-report-cancel"].hidden = true;
            this.update();
        }
    }
    #settings() { return this.#inputs.quality.value === "reference" ? {quality: "reference", noise_ratio: kReferenceNoise} : {quality: "interactive"}; }

    async #read() {
        this.#plan.hidden = true;
        const values = await this.#compute({grid: {name: this.#grid.name, plan: true, ...this.#settings()}}, "grid_values", this.#result, "Reading…");
        if (!values) return;
        this.#values = values;
        const {grid, count, cell_m, mean_lx, min_lx, max_lx, uniformity_ratio = 0, diversity_ratio = 0, checks = [], left_out = [], warnings = [], quality, bounces, error_lx} = values;
        const fact = (name, text) => [h("dt", {}, name), h("dd", {}, text)];
        this.#result.append(
            h("p", {class: "grid-mean"}, `Mean ${formatNumber(mean_lx, 1)} lx · min ${formatNumber(min_lx, 1)} · max ${formatNumber(max_lx, 1)} · U0 ${formatNumber(uniformity_ratio, 2)} · Ud ${formatNumber(diversity_ratio, 2)}`),
            ...leftOutTexts(left_out).map((text) => h("p", {class: "hint"}, text)), ...warnings.map((text) => h("p", {class: "check fail"}, text)),
            ...checks.map((check) => h("p", {class: check.passed ? "check" : "check fail"}, checkText(check))),
            h("dl", {class: "facts"}, ...fact("Points", `${count[0]} × ${count[1]}, cells ${formatNumber(cell_m[0], 3)} × ${formatNumber(cell_m[1], 3)} m`),
                ...fact("Computed", `${quality}, bounces ${bounces}, ${error_lx === undefined ? "error not estimated" : `standard error ${formatNumber(error_lx, 2)} lx`}`),
                ...fact("Maintenance", `${grid.maintenance_factor}`), ...(grid.target?.edition ? fact("Target", `${grid.target.task}, ${grid.target.edition}`) : [])));
        URL.revokeObjectURL(this.#plan.src);
        this.#plan.src = URL.createObjectURL(new Blob([values.plan_svg], {type: "image/svg+xml"}));
        this.#plan.alt = `Plan of ${grid.name} with its values in lux`;
        this.#plan.hidden = false;
        this.update();
    }

    #csv() {
        const {grid, count, points_m, values_lx, left_out = []} = this.#values;
        const reasons = new Map(left_out.map(({point = 0, reason}) => [point, reason]));
        const lines = values_lx.map((lx, k) => [k % count[0], Math.floor(k / count[0]), ...points_m.slice(3 * k, 3 * k + 3), lx, reasons.get(k) ?? ""].join(","));
        saveFile(new Blob(["i,j,x_m,y_m,z_m,lx,left_out\n", lines.join("\n"), "\n"], {type: "text/csv"}), `${grid.name}.csv`);
    }

    #asCamera() {
        const {eye, target} = this.#store.state.camera;
        fill(this.#inputs.eye, eye);
        fill(this.#inputs.sight, [target[0] - eye[0], 0, target[2] - eye[2]]);
    }
    async #keepObserver() {
        const i = this.#inputs, observer = {name: this.#names["observer-name"].value.trim(), eye_m: numbersOf(i.eye), direction: numbersOf(i.sight)};
        if (i.limit.value !== "") observer.target = {ugr: Number(i.limit.value)};
        if ((await this.#connection.command({set_observer: {observer}}))?.code === "ok") this.#choose("observer-list", observer.name);
    }
    #chooseObserver() {
        const {name, eye_m, direction, target} = this.#observer ?? {};
        if (!name) return;
        this.#names["observer-name"].value = name;
        fill(this.#inputs.eye, eye_m);
        fill(this.#inputs.sight, direction);
        this.#inputs.limit.value = target?.ugr ?? "";
        this.update();
    }
    async #removeObserver() { await this.#connection.command({remove_observer: {name: this.#observer.name}}); }

    async #rate() {
        const ugr = await this.#compute({ugr: {observer: this.#observer.name, ...this.#settings()}}, "ugr", this.#ugr, "Rating…");
        if (!ugr) return;
        const counted = (ugr.sources ?? []).filter(({left_out}) => !left_out).length;
        this.#ugr.append(h("p", {}, ugr.ugr === undefined ? "No UGR: nothing glares, or no light is indirect" : `UGR ${formatNumber(ugr.ugr, 1)}`),
            ...(ugr.checks ?? []).map((check) => h("p", {class: check.passed ? "check" : "check fail"}, checkText(check))),
            h("p", {class: "hint"}, `${counted} of ${(ugr.sources ?? []).length} luminaires glare; background ${formatNumber(ugr.background_nit ?? 0, 1)} cd/m²; ${ugr.quality}, bounces ${ugr.bounces}`),
            ...(ugr.warnings ?? []).map((warning) => h("p", {class: "hint"}, `Note: ${warning}`)));
    }

    async #luxReport() {
        const report = await this.#compute({lux_report: {noise_ratio: Number(this.#inputs.noise.value), max_seconds: Number(this.#inputs.seconds.value) || undefined}}, "lux_report", this.#report, "Computing the report…");
        if (!report) return;
        const {show, scene} = this.#store.state;
        saveFile(new Blob([bytesOf(report.html)], {type: "text/html"}), `lux-report-${plainName(show?.name || scene)}-${report.scene_rev}.html`);
        setText(this.#report, `Saved, of revision ${report.scene_rev}: open it and print it`);
    }
}
