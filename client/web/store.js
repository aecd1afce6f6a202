// The state of the scene as the server last told it, and what the hands on this page hold against it.
//
// A property that is being changed here has an override: its newest value, shown by every control of that property and
// sent at most once per animation frame. It ends when no hand holds it and the server has answered the last message; so
// a StateChanged that is on its way never pulls a fader out of the hand.

export class Store extends EventTarget {
    state = null;         // State, with `lights` and `groups` as arrays; null before the first Ready
    selected = null;      // {kind: "light" | "group", name}; of several lights the one that was chosen last
    clientId = 0;         // of this connection, as `control` and StateChanged name it

    #connection;
    #overrides = new Map();    // key -> {value, held, unanswered, queued}
    #flushPlanned = false;
    #notifyPlanned = false;
    #chosen = new Set();       // names of the lights that are selected
    #byName = new Map();       // the lights of `state`
    #said = {scene_rev: 0, warnings: [], notes: []};    // what the answer to the last load said
    #gesture = 0;              // of the last hand that took hold: what it sends is undone as one

    constructor(connection) {
        super();
        this.#connection = connection;
        connection.addEventListener("ready", (event) => {
            this.clientId = event.detail.client_id ?? 0;
            this.#restate(event.detail.state);
        });
        connection.addEventListener("changed", (event) => this.#change(event.detail));
    }

    light(name) { return this.#byName.get(name); }
    group(name) { return this.state?.groups.find((group) => group.name === name); }

    get holdsCamera() { return (this.state?.control?.holder ?? 0) !== 0 && this.state.control.holder === this.clientId; }
    get cameraIsOthers() { return (this.state?.control?.holder ?? 0) !== 0 && !this.holdsCamera; }

    select(kind, name) {
        this.selected = {kind, name};
        this.#chosen = new Set(kind === "light" ? [name] : []);
        this.#notify();
    }

    // Result: the lights that are selected, in the order of the scene; none where a group is.
    get chosen() {
        if (this.#chosen.size === 1) return [...this.#chosen].map((name) => this.light(name)).filter(Boolean);
        return (this.state?.lights ?? []).filter(({name}) => this.#chosen.has(name));
    }
    isChosen(name) { return this.#chosen.has(name); }

    // These lights alone, or beside those that are selected; also such that the server is about to tell of. first: becomes
    // `selected`; else the last of them.
    choose(names, {beside = false, first = names.at(-1)} = {}) {
        if (names.length === 0) return;
        this.#chosen = new Set([...(beside ? this.#chosen : []), ...names]);
        this.selected = {kind: "light", name: first};
        this.#notify();
    }

    // Selects a light beside the others, or no longer; the last one stays.
    toggle(name) {
        if (!this.#chosen.has(name)) return this.choose([name], {beside: true});
        if (this.#chosen.size === 1) return;
        this.#chosen.delete(name);
        if (this.selected?.name === name) this.selected = {kind: "light", name: [...this.#chosen].at(-1)};
        this.#notify();
    }

    // Where a light is shown: as a hand holds it, also where it holds several (key "positions": Map of name -> m).
    position(light) {
        const held = this.value("positions")?.get(light.name);
        return held ?? this.value(`position:${light.name}`, light.position);
    }

    // Likewise where it aims (key "aims").
    aim(light) { return this.value("aims")?.get(light.name) ?? this.value(`aim:${light.name}`, light.aim) ?? light.aim; }

    // A number of its own for commands that are undone as one.
    newGesture() { return ++this.#gesture; }

    // What a control of property `key` shows: the hand's value, else the server's.
    value(key, fromServer) {
        const override = this.#overrides.get(key);
        return override ? override.value : fromServer;
    }

    // Whether the server has answered every change that was made here.
    get answered() { return this.#overrides.size === 0; }

    hold(key, value) {
        const override = this.#overrides.get(key) ?? {value, unanswered: 0, queued: null};
        if (!override.held) override.gesture = ++this.#gesture;
        override.held = true;
        this.#overrides.set(key, override);
    }

    release(key) {
        const override = this.#overrides.get(key);
        if (!override) return;
        override.held = false;
        this.#endIfIdle(key, override);
    }

    // value: shown at once; command: sent with the next animation frame unless a newer one comes first.
    set(key, value, command) {
        const override = this.#overrides.get(key) ?? {held: false, unanswered: 0};
        override.value = value;
        override.queued = override.held ? {...command, gesture: override.gesture} : command;
        this.#overrides.set(key, override);
        this.#planFlush();
        this.#notify();
    }

    #planFlush() {
        if (this.#flushPlanned) return;
        this.#flushPlanned = true;
        // A hidden page gets no animation frames.
        if (document.hidden) setTimeout(() => this.#flush(), 50);
        else requestAnimationFrame(() => this.#flush());
    }

    #flush() {
        this.#flushPlanned = false;
        for (const [key, override] of this.#overrides) {
            if (!override.queued) continue;
            const command = override.queued;
            override.queued = null;
            override.unanswered++;
            this.#connection.command(command).then(() => {
                override.unanswered--;
                this.#endIfIdle(key, override);
            });
        }
    }

    #endIfIdle(key, override) {
        if (override.held || override.unanswered || override.queued) return;
        if (this.#overrides.get(key) === override) this.#overrides.delete(key);
        this.#notify();
    }

    #restate(state) {
        this.state = {...state, lights: state.lights ?? [], groups: state.groups ?? [], profiles: state.profiles ?? []};
        this.#index();
        this.#keepSelection();
        this.#notify();
    }

    // The warnings and notes of the last load, kept until another scene comes.
    noteLoad({scene_rev, warnings = [], notes = []}) {
        this.#said = {scene_rev, warnings, notes};
        this.#notify();
    }

    // The warnings of the scene that is shown: of its file, of lights that shine into nothing now, and of what was kept or
    // could not be brought back. The state alone says which lights shine into nothing: they may be mended since.
    get loadWarnings() {
        const own = this.state?.scene_warnings ?? [];
        return [...own, ...this.#said.warnings.filter((text) => !own.includes(text) && !/shines? into nothing/.test(text))];
    }

    // Sentences that say what the last load took from an MVR show.
    get loadNotes() {
        return this.#said.notes;
    }

    // Result: the light that a warning says shines into nothing, where recess_light may mend it.
    hiddenLight(warning) {
        const name = /^the light '(.*)' shines into nothing: /s.exec(warning)?.[1];
        return name === undefined ? undefined : this.light(name);
    }

    // Lists print as [] where they are unchanged: only full ones replace what is known.
    #change({scene_rev, state: changed, removed_lights = [], removed_groups = [], light_order = [], renamed_lights = []}) {
        if (!this.state) return;
        const state = this.state;
        const merge = (list, removed, newer = []) => {
            const items = new Map(list.map((item) => [item.name, item]));
            for (const name of removed) items.delete(name);
            for (const item of newer) items.set(item.name, item);
            return [...items.values()];
        };
        state.scene_rev = scene_rev;
        state.lights = merge(state.lights, removed_lights, changed?.lights);
        if (light_order.length) {
            const place = new Map(light_order.map((name, i) => [name, i]));
            state.lights.sort((a, b) => place.get(a.name) - place.get(b.name));
        }
        this.#index();
        const nameNow = new Map(renamed_lights.map(({name, new_name}) => [name, new_name]));
        this.#chosen = new Set([...this.#chosen].map((name) => nameNow.get(name) ?? name));
        if (this.selected?.kind === "light" && nameNow.has(this.selected.name)) this.selected = {kind: "light", name: nameNow.get(this.selected.name)};
        state.groups = merge(state.groups, removed_groups, changed?.groups);
        if (changed?.scene !== undefined) {
            state.scene_warnings = changed.scene_warnings ?? [];
            // A change of the warnings alone brings the scene's name, but no scale.
            if (typeof changed.scene_scale === "number" && scene_rev > this.#said.scene_rev) this.#said = {scene_rev: 0, warnings: [], notes: []};    // of another scene
        }
        for (const [name, value] of Object.entries(changed ?? {})) {
            if (["scene_rev", "lights", "groups", "scene_warnings"].includes(name)) continue;
            if (value === null || (Array.isArray(value) && value.length === 0)) continue;
            state[name] = value;
        }
        this.#keepSelection();
        this.#notify();
    }

    #index() { this.#byName = new Map(this.state.lights.map((light) => [light.name, light])); }

    // What has gone leaves the selection to others that are selected, else to the first light.
    #keepSelection() {
        for (const name of this.#chosen) if (!this.light(name)) this.#chosen.delete(name);
        const {kind, name} = this.selected ?? {};
        if (kind === "light" ? this.light(name) : kind === "group" && this.group(name)) {
            if (kind === "light") this.#chosen.add(name);
            return;
        }
        const next = [...this.#chosen].at(-1) ?? this.state.lights[0]?.name;
        this.selected = next === undefined ? null : {kind: "light", name: next};
        this.#chosen = new Set(next === undefined ? [] : this.#chosen.size ? this.#chosen : [next]);
    }

    // Redraws once per turn of the event loop, however many properties changed.
    #notify() {
        if (this.#notifyPlanned) return;
        this.#notifyPlanned = true;
        queueMicrotask(() => {
            this.#notifyPlanned = false;
            if (this.state) this.dispatchEvent(new Event("update"));
        });
    }
}
