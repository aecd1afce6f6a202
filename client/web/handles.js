// What can be taken hold of in the picture: lights, the axes along which the selected one moves, and the point that it
// aims at. Drawn as SVG over the picture. Under the pointer: point, lux and cd/m², which the server tells (`pick`).

import {h, svg, setText, formatNumber} from "./dom.js";
import {pageRole} from "./control.js";
import {formatLux} from "./meter.js";
import {add, eyeOf, length, onAxis, onPlane, project, rayThrough, scale, sub, unit} from "./projection.js";

const kDragPx = 4;            // less is a click
const kReachPx = 14;          // a click this near to a light means it
const kPickEveryMs = 100;     // questions about what lies under the pointer
const kSnap_m = 0.1;
const kAxisShare = 0.12;      // length of an axis, of the picture's height at the light's distance
const kAxes = {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1]};

// Result: the lights that a click at a place means, the nearest first. Lights that lie on each other come one after the
// other: the one that is selected comes last.
export function lightsAt(lights, eye, place, size_px, selected) {
    const near = lights.filter((light) => !light.sun).map((light) => ({name: light.name, at: project(eye, light.position)}))
        .filter(({at}) => at).map(({name, at}) => ({name, off: Math.hypot((at.x - place.x) * size_px[0], (at.y - place.y) * size_px[1])}))
        .filter(({off}) => off <= kReachPx).sort((a, b) => a.off - b.off).map(({name}) => name);
    const at = near.indexOf(selected);
    return at < 0 ? near : [...near.slice(at + 1), ...near.slice(0, at + 1)];
}

export class Handles {
    #store; #connection; #screen;
    #svg = svg("svg", {id: "handles", "aria-hidden": "true"});
    #readout = h("output", {id: "under", hidden: true, role: "status"});
    #aim = h("button", {type: "button", id: "aim-here", class: "quiet", title: "Then click what the light shall aim at (A)", "aria-pressed": "false"}, "Aim here");
    #drawn = new Map();      // key -> element
    #aiming = false;
    #drag = null;            // what #hold() began
    #asked = false; #next = null; #pickTimer = 0;
    #down = null;            // where the pointer went down on the picture

    // screen: the element that holds the picture; pictures: the elements that show it.
    constructor(store, connection, screen, pictures) {
        this.#store = store;
        this.#connection = connection;
        this.#screen = screen;
        screen.querySelector("#veil").before(this.#svg, this.#readout);
        new ResizeObserver(() => this.update()).observe(screen);
        for (const element of pictures) this.#listen(element);
        this.#aim.addEventListener("click", () => this.#setAiming(!this.#aiming));
        document.addEventListener("keydown", (event) => this.#key(event));
    }

    get aimButton() { return this.#aim; }

    get #eye() {
        const {camera, size_px} = this.#store.state;
        return eyeOf({...camera, ...this.#store.value("camera", {eye: camera.eye, target: camera.target})}, size_px);
    }
    // The rectangle that the picture fills in the screen, px.
    get #frame() {
        const [width, height] = this.#store.state.size_px, box = this.#screen.getBoundingClientRect();
        const s = Math.min(box.width / width, box.height / height);
        return {left: (box.width - s * width) / 2, top: (box.height - s * height) / 2, width: s * width, height: s * height, box};
    }
    // Result: the place under a pointer, beside the picture too.
    #at(event) {
        const {left, top, width, height, box} = this.#frame;
        return {x: (event.clientX - box.left - left) / width, y: (event.clientY - box.top - top) / height};
    }
    // Result: that place; null beside the picture.
    #place(event) {
        const place = this.#at(event);
        return place.x >= 0 && place.x <= 1 && place.y >= 0 && place.y <= 1 ? place : null;
    }
    #position(light) { return this.#store.value(`position:${light.name}`, light.position); }
    #selected() { return this.#store.selected?.kind === "light" ? this.#store.light(this.#store.selected.name) : undefined; }

    // Draws what has changed. What stays keeps its elements, so that a pointer may rest on them.
    update() {
        if (!this.#store.state?.size_px) return;
        const {left, top, width, height} = this.#frame, eye = this.#eye, selected = this.#selected();
        const unseen = new Set(this.#drawn.keys());
        const draw = (key, tag, attributes, press, title) => {
            unseen.delete(key);
            let node = this.#drawn.get(key);
            if (!node) {
                node = svg(tag, {onpointerdown: press}, title ? svg("title", {}, title) : null);
                this.#drawn.set(key, node);
                this.#svg.append(node);
            }
            for (const [name, value] of Object.entries(attributes)) if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
        };
        const px = (point) => {
            const at = project(eye, point);
            return at && [left + at.x * width, top + at.y * height];
        };
        const line = (key, from, to, name) => {
            const a = px(from), b = px(to);
            if (a && b) draw(key, "line", {x1: a[0], y1: a[1], x2: b[0], y2: b[1], class: name});
        };
        if (selected && !selected.sun && pageRole !== "viewer") {
            const position = this.#position(selected), at = project(eye, position);
            const reach = at ? 2 * kAxisShare * at.depth * eye.tanY : 0;
            const aim = this.#store.value(`aim:${selected.name}`, selected.aim) ?? selected.aim;
            if (at) line("aim", position, add(position, scale(unit(aim), 2 * reach)), "aim");
            for (const [name, axis] of Object.entries(at ? kAxes : {})) {
                const end = add(position, scale(axis, reach)), tip = px(end);
                line(`line ${name}`, position, end, name);
                if (tip) draw(`axis ${name}`, "circle", {cx: tip[0], cy: tip[1], r: 6, class: name, "data-axis": name},
                    (event) => this.#hold(event, this.#selected(), axis), `Move along ${name.toUpperCase()}`);
            }
        }
        for (const light of this.#store.state.lights) {
            const at = light.sun ? null : project(eye, this.#position(light));
            if (!at || at.x < 0 || at.x > 1 || at.y < 0 || at.y > 1) continue;
            const on = light === selected, [cx, cy] = [left + at.x * width, top + at.y * height];
            draw(`light ${light.name}`, "circle", {cx, cy, r: on ? 8 : 5, class: on ? "light on" : "light", "data-light": light.name},
                (event) => this.#press(event, this.#store.light(light.name)), light.name);
        }
        for (const key of unseen) {
            this.#drawn.get(key).remove();
            this.#drawn.delete(key);
        }
    }

    // A press on a light selects it, or the next one at the same place; held, it moves the one that is selected.
    #press(event, light) {
        const place = this.#place(event), selected = this.#selected();
        if (event.button !== 0 || !place) return;
        const size = [this.#frame.width, this.#frame.height];
        const meant = lightsAt(this.#store.state.lights, this.#eye, place, size, selected?.name);
        if (!selected || !meant.includes(selected.name)) {
            this.#store.select("light", meant[0] ?? light.name);
            this.#hold(event, this.#selected(), null);
        } else {
            this.#hold(event, selected, null, meant[0]);
        }
    }

    // axis: along which it moves; null: in the plane that faces the camera. next: selected where the pointer does not move.
    #hold(event, light, axis, next = null) {
        event.preventDefault();
        event.stopPropagation();
        if (pageRole === "viewer" || !light) return;
        const start = [...this.#position(light)], eye = this.#eye, key = `position:${light.name}`;
        const find = (at, along) => along ? onAxis(eye, rayThrough(eye, at), start, along) : onPlane(eye, rayThrough(eye, at), start, eye.forward);
        this.#store.hold(key, start);
        this.#drag = {light: light.name, key, start, axis, first: {x: event.clientX, y: event.clientY}, moved: false, place: this.#at(event), find, next, last: event};
        const move = (moved) => this.#move(moved);
        const end = (ended) => {
            removeEventListener("pointermove", move);
            removeEventListener("pointerup", end);
            removeEventListener("pointercancel", end);
            this.#drop(ended.type === "pointercancel");
        };
        addEventListener("pointermove", move);
        addEventListener("pointerup", end);
        addEventListener("pointercancel", end);
    }

    #move(event) {
        const drag = this.#drag;
        if (!drag) return;
        drag.last = event;
        if (!drag.moved && Math.hypot(event.clientX - drag.first.x, event.clientY - drag.first.y) < kDragPx) return;
        drag.moved = true;
        const from = drag.find(drag.place, drag.axis), to = drag.find(this.#at(event), drag.axis);
        if (!from || !to) return;
        let position = add(drag.start, sub(to, from));
        // Along an axis the others stay; snapped are those that move.
        if (event.ctrlKey) position = position.map((x, i) => (Math.abs(x - drag.start[i]) > 1e-9 ? Math.round(x / kSnap_m) * kSnap_m : x));
        this.#send(position);
    }

    #send(position) {
        const {light, key} = this.#drag;
        this.#store.set(key, position, {set_light: {name: light, position_m: position}});
    }

    #drop(cancelled) {
        const drag = this.#drag;
        if (!drag) return;
        if (cancelled && drag.moved) this.#send(drag.start);
        this.#drag = null;
        this.#store.release(drag.key);
        if (!drag.moved && !cancelled && drag.next) this.#store.select("light", drag.next);
    }

    #setAiming(on) {
        this.#aiming = on && this.#selected() !== undefined && pageRole !== "viewer";
        this.#aim.setAttribute("aria-pressed", String(this.#aiming));
        this.#screen.classList.toggle("aiming", this.#aiming);
    }

    #key(event) {
        if (event.key === "Escape") {
            if (this.#drag) this.#drop(true);
            this.#setAiming(false);
            return;
        }
        const typing = event.target instanceof Element && event.target.closest("input, select, textarea");
        if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
        const letter = event.key.toLowerCase();
        if (this.#drag && letter in kAxes) {    // along this axis from now on; once more: freely again
            this.#drag.axis = this.#drag.axis === kAxes[letter] ? null : kAxes[letter];
            this.#move(this.#drag.last);
        } else if (letter === "a") {
            this.#setAiming(!this.#aiming);
        }
    }

    #listen(element) {
        element.addEventListener("pointerdown", (event) => { this.#down = event.button === 0 ? {x: event.clientX, y: event.clientY} : null; });
        element.addEventListener("pointerup", (event) => {
            const down = this.#down, place = this.#place(event);
            this.#down = null;
            if (!down || !place || Math.hypot(event.clientX - down.x, event.clientY - down.y) >= kDragPx) return;
            if (this.#aiming) this.#aimAt(place);
        });
        element.addEventListener("pointermove", (event) => this.#ask(event.buttons === 0 ? this.#place(event) : null));
        element.addEventListener("pointerleave", () => this.#ask(null));
    }

    async #aimAt(place) {
        const light = this.#selected();
        this.#setAiming(false);
        if (!light) return;
        const {pick} = await this.#request(place) ?? {};
        if (!pick?.hit) return;
        const aim = sub(pick.point_m, light.position);
        if (length(aim) > 1e-6) this.#connection.command({set_light: {name: light.name, aim}});
    }

    async #request({x, y}) {
        try {
            return await this.#connection.request({pick: {x, y}});
        } catch {
            return null;    // the connection has ended
        }
    }

    // place: what lies there is asked; null: nothing is shown any more. One question at a time, the newest next.
    #ask(place) {
        this.#next = place;
        if (!place) {
            this.#readout.hidden = true;
            return;
        }
        if (this.#asked || this.#pickTimer) return;
        this.#pickTimer = setTimeout(async () => {
            this.#pickTimer = 0;
            const now = this.#next;
            if (!now) return;
            this.#asked = true;
            const answer = await this.#request(now);
            this.#asked = false;
            if (!this.#next) return;
            this.#show(answer?.pick);
            if (this.#next !== now) this.#ask(this.#next);
        }, kPickEveryMs);
    }

    #show(pick) {
        this.#readout.hidden = !pick?.hit;
        if (!pick?.hit) return;
        const {reading, luminance_nit, point_m, normal, node, distance_m} = pick;
        const vector = (v, digits) => v.map((x) => formatNumber(x, digits)).join(" ");
        setText(this.#readout, `${formatLux(reading.total_lx)} · ${formatNumber(luminance_nit, luminance_nit < 10 ? 3 : 1)} cd/m² · `
            + `${node || "surface"} at ${vector(point_m, 2)} m · normal ${vector(normal, 2)} · ${formatNumber(distance_m, 2)} m away`);
    }
}
