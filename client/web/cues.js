// The tool "Cues": GO, STOP and BACK with what is active and next, how far it is, and the list; cues are recorded, changed and
// taken off in the form below them.

import {h, setText, formatNumber, onPageKey, tableHead} from "./dom.js";
import {pageRole} from "./control.js";

const kTickMs = 100;       // how often the countdown moves on between what the server tells
const kTimes = [["up_s", "Up, s"], ["down_s", "Down, s"], ["delay_up_s", "Delay up, s"], ["delay_down_s", "Delay down, s"]];
const kAfter = [["manual", "GO"], ["follow_s", "Follow"], ["hang_s", "Hang"]];
const kInteractive = "button, input, select, textarea, summary, a, dialog, [role=slider], [role=tab], [role=radio], [contenteditable]";

// Result: "12 Sunset", of a cue that has gone its number alone.
const titled = (cues, number) => {
    const label = cues.find((cue) => cue.number === number)?.label;
    return label ? `${number} ${label}` : number;
};
const afterText = ({follow_s, hang_s}) => follow_s !== undefined ? `follow ${follow_s}` : hang_s !== undefined ? `hang ${hang_s}` : "";

// Result: the number that the next cue would get: one more than the last whole one.
export function nextNumber(cues) {
    return String(Math.min(9999, Math.floor(Number(cues.at(-1)?.number ?? 0)) + 1));
}

export class CuePanel {
    #store; #connection;
    #open = false; #timer = 0; #told = null; #toldAt_ms = 0; #shown = ""; #editing = null;
    #active = h("strong", {id: "cue-active"});
    #next = h("strong", {id: "cue-next"});
    #progress = h("progress", {max: 1, value: 0, "aria-label": "Progress of the active cue"});
    #left = h("span", {class: "faint", id: "cue-left"});
    #status = h("p", {class: "hint", role: "status"});
    #rows = h("tbody");
    #field = {};
    #form; #opens; #record; #options = {};

    constructor(store, connection, node) {
        this.#store = store;
        this.#connection = connection;
        const play = (id, text, title, command) => h("button", {type: "button", id, title, class: id === "cue-go" ? "go" : null,
            onclick: () => this.#send(command)}, text);
        node.append(h("div", {class: "row wrap cue-bar"},
            play("cue-go", "GO", "Starts the next cue, or goes on with one that is held (Space)", {cue_go: {}}),
            play("cue-stop", "STOP", "Holds the cue that runs; once more: goes to the one before (Shift Space)", {cue_stop: {}}),
            play("cue-back", "BACK", "To the cue before the active one", {cue_back: {}}),
            h("span", {}, h("span", {class: "faint"}, "Active "), this.#active), h("span", {}, h("span", {class: "faint"}, "Next "), this.#next),
            this.#progress, this.#left, this.#status, h("span", {class: "grow"}),
            this.#opens = h("button", {type: "button", id: "cue-new", "aria-expanded": "false", title: "Record a cue", onclick: () => this.#edit(null, this.#form.hidden)}, "New cue")),
        h("div", {class: "scroll", tabindex: "0", "aria-label": "List of cues"}, h("table", {},
            tableHead(["~Active or next", "Cue#", "Label", "Up#", "Down#", "Delay up#", "Delay down#", "Goes on", "Time code", "~Go to, edit"]), this.#rows)),
        this.#makeForm(), this.#makeOptions());
        store.addEventListener("update", () => { if (this.#open) this.#update(); });
        onPageKey((event) => this.#key(event));
    }

    toggle(open) {
        this.#open = open;
        clearInterval(this.#timer);
        if (!open) return;
        this.#timer = setInterval(() => this.#tick(), kTickMs);
        if (this.#store.state) this.#update();
    }

    // Where the tool is open and nothing else wants the key.
    #key(event) {
        if (!this.#open || event.code !== "Space" || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
        if (pageRole === "viewer" || event.target.closest(kInteractive)) return;
        event.preventDefault();
        this.#send(event.shiftKey ? {cue_stop: {}} : {cue_go: {}});
    }

    async #send(command) {
        const result = await this.#connection.command(command);
        if (result?.code === "ok") setText(this.#status, "");
        return result?.code === "ok";
    }

    #makeForm() {
        const input = (name, props, label) => {
            this.#field[name] = h("input", {id: `cue-${name.replace(/_s$/, "").replaceAll("_", "-")}`, ...props});
            return h("label", {class: "meter-field"}, h("span", {class: "faint"}, label), this.#field[name]);
        };
        const seconds = {type: "number", min: 0, max: 3600, step: "any"};
        this.#field.after = h("select", {id: "cue-next-by", "aria-label": "What starts the next cue"}, ...kAfter.map(([value, text]) => h("option", {value}, text)));
        this.#field.content = h("select", {id: "cue-content"});
        this.#record = h("button", {id: "cue-record"}, "Record");
        this.#form = h("form", {class: "row wrap cue-form", "aria-label": "A cue", hidden: true},
            input("number", {type: "text", inputmode: "decimal", size: 7, maxlength: 8, required: true}, "Cue"),
            input("label", {type: "text", size: 14, maxlength: 128}, "Label"),
            ...kTimes.map(([name, text]) => input(name, {...seconds, value: name.startsWith("delay") ? 0 : 5}, text)),
            h("label", {class: "meter-field"}, h("span", {class: "faint"}, "Next by"), this.#field.after), input("after_s", {...seconds, value: 0, disabled: true}, "after, s"),
            input("timecode", {type: "text", size: 10, maxlength: 11, placeholder: "HH:MM:SS:FF"}, "Time code"),
            h("label", {class: "meter-field"}, h("span", {class: "faint"}, "Content"), this.#field.content), this.#record,
            h("button", {type: "button", class: "quiet", onclick: () => this.#close()}, "Close"));
        this.#field.number.addEventListener("input", () => { this.#field.number.dataset.touched = "1"; });
        this.#field.after.addEventListener("change", () => { this.#field.after_s.disabled = this.#field.after.value === "manual"; });
        this.#form.addEventListener("keydown", (event) => {
            if (event.key !== "Escape") return;
            event.preventDefault();
            this.#close();
        });
        this.#form.addEventListener("submit", (event) => {
            event.preventDefault();
            this.#submit();
        });
        return this.#form;
    }

    #makeOptions() {
        const field = (name, props, label) => {
            this.#options[name] = h(props.type ? "input" : "select", {id: `cue-option-${name.replace(/_s$/, "")}`, ...props});
            this.#options[name].addEventListener("change", () => this.#send({set_cue_options: {[name]: props.type ? Number(this.#options[name].value) : this.#options[name].value}}));
            return h("label", {class: "meter-field"}, h("span", {class: "faint"}, label), this.#options[name]);
        };
        const options = h("details", {class: "cue-options"}, h("summary", {}, "Options"), h("div", {class: "row wrap"},
            field("guard_s", {type: "number", min: 0, max: 5, step: 0.05}, "Double GO, s"), field("back_s", {type: "number", min: 0, max: 3600, step: 0.5}, "Time of BACK, s"),
            field("timecode", {}, "Time code of"), field("freewheel_s", {type: "number", min: 0.5, max: 2, step: 0.1}, "Goes on without it, s")));
        this.#options.timecode.append(...[["off", "nothing"], ["mtc", "MIDI"], ["artnet", "Art-Net"]].map(([value, text]) => h("option", {value}, text)));
        return options;
    }

    async #submit() {
        const {number, label, after, after_s, timecode, content} = this.#field;
        const cue = {number: number.value.trim(), label: label.value.trim(), timecode: timecode.value.trim()};
        for (const [name] of kTimes) cue[name] = Number(this.#field[name].value);
        if (after.value !== "manual") cue[after.value] = Number(after_s.value);
        else if (this.#editing !== null) cue.manual = true;
        if (content.value.startsWith("preset ")) cue.preset = content.value.slice("preset ".length);
        else if (content.value === "record") cue.record = true;
        const known = (this.#store.state.cues?.cues ?? []).some((one) => one.number === cue.number);
        const changes = this.#editing !== null && known;
        if (!await this.#send(changes ? {set_cue: cue} : {add_cue: cue})) return;
        changes ? this.#close() : this.#edit(null);
    }

    #close() {
        this.#edit(null, false);
        this.#opens.focus();
    }

    // The form is for this cue; null: for a new one.
    #edit(cue, open = true) {
        this.#form.hidden = !open;
        this.#opens.setAttribute("aria-expanded", String(open));
        const {number, label, after, after_s, timecode} = this.#field;
        this.#editing = cue?.number ?? null;
        number.value = cue?.number ?? nextNumber(this.#store.state.cues?.cues ?? []);
        number.readOnly = cue !== null;
        delete number.dataset.touched;
        label.value = cue?.label ?? "";
        timecode.value = cue?.timecode ?? "";
        if (cue) for (const [name] of kTimes) this.#field[name].value = cue[name];
        after.value = cue?.follow_s !== undefined ? "follow_s" : cue?.hang_s !== undefined ? "hang_s" : "manual";
        after_s.value = cue?.follow_s ?? cue?.hang_s ?? 0;
        after_s.disabled = after.value === "manual";
        setText(this.#record, cue ? "Change" : "Record");
        this.#offerContent();
        if (open) label.focus();
    }

    #offerContent() {
        const names = this.#store.state.presets?.names ?? [];
        const list = [...this.#editing !== null ? [["keep", "as it is"]] : [], ["record", "the lights now"], ...names.map((name) => [`preset ${name}`, `preset ${name}`])];
        const signature = JSON.stringify(list), select = this.#field.content;
        if (select.dataset.signature === signature) return;
        const before = select.value;
        select.dataset.signature = signature;
        select.replaceChildren(...list.map(([value, text]) => h("option", {value}, text)));
        if (this.#editing === null && list.some(([value]) => value === before)) select.value = before;
    }

    #update() {
        const {cues: {cues = []} = {}, cue_playback: playback = {}} = this.#store.state;
        if (playback !== this.#told) {
            this.#told = playback;
            this.#toldAt_ms = performance.now();
        }
        const {active = "", next = ""} = playback;
        setText(this.#active, titled(cues, active) || "none");
        setText(this.#next, titled(cues, next) || "none");
        for (const [name, input] of Object.entries(this.#options)) {
            const value = playback[name === "timecode" ? "timecode_source" : name];
            if (value !== undefined && document.activeElement !== input) input.value = value;
        }
        if (this.#editing === null && document.activeElement !== this.#field.number && !this.#field.number.dataset.touched) this.#field.number.value = nextNumber(cues);
        this.#offerContent();
        this.#tick();
        const signature = JSON.stringify([cues, active, next, pageRole]);
        if (signature === this.#shown) return;
        this.#shown = signature;
        this.#rows.replaceChildren(...cues.map((cue) => this.#row(cue, cue.number === active, cue.number === next)));
        this.#rows.querySelector("[aria-current]")?.scrollIntoView({block: "nearest"});
    }

    #row(cue, active, next) {
        const button = (text, label, run) => h("button", {type: "button", class: "quiet", "aria-label": label, title: label, onclick: run}, text);
        const {number} = cue;
        return h("tr", {"data-cue": number, class: active ? "active" : next ? "next" : null, "aria-current": active ? "step" : null},
            h("td", {class: "mark"}, active ? "● active" : next ? "▸ next" : ""), h("td", {class: "figure"}, number), h("td", {class: "wrapped"}, cue.label),
            ...kTimes.map(([name]) => h("td", {class: "figure"}, String(cue[name]))), h("td", {}, afterText(cue)), h("td", {}, cue.timecode),
            h("td", {}, ...pageRole === "viewer" ? [] : [button("Go to", `Go to cue ${number}`, () => this.#send({cue_goto: {number}})),
                button("Next", `Make cue ${number} the next one`, () => this.#send({set_cue_options: {next: number}})),
                button("Edit", `Edit cue ${number}`, () => this.#edit(cue)), button("×", `Remove cue ${number}`, () => this.#send({remove_cue: {number}}))]));
    }

    // What is told goes on by the clock of the page until the server tells anew.
    #tick() {
        const {running, held, progress_ratio: ratio = 0, remaining_s = 0, next_in_s: next_in, timecode = "", chase = "off"} = this.#told ?? {};
        const since_s = held || !running ? 0 : (performance.now() - this.#toldAt_ms) / 1000;
        const left_s = Math.max(0, remaining_s - since_s);
        const whole_s = ratio < 1 ? remaining_s / (1 - ratio) : 0;
        this.#progress.value = !running || whole_s === 0 ? ratio : 1 - left_s / whole_s;
        const words = [held ? "held" : "", running && left_s > 0 ? `${formatNumber(left_s, 1)} s left` : "",
            next_in !== undefined ? `next in ${formatNumber(Math.max(0, next_in - since_s), 1)} s` : "", chase === "off" ? "" : `time code ${chase}${timecode && ` ${timecode}`}`];
        setText(this.#left, words.filter(Boolean).join(" · "));
    }
}
