// A calculation grid over the picture: its outline, and the values where their points are. SVG under the handles.

import {svg} from "./dom.js";
import {add, cross, dot, project, scale, sub, unit} from "./projection.js";
import {pathOf} from "./beam.js";

const kMostTexts = 600;    // more would hide each other and the picture

// "12.5", "480": as the plan has them.
export const valueText = (lx) => lx.toFixed(lx < 9.95 ? 1 : 0);

export class GridView {
    shown = {grid: null, values: null, corner: null};    // corner: the first one of a rectangle that is being drawn

    #store; #handles;
    #node = svg("svg", {id: "grid-view", "aria-hidden": "true"});

    constructor(store, handles, before) {
        this.#store = store;
        this.#handles = handles;
        before.before(this.#node);
        new ResizeObserver(() => this.update()).observe(this.#node.parentElement);
    }

    show(shown) {
        this.shown = {grid: null, values: null, corner: null, ...shown};
        this.update();
    }

    update() {
        const {grid, values, corner} = this.shown;
        this.#node.replaceChildren();
        this.#node.toggleAttribute("hidden", !grid && !corner);
        if (!this.#store.state?.size_px || (!grid && !corner)) return;
        const {left, top, width, height} = this.#handles.frame, eye = this.#handles.eye;
        for (const [side, value] of Object.entries({left, top, width, height})) this.#node.style[side] = `${value}px`;
        const px = (point) => {
            const at = project(eye, point);
            return at && [at.x * width, at.y * height];
        };
        if (corner) {
            const at = px(corner);
            if (at) this.#node.append(svg("circle", {cx: at[0], cy: at[1], r: 5, class: "corner"}));
        }
        if (!grid) return;
        const {corner_m, u_m, v_m} = grid, across = add(corner_m, u_m);
        this.#node.append(svg("path", {d: pathOf([corner_m, across, add(across, v_m), add(corner_m, v_m)].map(px))}));
        if (!values || values.values_lx.length > kMostTexts) return;
        const leftOut = new Set((values.left_out ?? []).map(({point = 0}) => point));
        values.values_lx.forEach((lx, i) => {
            const at = px(values.points_m.slice(3 * i, 3 * i + 3));
            if (!at) return;
            if (leftOut.has(i)) {
                this.#node.append(svg("text", {x: at[0].toFixed(1), y: at[1].toFixed(1), class: "left-out"}, "–"));
                return;
            }
            const mark = lx === values.min_lx ? "least" : lx === values.max_lx ? "greatest" : "";
            this.#node.append(svg("text", {x: at[0].toFixed(1), y: at[1].toFixed(1), class: mark}, valueText(lx)));
        });
    }
}

// Result: {corner_m, u_m, v_m} of the rectangle between two places of a surface, along the world's axes as far as the
// surface lets them; u x v is the normal. above_m: how far before the surface it lies.
export function rectangleOf(first, second, normal, above_m) {
    const along = (axis) => add(axis, scale(normal, -dot(axis, normal)));
    const axis = Math.abs(normal[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1];
    const e = unit(along(axis)), f = cross(normal, e), d = sub(second, first);
    const across = dot(d, e), up = dot(d, f);
    const corner = add(add(add(first, scale(normal, above_m)), scale(e, Math.min(0, across))), scale(f, Math.min(0, up)));
    return {corner_m: corner, u_m: scale(e, Math.abs(across)), v_m: scale(f, Math.abs(up))};
}
