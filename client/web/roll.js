// The ring about the aim of a light, by which the selected lights are rolled: the C0 half plane follows the pointer. One
// gesture, one command for all of them.

import {setEach} from "./many.js";
import {add, cross, dot, project, scale, sub, unit} from "./projection.js";

const kSnap_rad = Math.PI / 12;
const kSamples = 180;            // of the ring, to find the one that is nearest to a place
const kSide = 1e-3;              // edge on, front and back of the ring are one place: the side of before counts
const wrapped = (rad) => rad - 2 * Math.PI * Math.round(rad / (2 * Math.PI));

// Result: {centre, radius_m, c0, c90} of a light's ring as it is shown. reach_m: length of its axes.
export function ringOf(store, light, reach_m) {
    const aim = unit(store.aim(light)), flat = unit(sub(light.c0, scale(aim, dot(light.c0, aim)))), side = cross(flat, aim);
    const by = rollOf(store, light) - light.roll_rad;
    return {centre: add(store.position(light), scale(aim, reach_m)), radius_m: 0.5 * reach_m,
        c0: add(scale(flat, Math.cos(by)), scale(side, Math.sin(by))), c90: sub(scale(side, Math.cos(by)), scale(flat, Math.sin(by)))};
}

// Where a light's roll is shown: as a hand holds it, also where it holds several (key "rolls").
export const rollOf = (store, light) => store.value("rolls")?.get(light.name) ?? store.value(`roll:${light.name}`, light.roll_rad ?? 0);

// Result: a point of the ring, at an angle from C0 towards C90.
export const ringPoint = ({centre, radius_m, c0, c90}, rad) =>
    add(centre, add(scale(c0, radius_m * Math.cos(rad)), scale(c90, radius_m * Math.sin(rad))));

// Result: the angle of the ring's point that is nearest to a place in the picture. near_rad: the angle before.
export function ringAngle(eye, ring, place, near_rad) {
    const aspect = eye.tanX / eye.tanY;
    const off = (rad) => {
        const at = project(eye, ringPoint(ring, rad));
        return at ? Math.hypot((at.x - place.x) * aspect, at.y - place.y) + kSide * Math.abs(wrapped(rad - near_rad)) : Infinity;
    };
    let best = near_rad, least = off(near_rad);
    const look = (rad) => {
        const here = off(rad);
        if (here < least) [best, least] = [rad, here];
    };
    for (let i = 0; i < kSamples; ++i) look(near_rad + 2 * Math.PI * i / kSamples);
    for (let step = Math.PI / kSamples; step > 1e-5; step /= 2) [best + step, best - step].forEach(look);
    return best;
}

export class RollDrag {
    moved = false;

    #store; #eye; #lights; #ring; #before; #turned = 0; #start; #key;

    // lights: the first one's ring is in the hand, and snaps. from: the place where the pointer is.
    constructor(store, eye, lights, {from, reach_m}) {
        this.#store = store;
        this.#eye = eye;
        this.#lights = lights.filter((light) => !light.sun);
        this.#ring = ringOf(store, this.#lights[0], reach_m);
        this.#start = new Map(this.#lights.map((light) => [light.name, rollOf(store, light)]));
        this.#before = ringAngle(eye, this.#ring, from, 0);
        const one = this.#lights.length === 1;
        this.#key = one ? `roll:${this.#lights[0].name}` : "rolls";
        store.hold(this.#key, one ? this.#start.get(this.#lights[0].name) : this.#start);
    }

    from(place) { this.#before = ringAngle(this.#eye, this.#ring, place, this.#before); }
    hold() {}    // no axis but its own

    // place: where the pointer is now. snap: to steps of 15°.
    to(place, snap) {
        const now = ringAngle(this.#eye, this.#ring, place, this.#before);
        this.#turned += wrapped(now - this.#before);
        this.#before = now;
        this.moved = true;
        const first = this.#start.get(this.#lights[0].name);
        const by = snap ? Math.round((first + this.#turned) / kSnap_rad) * kSnap_rad - first : this.#turned;
        this.#send((start) => wrapped(start + by));
    }

    end(cancelled) {
        if (cancelled && this.moved) this.#send((start) => start);
        this.#store.release(this.#key);
    }

    #send(roll) {
        const values = new Map([...this.#start].map(([name, start]) => [name, roll(start)]));
        const [[name, roll_rad]] = values;
        if (values.size === 1) this.#store.set(this.#key, roll_rad, {set_light: {name, roll_rad}});
        else this.#store.set(this.#key, values, setEach(new Map([...values].map(([each, rad]) => [each, {roll_rad: rad}]))));
    }
}
