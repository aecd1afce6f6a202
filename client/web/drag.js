// The selected lights in the hand: moved, or turned by the end of their aim line, by as far as the pointer has come. One
// gesture, one command for all of them.

import {moveEach, setEach} from "./many.js";
import {add, onAxis, onPlane, rayThrough, scale, sub, unit} from "./projection.js";

const kSnap_m = 0.1;

export class Drag {
    axis = null;            // along which alone, a unit vector
    moved = false;

    #store; #eye; #lights; #turns; #from; #start; #key; #last = null;

    // lights: the first is the one that snaps. turns: their aims follow, else their positions do. from: the place where
    // the pointer is. reach_m: length of the aim lines.
    constructor(store, eye, lights, {turns = false, from, reach_m = 1}) {
        this.#store = store;
        this.#eye = eye;
        this.#lights = lights.filter((light) => turns || !light.sun);
        this.#turns = turns;
        this.#from = from;
        const ends = (light) => add(store.position(light), scale(unit(store.aim(light)), reach_m));
        this.#start = new Map(this.#lights.map((light) => [light.name, turns ? ends(light) : [...store.position(light)]]));
        const one = this.#lights.length === 1, what = turns ? "aim" : "position";
        this.#key = one ? `${what}:${this.#lights[0].name}` : `${what}s`;
        if (this.empty) return;
        store.hold(this.#key, one ? [...this.#valueOf(this.#lights[0], this.#start.get(this.#lights[0].name))]
            : new Map(this.#lights.map((light) => [light.name, this.#valueOf(light, this.#start.get(light.name))])));
    }

    get empty() { return this.#lights.length === 0; }
    // Begins anew at this place: a finger that comes down.
    from(place) { this.#from = place; }

    // place: where the pointer is now. snap: to a grid of 0.1 m.
    to(place, snap) {
        if (this.empty) return;
        const first = this.#start.get(this.#lights[0].name), find = (at) => (this.axis
            ? onAxis(this.#eye, rayThrough(this.#eye, at), first, this.axis) : onPlane(this.#eye, rayThrough(this.#eye, at), first, this.#eye.forward));
        const from = find(this.#from), to = find(place);
        if (!from || !to) return;
        this.#last = {place, snap};
        this.moved = true;
        let by = sub(to, from);
        // Along an axis the others stay; snapped are those that move.
        if (snap) by = by.map((x, i) => (Math.abs(x) > 1e-9 ? Math.round((first[i] + x) / kSnap_m) * kSnap_m - first[i] : x));
        this.#send((start) => add(start, by));
    }

    // Holds it to an axis, or freely again.
    hold(axis) {
        this.axis = this.axis === axis ? null : axis;
        if (this.#last) this.to(this.#last.place, this.#last.snap);
    }

    end(cancelled) {
        if (this.empty) return;
        if (cancelled && this.moved) this.#send((start) => start);
        this.#store.release(this.#key);
    }

    #valueOf(light, point) { return this.#turns ? sub(point, this.#store.position(light)) : point; }

    #send(place) {
        const values = new Map(this.#lights.map((light) => [light.name, this.#valueOf(light, place(this.#start.get(light.name)))]));
        const [[name, value]] = values;
        if (this.#lights.length > 1) {
            const command = this.#turns ? setEach(new Map([...values].map(([each, aim]) => [each, {aim}]))) : moveEach(values);
            this.#store.set(this.#key, values, command);
        } else {
            this.#store.set(this.#key, value, {set_light: this.#turns ? {name, aim: value} : {name, position_m: value}});
        }
    }
}
