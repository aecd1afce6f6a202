// The patch panel: what drives what, by consoles and fader boxes, with what arrives; and what is wrong with it, in words.
// Rows are added, changed and taken out here. Asked for twice a second while it is open.

import {h, setText, formatNumber} from "./dom.js";
import {PolledPanel} from "./panel.js";
import {pageRole} from "./control.js";
import {properties} from "./properties.js";    // made of the server's table

const kPollMs = 500;
const kSlots = 512;
const kMostShown = 512;    // rows; the others are counted
const kLearnSeconds = 30;
const kToldMs = 5000;      // what was learned stays in the head
const rowOf = (name) => properties.find((row) => row.name === name);

export const footprint = (row) => (rowOf(row.property)?.values ?? 1) * (row.bits === 16 ? 2 : 1);

// The parts of a light that a property sets: of color its red, green and blue.
function partsOf(name) {
    if (name === "aim") return ["pan", "tilt", "roll"];
    const row = rowOf(name);
    if (!row || row.values === 1) return [name];
    return properties.filter((other) => other.field === row.field && other.component >= 0).map((other) => other.name);
}

const kHighest = ["level", "master"];   // of several rows the highest counts, unless they say otherwise
const kMergeWords = {highest: "the highest counts of this and", sum: "it is added to", product: "it is a factor beside"};
const isWrong = (note) => !Object.values(kMergeWords).some((words) => note.startsWith(words));
const kColors = ["red", "green", "blue"];   // one slot may drive all three of a light: an emitter

// rows: of the patch. faders: [{target, property, text}]. Result: {rows, faders}: for each what there is to note, as sentences.
export function faults(rows, faders, {lights, groups}) {
    const names = new Set(lights.map(({name}) => name)), members = new Map(groups.map((group) => [group.name, group.lights]));
    const all = [...rows.map((row, i) => ({...row, text: `row ${i + 1}`})), ...faders];
    const found = all.map(() => []), slots = new Map(), parts = new Map();
    const note = (map, key, i) => map.set(key, [...map.get(key) ?? [], i]);
    all.forEach((row, i) => {
        for (let slot = 0; i < rows.length && slot < footprint(row); ++slot) note(slots, `${row.protocol} ${row.universe} ${row.address + slot}`, i);
        if (row.target && !/^#\d+$/.test(row.target) && !names.has(row.target) && !members.has(row.target)) found[i].push(`no light or group ${row.target}`);
        for (const light of members.get(row.target) ?? [row.target ?? ""])
            for (const part of partsOf(row.property)) note(parts, JSON.stringify([light, part]), i);
    });
    const tell = (map, words) => {
        const pairs = new Map();    // row -> the others
        for (const together of map.values()) {
            const different = new Set(together), first = all[together[0]];
            const emitter = map === slots && together.every((i) => kColors.includes(all[i].property) && all[i].target === first.target);
            if (different.size > 1 && !emitter) for (const i of different) pairs.set(i, new Set([...pairs.get(i) ?? [], ...different]));
        }
        for (const [i, others] of pairs) {
            const list = [...others].filter((other) => other !== i).slice(0, 4).map((other) => all[other].text).join(", ");
            const merge = map === parts && i < rows.length ? kMergeWords[all[i].merge || (kHighest.includes(all[i].property) && "highest")] : undefined;
            found[i].push(`${merge ?? words} ${list}`);
        }
    };
    tell(slots, "same slots as");
    tell(parts, "same property as");
    return {rows: found.slice(0, rows.length), faders: found.slice(rows.length)};
}

// What a universe's senders say now: of those of the highest priority the highest value, slot by slot; null: nobody.
export function levelsOf(sources, protocol, universe) {
    const live = sources.filter((one) => one.protocol === protocol && one.universe === universe && one.state === "live" && !one.preview);
    if (!live.length) return null;
    const most = Math.max(...live.map((one) => one.priority ?? 0));
    const levels = new Array(kSlots).fill(0);
    for (const one of live) if ((one.priority ?? 0) === most) (one.levels ?? []).forEach((level, i) => { levels[i] = Math.max(levels[i], level); });
    return levels;
}

function levelText(row, levels) {
    if (!levels) return "no sender";
    const bytes = row.bits === 16 ? 2 : 1, property = rowOf(row.property);
    const low = row.low ?? property.low, high = row.high ?? property.high, texts = [];
    for (let at = row.address - 1, i = 0; i < property.values; ++i, at += bytes) {
        const raw = bytes === 2 ? levels[at] * 256 + levels[at + 1] : levels[at];
        const value = (low + (high - low) * raw / (bytes === 2 ? 65535 : 255)) / property.unit;
        texts.push(property.by_name ? `${raw} = ${row.profiles?.[Math.floor(raw * row.profiles.length / (bytes === 2 ? 65536 : 256))] || "none"}` : `${raw} = ${formatNumber(value, Math.abs(value) < 10 ? 2 : 0)}${property.unit_name && ` ${property.unit_name}`}`);
    }
    return texts.join(", ");
}

// Result: the names of "none, L201": "" for none.
const readNames = (text) => text.split(",").map((name) => name.trim()).filter(Boolean).map((name) => (name === "none" ? "" : name));

const means = (device, identity) => device === "*" || device === identity
    || (device.includes(":") && (identity.startsWith(`${device}:`) || identity.startsWith(`${device}@`)));

// Every control that drives something, with where it stands.
function fadersOf({devices = [], rows = [], default_rows: defaults = []}) {
    const found = [];
    for (const device of devices.filter((one) => one.state === "live")) {
        for (const control of device.controls ?? []) {
            const of = (list) => list.filter((row) => row.control === control.name && means(row.device, device.device));
            const own = of(rows);
            for (const row of own.length ? own : of(defaults))
                if (row.property !== "page" && row.property !== "preset")
                    found.push({...row, own: own.length > 0, row, box: device.product || device.device, text: `${device.product || device.device} ${control.name}`,
                        at: !control.heard ? "not moved yet" : control.kind === "absolute" ? `${Math.round(100 * control.value)} %` : String(control.value)});
        }
    }
    return found;
}

export class PatchPanel extends PolledPanel {
    #store; #connection;
    #hint = h("p", {class: "hint", role: "status"});
    #form; #fields; #submit; #cancel; #learn; #each;
    #edited = -1;       // the row that the form changes; -1: it adds one
    #patch = {rows: []};
    #rev = 0;           // of the scene that the patch is of
    #cells = [];        // of levels, by row
    #told_ms = -kToldMs;

    constructor(store, connection, node) {
        super(node, {title: "Patch", period_ms: kPollMs,
            columns: ["~Row", "From", "Universe", "Address", "Target", "Property", "Bits#", "Slots#", "Level now", "Problems", "~Edit, unpatch"],
            poll: async () => {
                // Changes are told in their order with the answers: the patch is that of the revision known when it comes.
                const withRev = async (one) => ({...await connection.request(one), rev: store.state?.scene_rev ?? 0});
                const [{patch, rev}, {sources}, {surfaces}] = await Promise.all([{patch: {}}, {sources: {}}, {surfaces: {}}].map(withRev));
                if (patch && sources && surfaces && this.open) this.#show(rev, patch, sources, surfaces);
            }});
        this.#store = store;
        this.#connection = connection;
        const scroll = this.rows.closest(".scroll");
        if (pageRole !== "viewer") scroll.before(this.#makeForm());
        scroll.prepend(this.#hint);
        store.addEventListener("update", () => { if (this.open) this.#offerTargets(); });
    }

    toggle(open) {
        super.toggle(open);
        if (open) this.#offerTargets();
    }

    #makeForm() {
        const choice = (id, label, values) => h("select", {id, "aria-label": label}, ...values.map(([value, text]) => h("option", {value}, text)));
        const figure = (id, label, value, min, max, step = 1) => h("input", {type: "number", id, "aria-label": label, value, min, max, step, title: label});
        this.#fields = {
            protocol: choice("patch-protocol", "Protocol", [["sacn", "sACN"], ["artnet", "Art-Net"]]),
            universe: figure("patch-universe", "Universe", 1, 0, 63999), address: figure("patch-address", "Address", 1, 1, kSlots),
            target: choice("patch-target", "Target", []), property: choice("patch-property", "Property", []),
            bits: choice("patch-bits", "Bits", [["8", "8 bits"], ["16", "16 bits"]]),
            low: figure("patch-low", "Low", "", undefined, undefined, "any"), high: figure("patch-high", "High", "", undefined, undefined, "any"),
            names: h("input", {type: "text", id: "patch-names", "aria-label": "Names", hidden: true}),
        };
        const {target, property} = this.#fields;
        target.addEventListener("change", () => this.#offerProperties());
        property.addEventListener("change", () => this.#offerRange());
        this.#each = h("input", {type: "checkbox", id: "patch-each"});
        this.#submit = h("button", {id: "patch-submit"}, "Add");
        this.#cancel = h("button", {type: "button", class: "quiet", hidden: true, onclick: () => this.#edit(-1)}, "Cancel");
        this.#learn = h("button", {type: "button", id: "patch-learn", title: "Move a fader: it drives the target's property", onclick: () => this.#startLearning()}, "Learn a fader");
        const reset = h("button", {type: "button", class: "quiet", id: "patch-default", title: "Light n's level at address n of sACN universe 1 and of Art-Net 0",
            onclick: () => this.#send({use_default: true})}, "Default patch");
        this.#form = h("form", {id: "patch-form", class: "row"}, ...Object.values(this.#fields), h("label", {class: "row", title: "Light by light, one address after the other"}, this.#each, "each light"),
            this.#submit, this.#cancel, this.#learn, reset);
        this.#form.addEventListener("submit", (event) => {
            event.preventDefault();
            this.#take();
        });
        return this.#form;
    }

    #offerTargets() {
        if (!this.#form) return;
        const {lights, groups} = this.#store.state, {target} = this.#fields;
        const wanted = [...lights.map(({name}) => [`light ${name}`, name]), ...groups.map(({name}) => [`group ${name}`, `${name} (group)`]), ["all", "All lights"], ["scene", "Scene"]];
        const signature = JSON.stringify(wanted);
        if (target.dataset.signature === signature) return;
        const before = target.value || (this.#store.selected ? `${this.#store.selected.kind} ${this.#store.selected.name}` : "");
        target.dataset.signature = signature;
        target.replaceChildren(...wanted.map(([value, text]) => h("option", {value}, text)));
        if (wanted.some(([value]) => value === before)) target.value = before;
        this.#offerProperties();
    }

    #offerProperties() {
        const {target, property} = this.#fields, kind = target.value.split(" ")[0];
        const names = properties.filter((row) => row.of_scene === (kind === "scene") && !(row.by_name && row.of_scene)).map((row) => row.name);
        const before = property.value;
        property.replaceChildren(...names.map((name) => h("option", {value: name}, name)));
        if (names.includes(before)) property.value = before;
        this.#each.disabled = kind !== "group" && kind !== "all";
        this.#each.checked = kind === "all" || (this.#each.checked && !this.#each.disabled);
        this.#offerRange();
    }

    #offerRange() {
        const row = rowOf(this.#fields.property.value), unit = row.unit_name && ` ${row.unit_name}`, {names} = this.#fields;
        names.hidden = !row.by_name;
        names.required = row.by_name;
        names.value = row.name === "profile" ? this.#store.state.profiles.join(", ") : "";
        names.placeholder = "none, L201, L204";
        names.title = `The names share the slot's way evenly, from 0 on; with commas between${row.name === "gel" ? "; none: no gel" : ""}`;
        for (const [field, value] of [[this.#fields.low, row.low], [this.#fields.high, row.high]]) {
            field.value = "";
            field.hidden = row.by_name;
            field.required = !row.has_range && !row.by_name;    // then there is no default
            field.placeholder = row.has_range ? `${formatNumber(value / row.unit, 0)}${unit}` : (field === this.#fields.low ? "from" : "to") + unit;
        }
    }

    #lightsOfTarget() {
        const [kind, ...rest] = this.#fields.target.value.split(" "), name = rest.join(" ");
        if (kind === "all") return this.#store.state.lights.map((light) => light.name);
        return this.#each.checked && kind === "group" ? this.#store.group(name)?.lights ?? [] : [kind === "scene" ? "" : name];
    }

    // What the form says: a row, or one for each light.
    #wished() {
        const {protocol, universe, address, property, bits, low, high} = this.#fields, {unit} = rowOf(property.value);
        const base = {protocol: protocol.value, universe: Number(universe.value), property: property.value, bits: Number(bits.value)};
        if (low.value !== "") base.low = Number(low.value) * unit;
        if (high.value !== "") base.high = Number(high.value) * unit;
        if (rowOf(property.value).by_name) base.profiles = readNames(this.#fields.names.value);
        let next = Number(address.value);
        return this.#lightsOfTarget().map((target) => {
            const row = {...base, address: next, target};
            next += footprint(row);
            return row;
        });
    }

    async #take() {
        const rows = this.#patch.rows.map((row) => ({...row})), wished = this.#wished(), at = this.#edited;
        if (at >= 0) {    // what the form does not show stays
            const {property, merge} = rows[at];
            rows.splice(at, 1, ...wished.map((row) => ({...row, ...(property === row.property ? {merge} : {})})));
        } else {
            rows.push(...wished);
        }
        if (!await this.#send({rows})) return;
        this.#edit(-1);
        const last = wished.at(-1);
        if (last) this.#fields.address.value = Math.min(kSlots, last.address + footprint(last));
    }

    // Result: whether the server took it. It refuses where somebody else has changed the patch since it was shown.
    async #send(set_patch) {
        const result = await this.#connection.command({set_patch, base_rev: this.#rev});
        await this.refresh();
        return result?.code === "ok";
    }

    // Puts a row into the form; -1: the form adds again.
    #edit(at) {
        this.#edited = at;
        setText(this.#submit, at < 0 ? "Add" : `Change row ${at + 1}`);
        this.#cancel.hidden = at < 0;
        if (at < 0) return;
        const row = this.#patch.rows[at], {state} = this.#store, fields = this.#fields, {unit} = rowOf(row.property);
        fields.target.value = !row.target ? "scene" : state.groups.some(({name}) => name === row.target) ? `group ${row.target}` : `light ${row.target}`;
        this.#offerProperties();
        this.#each.checked = false;
        for (const name of ["protocol", "universe", "address", "property"]) fields[name].value = row[name];
        fields.bits.value = row.bits === 16 ? "16" : "8";
        this.#offerRange();
        for (const name of ["low", "high"]) fields[name].value = Number.isFinite(row[name]) ? String(Number((row[name] / unit).toPrecision(9))) : "";
        fields.names.value = (row.profiles ?? []).map((name) => name || "none").join(", ");
        fields.address.focus();
    }

    async #startLearning() {
        const [target] = this.#lightsOfTarget(), {property, low, high} = this.#fields, {unit} = rowOf(property.value);
        const row = {target, property: property.value};
        if (low.value !== "" && high.value !== "") Object.assign(row, {low: Number(low.value) * unit, high: Number(high.value) * unit});
        if (rowOf(property.value).by_name) row.profiles = readNames(this.#fields.names.value);
        this.#learn.disabled = true;
        setText(this.#learn, "Move a fader…");
        const {learned} = await this.#connection.request({learn: {timeout_s: kLearnSeconds}}).catch(() => ({}));
        if (learned?.device) await this.#connection.command({map_control: {row: {...row, device: learned.device, control: learned.control}}});
        setText(this.head, learned?.device ? `${learned.control} of ${learned.product || learned.device} drives ${[target, property.value].filter(Boolean).join(" ")}` : `Nothing moved within ${kLearnSeconds} s`);
        this.#told_ms = performance.now();
        this.#learn.disabled = false;
        setText(this.#learn, "Learn a fader");
        if (this.open) this.refresh();
    }

    #button(text, label, run) {
        return pageRole === "viewer" ? null : h("button", {type: "button", class: "quiet", "aria-label": label, onclick: run}, text);
    }

    #show(rev, patch, sources, surfaces) {
        this.#rev = rev;
        this.#patch = {...patch, rows: patch.rows ?? []};
        const faders = fadersOf(surfaces), wrong = faults(this.#patch.rows, faders, this.#store.state);
        const count = [...wrong.rows, ...wrong.faders].filter((list) => list.some(isWrong)).length;
        if (performance.now() - this.#told_ms > kToldMs) setText(this.head, [patch.is_default ? "Default patch: a change here makes it one of your own" : `${this.#patch.rows.length} rows`,
            faders.length ? `${faders.length} faders` : "", count ? `${count} ${count === 1 ? "problem" : "problems"}` : "no problems"].filter(Boolean).join(" · "));
        const hints = [];
        if (this.#patch.rows.length > kMostShown) hints.push(`${this.#patch.rows.length - kMostShown} more rows are not shown.`);
        if (!sources.endpoints?.some((one) => one.protocol !== "box")) hints.push("Start goniod with --sacn or --artnet to listen to consoles.");
        setText(this.#hint, hints.join(" "));
        this.#hint.hidden = !hints.length;
        this.#draw(faders, wrong);
        const cache = new Map();
        this.#patch.rows.slice(0, kMostShown).forEach((row, i) => {
            const key = `${row.protocol} ${row.universe}`;
            if (!cache.has(key)) cache.set(key, levelsOf(sources.sources ?? [], row.protocol, row.universe));
            setText(this.#cells[i], levelText(row, cache.get(key)));
        });
        faders.forEach((fader, i) => setText(this.#cells[Math.min(kMostShown, this.#patch.rows.length) + i], fader.at));
    }

    // The rows, without their levels: rebuilt where they differ, so that buttons can be pressed.
    #draw(faders, wrong) {
        const {rows} = this.#patch, signature = JSON.stringify([rows, faders.map(({row, text, own}) => [row, text, own]), wrong]);
        if (this.rows.dataset.signature === signature) return;
        this.rows.dataset.signature = signature;
        this.#cells = [];
        const level = () => { const cell = h("td", {class: "level"}); this.#cells.push(cell); return cell; };
        const notes = (list) => h("td", {class: "note"}, list.map((one) => (isWrong(one) ? `⚠ ${one}` : one)).join("; "));
        const cells = (...texts) => texts.map((text) => h("td", {}, String(text)));
        const drawn = rows.slice(0, kMostShown).map((row, i) => h("tr", {"data-row": i + 1, class: wrong.rows[i].some(isWrong) ? "clash" : null},
            ...cells(i + 1, row.protocol === "sacn" ? "sACN" : "Art-Net", row.universe, row.address, row.target || "Scene", row.property),
            h("td", {class: "figure"}, String(row.bits || 8)), h("td", {class: "figure"}, String(footprint(row))), level(), notes(wrong.rows[i]),
            h("td", {}, this.#button("Edit", `Edit row ${i + 1}`, () => this.#edit(i)),
                this.#button("Unpatch", `Unpatch row ${i + 1}`, () => { this.#edit(-1); this.#send({rows: rows.filter((_, at) => at !== i)}); }))));
        drawn.push(...faders.map((fader, i) => h("tr", {"data-fader": fader.text, class: wrong.faders[i].some(isWrong) ? "clash" : null},
            ...cells("", "Fader", fader.box, fader.control, fader.target || "Scene", fader.property), h("td"), h("td"), level(), notes(wrong.faders[i]),
            h("td", {}, fader.own ? this.#button("Forget", `Forget ${fader.text}`, async () => { await this.#connection.command({map_control: {row: fader.row, remove: true}}); this.refresh(); }) : null))));
        this.rows.replaceChildren(...drawn);
    }
}
