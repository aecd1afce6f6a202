// The state of the scene as the server last told it, and what the hands on this page hold against it.
//
// A property that is being changed here has an override: its newest value, shown by every control of that property and
// sent at most once per animation frame. It ends when no hand holds it and the server has answered the last message; so
// a StateChanged that is on its way never pulls a fader out of the hand.

export class Store extends EventTarget {
    state = null;         // State, with `lights` and `groups` as arrays; null before the first Ready
    selected = null;      // {kind: "light" | "group", name}
    clientId = 0;         // of this connection, as `control` and StateChanged name it

    #connection;
    #overrides = new Map();    // key -> {value, held, unanswered, queued}
    #flushPlanned = false;
    #notifyPlanned = false;
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

    light(name) { return this.state?.lights.find((light) => light.name === name); }
    group(name) { return this.state?.groups.find((group) => group.name === name); }

    get holdsCamera() { return (this.state?.control?.holder ?? 0) !== 0 && this.state.control.holder === this.clientId; }
    get cameraIsOthers() { return (this.state?.control?.holder ?? 0) !== 0 && !this.holdsCamera; }

    select(kind, name) {
        this.selected = {kind, name};
        this.#notify();
    }

    // What a control of property `key` shows: the hand's value, else the server's.
    value(key, fromServer) {
        const override = this.#overrides.get(key);
        return override ? override.value : fromServer;
    }

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
        this.#keepSelection();
        this.#notify();
    }

    // Lists print as [] where they are unchanged: only full ones replace what is known.
    #change({scene_rev, state: changed, removed_lights = [], removed_groups = [], light_order = [], renamed_lights = []}) {
        if (!this.state) return;
        const state = this.state;
        const merge = (list, removed, newer = []) => {
            const kept = list.filter((item) => !removed.includes(item.name));
            for (const item of newer) {
                const at = kept.findIndex((other) => other.name === item.name);
                if (at < 0) kept.push(item);
                else kept[at] = item;
            }
            return kept;
        };
        state.scene_rev = scene_rev;
        state.lights = merge(state.lights, removed_lights, changed?.lights);
        if (light_order.length) {
            const place = new Map(light_order.map((name, i) => [name, i]));
            state.lights.sort((a, b) => place.get(a.name) - place.get(b.name));
        }
        const renamed = this.selected?.kind === "light" && renamed_lights.find(({name}) => name === this.selected.name);
        if (renamed) this.selected = {kind: "light", name: renamed.new_name};
        state.groups = merge(state.groups, removed_groups, changed?.groups);
        if (changed?.scene !== undefined) state.scene_warnings = changed.scene_warnings ?? [];
        for (const [name, value] of Object.entries(changed ?? {})) {
            if (["scene_rev", "lights", "groups", "scene_warnings", "boot", "restored_rev"].includes(name)) continue;    // the last two: of Ready alone
            if (value === null || (Array.isArray(value) && value.length === 0)) continue;
            state[name] = value;
        }
        this.#keepSelection();
        this.#notify();
    }

    #keepSelection() {
        const {kind, name} = this.selected ?? {};
        if (kind === "light" ? this.light(name) : kind === "group" && this.group(name)) return;
        const first = this.state.lights[0];
        this.selected = first ? {kind: "light", name: first.name} : null;
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
