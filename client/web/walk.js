// Walking through the scene while the right button is held: W A S D, Q and E for down and up, Shift for three times as
// fast; the wheel sets the speed.

import {add, length, scale, sub, unit} from "./projection.js";

const kLookRadPerPx = 0.004;
const kMaxPitchRad = 1.55;                 // as of an orbit
const kSpeeds_mps = [0.1, 50];
const kFasterPerNotch = 1.25;
const kRun = 3;
const kLongestStepS = 0.1;                 // of a picture that came late
const kWays = {KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0]};

// The eye stays, what it looks at turns around it.
export function look({eye, target}, dx_px, dy_px) {
    const d = sub(target, eye), r = length(d);
    const yaw = Math.atan2(d[0], d[2]) - dx_px * kLookRadPerPx;
    const pitch = Math.max(-kMaxPitchRad, Math.min(kMaxPitchRad, Math.asin(Math.max(-1, Math.min(1, d[1] / r))) - dy_px * kLookRadPerPx));
    return {eye, target: add(eye, scale([Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)], r))};
}

// way: right, up and ahead, −1..1 each. Ahead is where the camera looks; up is the world's.
export function walked({eye, target}, way, by_m) {
    const ahead = unit(sub(target, eye)), yaw = Math.atan2(ahead[0], ahead[2]);
    const right = [-Math.cos(yaw), 0, Math.sin(yaw)];
    const sum = add(add(scale(right, way[0]), [0, way[1], 0]), scale(ahead, way[2]));
    if (length(sum) < 1e-9) return {eye, target};
    const shift = scale(unit(sum), by_m);
    return {eye: add(eye, shift), target: add(target, shift)};
}

export class Walk {
    active = false;
    speed_mps = 2;
    #pose; #set;
    #keys = new Set();
    #last_ms = 0;
    #frame = 0;
    #runs = false;

    // pose(): where the camera is; set(pose): moves it.
    constructor(pose, set) {
        this.#pose = pose;
        this.#set = set;
        // Before others that listen to letters.
        addEventListener("keydown", (event) => this.#key(event, true), true);
        addEventListener("keyup", (event) => this.#key(event, false), true);
        addEventListener("blur", () => this.end());
    }

    begin() { this.active = true; }

    end() {
        this.active = false;
        this.#keys.clear();
        cancelAnimationFrame(this.#frame);
        this.#frame = 0;
    }

    faster(notches) {
        this.speed_mps = Math.max(kSpeeds_mps[0], Math.min(kSpeeds_mps[1], this.speed_mps * kFasterPerNotch ** notches));
    }

    #key(event, down) {
        if (this.active && event.key === "Shift") this.#runs = down;
        if (!this.active) return;
        event.stopImmediatePropagation();    // no key means anything else meanwhile
        if (!(event.code in kWays)) return;
        event.preventDefault();
        if (down) this.#keys.add(event.code);
        else this.#keys.delete(event.code);
        this.#runs = event.shiftKey;
        if (this.#keys.size && !this.#frame) {
            this.#last_ms = performance.now();
            this.#frame = requestAnimationFrame((now) => this.#step(now));
        }
    }

    #step(now_ms) {
        this.#frame = 0;
        if (!this.active || !this.#keys.size) return;
        const seconds = Math.min(kLongestStepS, Math.max(0, (now_ms - this.#last_ms) / 1000));
        this.#last_ms = now_ms;
        const way = [...this.#keys].map((code) => kWays[code]).reduce(add, [0, 0, 0]);
        this.#set(walked(this.#pose(), way, this.speed_mps * (this.#runs ? kRun : 1) * seconds));
        this.#frame = requestAnimationFrame((next) => this.#step(next));
    }
}
