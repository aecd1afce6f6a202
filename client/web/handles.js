// What can be taken hold of in the picture: lights, the axes along which the selected ones move, the end of the aim line,
// the ring about it, and the point that they aim at. Drawn as SVG over the picture.

import {h, svg, onPageKey} from "./dom.js";
import {pageRole} from "./control.js";
import {pathOf} from "./beam.js";
import {Drag} from "./drag.js";
import {setEach} from "./many.js";
import {Readout} from "./readout.js";
import {RollDrag, ringOf, ringPoint} from "./roll.js";
import {add, eyeOf, length, project, scale, sub, unit} from "./projection.js";

const kDragPx = 4;            // less is a click
const kReachPx = 14;          // a click this near to a light means it
const kAxisShare = 0.12;      // length of an axis, of the picture's height at the light's distance
const kRingSides = 48;
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
    several = false;         // presses select beside the others
    onPlace = null;          // a click on the picture goes there instead: (place, event)
    onHover = null;          // is told what lies under the pointer (Pick), null where nothing is known

    #store; #connection; #screen; #readout;
    #svg = svg("svg", {id: "handles", "aria-hidden": "true"});
    #aim = h("button", {type: "button", id: "aim-here", class: "quiet", title: "Then click what the light shall aim at (A)", "aria-pressed": "false"}, "Aim here");
    #drawn = new Map();      // key -> element
    #aiming = false;
    #drag = null;            // {drag, first, modal, next}: what is in the hand
    #down = null;            // where the pointer went down on the picture
    #marquee = null;         // {from, to}: the rectangle that is being drawn, px of the screen
    #pointer = null;         // the last one over the screen

    // screen: the element that holds the picture; pictures: the elements that show it.
    constructor(store, connection, screen, pictures) {
        this.#store = store;
        this.#connection = connection;
        this.#screen = screen;
        this.#readout = new Readout(connection, () => (this.#aiming ? this.#selected() : []), () => {
            this.update();
            this.onHover?.(this.#readout.pick);
        });
        screen.querySelector("#veil").before(this.#svg, this.#readout.node);
        new ResizeObserver(() => this.update()).observe(screen);
        for (const element of pictures) this.#listen(element);
        screen.addEventListener("pointermove", (event) => { this.#pointer = event; });
        this.#aim.addEventListener("click", () => this.setAiming(!this.#aiming));
        onPageKey((event) => this.#key(event));
    }

    get aimButton() { return this.#aim; }
    get svg() { return this.#svg; }
    get busy() { return this.#drag !== null; }

    get eye() {
        const {camera, size_px} = this.#store.state;
        return eyeOf({...camera, ...this.#store.value("camera", {eye: camera.eye, target: camera.target})}, size_px);
    }
    // The rectangle that the picture fills in the screen, px.
    get frame() {
        const [width, height] = this.#store.state.size_px, box = this.#screen.getBoundingClientRect();
        const s = Math.min(box.width / width, box.height / height);
        return {left: (box.width - s * width) / 2, top: (box.height - s * height) / 2, width: s * width, height: s * height, box};
    }
    // Result: the place under a pointer, beside the picture too.
    #at(event) {
        const {left, top, width, height, box} = this.frame;
        return {x: (event.clientX - box.left - left) / width, y: (event.clientY - box.top - top) / height};
    }
    // Result: that place; null beside the picture.
    #place(event) {
        const place = this.#at(event);
        return place.x >= 0 && place.x <= 1 && place.y >= 0 && place.y <= 1 ? place : null;
    }
    // A picture is there that nothing newer follows.
    atRest() { this.#readout.again(); }
    // Result: what lies at a place of the picture (Pick); null where the connection has ended.
    pickAt(place) { return this.#readout.at(place); }
    // Result: the point under the pointer; null where the pointer has not rested long enough to know.
    under(event) {
        const kNear = 0.02, {pick, place} = this.#readout, now = this.#place(event);
        return pick && place && now && Math.hypot(place.x - now.x, place.y - now.y) < kNear ? pick.point_m : null;
    }
    // Result: the name of the light under the pointer; undefined where there is none.
    lightUnder(event) {
        const place = this.#place(event), {width, height} = this.frame;
        return place ? lightsAt(this.#store.state.lights, this.eye, place, [width, height])[0] : undefined;
    }
    // Whether a press on the picture is not the camera's: a rectangle begins.
    takes(event) { return event.button === 0 && pageRole !== "viewer" && (event.shiftKey || this.several); }

    // The selected lights, the one that was chosen last first.
    #selected() {
        const name = this.#store.selected?.name;
        return this.#store.chosen.sort((a, b) => (b.name === name) - (a.name === name));
    }
    // Length of an axis at a light, m.
    #reach(eye, light) {
        const at = project(eye, this.#store.position(light));
        return at ? 2 * kAxisShare * at.depth * eye.tanY : 0;
    }

    // Draws what has changed. What stays keeps its elements, so that a pointer may rest on them.
    update() {
        if (!this.#store.state?.size_px) return;
        const {left, top, width, height} = this.frame, eye = this.eye;
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
        const selected = pageRole === "viewer" ? [] : this.#selected();
        const first = selected.find((light) => !light.sun);
        if (first) this.#drawAxes(eye, first, px, line, draw);
        for (const light of selected.slice(0, 64))
            if (light !== first && !light.sun) line(`aim ${light.name}`, this.#store.position(light), this.#aimEnd(eye, light), "aim");
        for (const light of this.#store.state.lights) {
            const at = light.sun ? null : project(eye, this.#store.position(light));
            if (!at || at.x < 0 || at.x > 1 || at.y < 0 || at.y > 1) continue;
            const on = this.#store.isChosen(light.name), [cx, cy] = [left + at.x * width, top + at.y * height];
            draw(`light ${light.name}`, "circle", {cx, cy, r: light === first ? 8 : on ? 7 : 5, class: on ? "light on" : "light", "data-light": light.name},
                (event) => this.#press(event, this.#store.light(light.name)), light.name);
        }
        const pick = this.#aiming ? this.#readout.pick : null;
        if (pick) line("normal", pick.point_m, add(pick.point_m, scale(pick.normal, 0.1 * pick.distance_m)), "normal");
        if (this.#marquee) {
            const {from, to} = this.#marquee;
            draw("marquee", "rect", {x: Math.min(from[0], to[0]), y: Math.min(from[1], to[1]), width: Math.abs(to[0] - from[0]), height: Math.abs(to[1] - from[1]), class: "marquee"});
        }
        for (const key of unseen) {
            this.#drawn.get(key).remove();
            this.#drawn.delete(key);
        }
    }

    #aimEnd(eye, light) { return add(this.#store.position(light), scale(unit(this.#store.aim(light)), 2 * this.#reach(eye, light))); }

    #drawAxes(eye, light, px, line, draw) {
        const position = this.#store.position(light), reach = this.#reach(eye, light);
        if (!(reach > 0)) return;
        const end = this.#aimEnd(eye, light), tip = px(end);
        line("aim", position, end, "aim");
        if (tip) draw("aim end", "circle", {cx: tip[0], cy: tip[1], r: 6, class: "aim", "data-aim": ""}, (event) => this.#hold(event, {turns: true}), "Turn");
        this.#drawRing(light, reach, px, draw);
        for (const [name, axis] of Object.entries(kAxes)) {
            const far = add(position, scale(axis, reach)), at = px(far);
            line(`line ${name}`, position, far, name);
            if (at) draw(`axis ${name}`, "circle", {cx: at[0], cy: at[1], r: 6, class: name, "data-axis": name},
                (event) => this.#hold(event, {axis}), `Move along ${name.toUpperCase()}`);
        }
    }

    // About the aim; its handle is where C0 is.
    #drawRing(light, reach, px, draw) {
        const ring = ringOf(this.#store, light, reach), at = px(ringPoint(ring, 0));
        const points = Array.from({length: kRingSides}, (_, i) => px(ringPoint(ring, 2 * Math.PI * i / kRingSides)));
        draw("roll ring", "path", {d: pathOf(points), class: "roll"});
        if (at) draw("roll", "circle", {cx: at[0], cy: at[1], r: 5, class: "roll", "data-roll": ""}, (event) => this.#hold(event, {rolls: true}), "Roll");
    }

    // A press on a light selects it, or the next one at the same place; held, it moves what is selected. With shift it
    // selects beside the others.
    #press(event, light) {
        const place = this.#place(event), selected = this.#store.selected?.kind === "light" ? this.#store.selected.name : undefined;
        if (event.button !== 0 || !place || this.#drag) return;
        const size = [this.frame.width, this.frame.height];
        const meant = lightsAt(this.#store.state.lights, this.eye, place, size, selected);
        if (event.shiftKey || this.several) {
            event.preventDefault();
            event.stopPropagation();
            return this.#store.toggle(light.name);
        }
        const among = meant.find((name) => this.#store.isChosen(name));
        if (among === undefined) {
            this.#store.select("light", meant[0] ?? light.name);
            return this.#hold(event, {});
        }
        const many = this.#store.chosen.length > 1;
        this.#hold(event, {next: many ? among : meant[0]});
    }

    // axis: along which it moves; else in the plane that faces the camera. next: selected where the pointer does not move.
    #hold(event, {axis = null, turns = false, rolls = false, next = null}) {
        event.preventDefault();
        event.stopPropagation();
        if (!this.#take({turns, rolls, from: this.#at(event)})) return;
        this.#drag = {...this.#drag, first: {x: event.clientX, y: event.clientY}, next};
        if (axis) this.#drag.drag.hold(axis);
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

    // Result: whether there is something in the hand now.
    #take({turns, rolls = false, from}) {
        const lights = this.#selected(), eye = this.eye;
        const first = lights.find((light) => !light.sun);
        if (pageRole === "viewer" || this.#drag || lights.length === 0 || (!first && !turns)) return false;
        const ordered = first ? [first, ...lights.filter((light) => light !== first)] : lights;
        const drag = rolls ? new RollDrag(this.#store, eye, ordered, {from, reach_m: this.#reach(eye, first)})
            : new Drag(this.#store, eye, ordered, {turns, from, reach_m: first ? 2 * this.#reach(eye, first) || 1 : 1});
        this.#drag = {drag, next: null, modal: null};
        return true;
    }

    // The lights follow the mouse, or a finger that comes down and moves, until a click, Enter or the finger's end; Escape
    // takes it back. done(): it has ended. Result: whether it began.
    follow(turns, done) {
        const first = this.#selected().find((light) => !light.sun), start = this.#pointer && this.#place(this.#pointer);
        const from = start ?? (first && project(this.eye, this.#store.position(first))) ?? {x: 0.5, y: 0.5};
        if (!this.#take({turns, from})) return false;
        let pressed = false;
        const listeners = {
            pointermove: (event) => { if (event.pointerType === "mouse" || pressed) this.#move(event); },
            pointerdown: (event) => {
                if (!this.#screen.contains(event.target)) return;
                event.preventDefault();
                event.stopPropagation();
                pressed = true;
                if (event.pointerType !== "mouse") this.#drag?.drag.from(this.#at(event));
            },
            pointerup: (event) => {
                event.stopPropagation();
                this.#drop(event.button === 2);
            },
            pointercancel: () => this.#drop(true),
        };
        for (const [type, listener] of Object.entries(listeners)) addEventListener(type, listener, {capture: true});
        this.#drag.modal = () => {
            for (const [type, listener] of Object.entries(listeners)) removeEventListener(type, listener, {capture: true});
            done();
        };
        return true;
    }

    #move(event) {
        const held = this.#drag;
        if (!held) return;
        if (!held.drag.moved && held.first && Math.hypot(event.clientX - held.first.x, event.clientY - held.first.y) < kDragPx) return;
        held.drag.to(this.#at(event), event.ctrlKey);
    }

    #drop(cancelled) {
        const held = this.#drag;
        if (!held) return;
        this.#drag = null;
        held.drag.end(cancelled);
        held.modal?.();
        if (!held.drag.moved && !cancelled && held.next) this.#store.select("light", held.next);
    }

    setAiming(on) {
        this.#aiming = on && this.#selected().length > 0 && pageRole !== "viewer";
        this.#aim.setAttribute("aria-pressed", String(this.#aiming));
        this.cross("aiming", this.#aiming);
        this.update();
    }

    // Whether the pointer is a cross: something is chosen by a click. name: what for.
    cross(name, on) { this.#screen.classList.toggle(name, on); }

    #key(event) {
        if (event.key === "Escape") {
            if (this.#drag) this.#drop(true);
            this.setAiming(false);
            return;
        }
        const typing = event.target instanceof Element && event.target.closest("input, select, textarea");
        if (typing || event.metaKey || event.altKey) return;
        const letter = event.key.toLowerCase();
        if (this.#drag && letter in kAxes) {    // along this axis from now on; once more: freely again
            this.#drag.drag.hold(kAxes[letter]);
        } else if (this.#drag?.modal && event.key === "Enter") {
            event.preventDefault();
            this.#drop(false);
        } else if (letter === "a" && !event.ctrlKey) {
            this.setAiming(!this.#aiming);
        }
    }

    #listen(element) {
        element.addEventListener("pointerdown", (event) => {
            this.#down = event.button === 0 ? {x: event.clientX, y: event.clientY} : null;
            if (this.takes(event)) this.#drawRectangle(element, event);
        });
        element.addEventListener("pointerup", (event) => {
            const down = this.#down, place = this.#place(event);
            this.#down = null;
            if (!down || !place || Math.hypot(event.clientX - down.x, event.clientY - down.y) >= kDragPx) return;
            if (this.#aiming) this.#aimAt(place);
            else this.onPlace?.(place, event);
        });
        element.addEventListener("pointermove", (event) => this.#readout.ask(event.buttons === 0 ? this.#place(event) : null));
        element.addEventListener("pointerleave", () => this.#readout.ask(null));
    }

    // From here to where the pointer is let go: the lights in the rectangle are selected beside the others.
    #drawRectangle(element, event) {
        event.preventDefault();
        element.setPointerCapture(event.pointerId);
        const {box} = this.frame, at = (moved) => [moved.clientX - box.left, moved.clientY - box.top];
        this.#marquee = {from: at(event), to: at(event)};
        const move = (moved) => {
            this.#marquee.to = at(moved);
            this.update();
        };
        const end = (ended) => {
            for (const [type, listener] of [["pointermove", move], ["pointerup", end], ["pointercancel", end]]) element.removeEventListener(type, listener);
            const {from, to} = this.#marquee;
            this.#marquee = null;
            if (ended.type === "pointerup" && Math.hypot(to[0] - from[0], to[1] - from[1]) >= kDragPx) this.#choose(from, to);
            this.update();
        };
        for (const [type, listener] of [["pointermove", move], ["pointerup", end], ["pointercancel", end]]) element.addEventListener(type, listener);
    }

    #choose(from, to) {
        const {left, top, width, height} = this.frame, eye = this.eye;
        const between = (x, a, b) => x >= Math.min(a, b) && x <= Math.max(a, b);
        const names = this.#store.state.lights.filter((light) => {
            const at = light.sun ? null : project(eye, this.#store.position(light));
            return at && between(left + at.x * width, from[0], to[0]) && between(top + at.y * height, from[1], to[1]);
        }).map(({name}) => name);
        if (names.length) this.#store.choose(names, {beside: true});
    }

    // All selected lights at what lies there.
    async #aimAt(place) {
        const lights = this.#selected();
        this.setAiming(false);
        const pick = await this.pickAt(place);
        if (!pick?.hit) return;
        const aims = new Map(lights.map((light) => [light.name, {aim: sub(pick.point_m, light.position)}]).filter(([, {aim}]) => length(aim) > 1e-6));
        if (aims.size === 1) this.#connection.command({set_light: {name: [...aims][0][0], ...[...aims][0][1]}});
        else if (aims.size > 1) this.#connection.command(setEach(aims));
    }
}
