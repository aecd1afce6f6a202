// The beam of the selected light: where its 50 % and 10 % edges lie on the surfaces, as the server traces them, and lines
// from the light to them. Drawn as SVG under the handles.

import {svg} from "./dom.js";
import {length, project, sub} from "./projection.js";

const kLines = 4;       // from the light to its 50 % edge
const kJump = 0.25;     // neighbours farther apart than this share of their distance lie on different surfaces

// Result: an SVG path through points of the picture. It begins anew behind one that is null, and where joined(i) says that
// point i is not joined to the one before it; it is closed where all are joined.
export function pathOf(points, joined = () => true) {
    let path = "", whole = points.length > 2 && joined(0);
    points.forEach((point, i) => {
        const open = i > 0 && points[i - 1] && joined(i);
        if (point) path += `${open ? "L" : "M"}${point[0].toFixed(1)},${point[1].toFixed(1)}`;
        whole &&= Boolean(point) && (i === 0 || Boolean(open));
    });
    return whole ? `${path}Z` : path;
}

export class BeamView {
    shown = false;     // until somebody asks for it

    #store; #connection; #handles;
    #node = svg("svg", {id: "beam", "aria-hidden": "true"});
    #paths = new Map();
    #asked = ""; #waiting = false;
    #beam = null;      // of #beam.key

    constructor(store, connection, handles, before) {
        this.#store = store;
        this.#connection = connection;
        this.#handles = handles;
        before.before(this.#node);
        new ResizeObserver(() => this.update()).observe(this.#node.parentElement);
        connection.addEventListener("ready", () => { this.#asked = ""; });
    }

    toggle() {
        this.shown = !this.shown;
        this.update();
    }

    #light() {
        const light = this.shown && this.#store.selected?.kind === "light" ? this.#store.light(this.#store.selected.name) : undefined;
        return light?.sun ? undefined : light;
    }

    update() {
        if (!this.#store.state?.size_px) return;
        const light = this.#light();
        if (light) this.#ask(light);
        const edges = light && this.#beam?.light === light.name ? this.#beam.edges : [];
        const {left, top, width, height} = this.#handles.frame, eye = this.#handles.eye;
        for (const [side, value] of Object.entries({left, top, width, height})) this.#node.style[side] = `${value}px`;    // what is beside the picture is cut off
        const px = (point) => {
            const at = project(eye, point);
            return at && [at.x * width, at.y * height];
        };
        const drawn = new Map();
        for (const {ratio, points_m = [], hit = []} of edges) {
            const world = hit.map((_, i) => points_m.slice(3 * i, 3 * i + 3)), points = hit.map((met, i) => (met ? px(world[i]) : null));
            const joined = (i) => length(sub(world[i], world.at(i - 1))) < kJump * length(sub(world[i], light.position));
            drawn.set(ratio === 0.5 ? "beam" : "field", pathOf(points, joined));
            if (ratio !== 0.5 || hit.length < kLines) continue;
            const from = px(this.#store.position(light));
            const lines = Array.from({length: kLines}, (_, i) => points[Math.floor(i * hit.length / kLines)]).filter((to) => to && from);
            drawn.set("cone", lines.map((to) => pathOf([from, to])).join(""));
        }
        for (const name of ["cone", "field", "beam"]) {
            if (!this.#paths.has(name)) {
                this.#paths.set(name, svg("path", {class: name}));
                this.#node.append(this.#paths.get(name));
            }
            this.#paths.get(name).setAttribute("d", drawn.get(name) ?? "");
        }
    }

    // One question at a time; what has changed meanwhile is asked for next.
    async #ask(light) {
        const key = JSON.stringify([light.name, light.position, light.aim, light.c0, light.profile, light.max_cd, this.#store.state.scene]);
        if (key === this.#asked || this.#waiting) return;
        this.#asked = key;
        this.#waiting = true;
        try {
            this.#beam = (await this.#connection.request({beam: {light: light.name}})).beam ?? null;
        } catch {
            this.#beam = null;
        }
        this.#waiting = false;
        this.update();
    }
}
