// The camera in the hand: drag orbits, Ctrl-drag (or two fingers) pans, wheel and pinch dolly; arrow keys, with shift, + and -
// do the same. The middle button orbits, with Shift it pans, with Ctrl it dollies. Held, the right button looks around, and
// keys walk: walk.js.

import {pageRole} from "./control.js";
import {add, length, scale, sub} from "./projection.js";
import {Walk, look} from "./walk.js";

const kOrbitRadPerPx = 0.006;
const kDollyPerNotch = 1.12;
const kDollyPerPx = 1.006;
const kWheelNotchPx = 100;
const kMaxPitchRad = 1.55;        // just short of the poles, where "up" would flip
const kMinDistance_m = 0.02;
const kWheelRestMs = 250;         // the wheel counts as a hand for this long
const kKeyStepPx = 24;

// Eye in spherical coordinates around the target; yaw 0 on +Z, pitch up.
function toSpherical(eye, target) {
    const d = sub(eye, target);
    const r = Math.max(length(d), kMinDistance_m);
    return {r, yaw: Math.atan2(d[0], d[2]), pitch: Math.asin(Math.max(-1, Math.min(1, d[1] / r)))};
}

function fromSpherical({r, yaw, pitch}, target) {
    return add(target, scale([Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)], r));
}

export function orbit({eye, target}, dx_px, dy_px) {
    const s = toSpherical(eye, target);
    s.yaw -= dx_px * kOrbitRadPerPx;
    s.pitch = Math.max(-kMaxPitchRad, Math.min(kMaxPitchRad, s.pitch + dy_px * kOrbitRadPerPx));
    return {target, eye: fromSpherical(s, target)};
}

// The same about any point, which stays where it is in the picture. box: {min_m, max_m} that an eye inside does not leave.
export function orbitAbout(pose, pivot, dx_px, dy_px, box) {
    const {yaw, pitch} = toSpherical(pose.eye, pose.target), a = -dx_px * kOrbitRadPerPx;
    const b = Math.max(-kMaxPitchRad, Math.min(kMaxPitchRad, pitch + dy_px * kOrbitRadPerPx)) - pitch;
    const ahead = [Math.sin(yaw + a), 0, Math.cos(yaw + a)], right = [ahead[2], 0, -ahead[0]];
    const turned = (from) => {
        const v = sub(from, pivot), x = Math.cos(a) * v[0] + Math.sin(a) * v[2], z = Math.cos(a) * v[2] - Math.sin(a) * v[0];
        const back = x * ahead[0] + z * ahead[2], aside = x * right[0] + z * right[2];
        const level = back * Math.cos(b) - v[1] * Math.sin(b);
        return add(pivot, [aside * right[0] + level * ahead[0], back * Math.sin(b) + v[1] * Math.cos(b), aside * right[2] + level * ahead[2]]);
    };
    const eye = turned(pose.eye), target = turned(pose.target), stays = inside(pose.eye, box) ? withinBox(pivot, eye, box) : eye;
    return {eye: stays, target: add(target, sub(stays, eye))};
}

const inside = (point, box) => Boolean(box) && point.every((x, i) => x >= box.min_m[i] && x <= box.max_m[i]);

// Result: `to`, or where the way there from the pivot leaves the box.
function withinBox(pivot, to, box) {
    const way = sub(to, pivot), kKept = 0.98;
    const share = way.reduce((least, x, i) => (x === 0 ? least : Math.min(least, Math.max(0, ((x > 0 ? box.max_m : box.min_m)[i] - pivot[i]) / x))), 1);
    return share < 1 ? add(pivot, scale(way, Math.max(kKept * share, kMinDistance_m / Math.max(length(way), 1e-9)))) : to;
}

// The point under the pointer, at the distance of the target, stays under it.
export function pan({eye, target}, fov_rad, height_px, dx_px, dy_px) {
    const {r, yaw, pitch} = toSpherical(eye, target);
    const metresPerPx = (2 * r * Math.tan(fov_rad / 2)) / Math.max(1, height_px);
    const right = [Math.cos(yaw), 0, -Math.sin(yaw)];
    const up = [-Math.sin(yaw) * Math.sin(pitch), Math.cos(pitch), -Math.cos(yaw) * Math.sin(pitch)];
    const shift = add(scale(right, -dx_px * metresPerPx), scale(up, dy_px * metresPerPx));
    return {eye: add(eye, shift), target: add(target, shift)};
}

export function dolly({eye, target}, factor) {
    const d = sub(eye, target);
    return {target, eye: add(target, scale(d, Math.max(factor, kMinDistance_m / Math.max(length(d), 1e-9))))};
}

// Result: the pose that looks at the points from where it is, so far off that they fill the picture. least_m: of their
// radius.
export function framing({eye, target}, fov_rad, points, least_m) {
    const centre = scale(points.reduce(add), 1 / points.length);
    const radius = Math.max(least_m, ...points.map((point) => length(sub(point, centre))));
    const back = sub(eye, target), far = 1.2 * radius / Math.sin(fov_rad / 2);
    return {target: centre, eye: add(centre, scale(back, far / Math.max(length(back), 1e-9)))};
}

export class CameraHand {
    #store;
    #pointers = new Map();    // id -> {x, y, button}
    #wheelTimer = 0;
    #walk = new Walk(() => this.pose, (pose) => this.set(pose));
    #leaves; #under;
    #pivot = null;            // that the drag turns about; null: the target

    // leaves(event): whether a press on the picture is somebody else's. under(event): the point that lies there, null where none
    // is known.
    constructor(store, elements, leaves, under) {
        this.#store = store;
        this.#leaves = leaves;
        this.#under = under;
        for (const element of elements) this.#listen(element);
    }

    get pose() {
        const {eye, target} = this.#store.state.camera;
        return this.#store.value("camera", {eye, target});
    }

    set(pose) {
        if (pageRole === "viewer" || this.#store.cameraIsOthers) return;
        this.#store.set("camera", pose, {set_camera: {eye_m: pose.eye, target_m: pose.target}});
    }

    // To a camera of the scene, with its field of view.
    take({eye, target, fov_rad}) {
        this.set({eye, target});
        this.#store.set("fov", fov_rad, {set_camera: {fov_rad}});
    }

    #hold() { this.#store.hold("camera", this.pose); }
    #release() { this.#store.release("camera"); }

    #listen(element) {
        const ready = () => this.#store.state?.camera;
        element.addEventListener("pointerdown", (event) => {
            if (!ready() || event.button > 2 || (this.#leaves(event) && this.#pointers.size === 0)) return;
            event.preventDefault();
            element.focus({preventScroll: true});
            element.setPointerCapture(event.pointerId);
            this.#hold();
            if (this.#pointers.size === 0) this.#pivot = this.#under(event);
            this.#pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, button: event.button});
            if (event.button === 2) this.#walk.begin();
            element.classList.add("grabbed");
        });
        element.addEventListener("contextmenu", (event) => event.preventDefault());
        element.addEventListener("pointermove", (event) => this.#move(element, event));
        const end = (event) => {
            if (!this.#pointers.delete(event.pointerId) || this.#pointers.size) return;
            element.classList.remove("grabbed");
            this.#walk.end();
            this.#release();
        };
        element.addEventListener("pointerup", end);
        element.addEventListener("pointercancel", end);
        element.addEventListener("contextmenu", (event) => event.preventDefault());
        element.addEventListener("wheel", (event) => {
            if (!ready()) return;
            event.preventDefault();
            const notches = (event.deltaMode === 1 ? event.deltaY * 33 : event.deltaY) / kWheelNotchPx;
            if (this.#walk.active) return this.#walk.faster(-notches);
            this.#hold();
            this.set(dolly(this.pose, kDollyPerNotch ** Math.max(-3, Math.min(3, notches))));
            clearTimeout(this.#wheelTimer);
            this.#wheelTimer = setTimeout(() => { if (!this.#pointers.size) this.#release(); }, kWheelRestMs);
        }, {passive: false});
        element.addEventListener("keydown", (event) => {
            const [dx, dy] = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key] ?? [];
            const zoom = {"+": 1 / kDollyPerNotch, "=": 1 / kDollyPerNotch, "-": kDollyPerNotch}[event.key];
            if (!ready() || event.ctrlKey || event.metaKey || event.altKey || (dx === undefined && !zoom)) return;
            event.preventDefault();
            this.set(zoom ? dolly(this.pose, zoom)
                : this.#dragged(element, event.shiftKey, dx * kKeyStepPx, dy * kKeyStepPx));
        });
    }

    #dragged(element, panning, dx_px, dy_px) {
        if (!panning) return this.#pivot && this.#pointers.size > 0 ? orbitAbout(this.pose, this.#pivot, dx_px, dy_px, this.#store.state.bounds) : orbit(this.pose, dx_px, dy_px);
        return pan(this.pose, this.#store.state.camera.fov_rad, element.clientHeight, dx_px, dy_px);
    }

    #move(element, event) {
        const last = this.#pointers.get(event.pointerId);
        if (!last) return;
        const dx = event.clientX - last.x, dy = event.clientY - last.y;
        if (this.#pointers.size === 2) {
            const other = [...this.#pointers].find(([id]) => id !== event.pointerId)[1];
            const before = Math.hypot(last.x - other.x, last.y - other.y);
            const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
            const moved = this.#dragged(element, true, dx / 2, dy / 2);
            this.set(before > 10 && after > 10 ? dolly(moved, before / after) : moved);
        } else if (this.#pointers.size === 1) {
            this.set(last.button === 2 ? look(this.pose, dx, dy)
                : last.button === 1 && event.ctrlKey ? dolly(this.pose, kDollyPerPx ** dy)
                    : this.#dragged(element, last.button === 1 ? event.shiftKey : event.ctrlKey || event.metaKey, dx, dy));
        }
        last.x = event.clientX;
        last.y = event.clientY;
    }
}
