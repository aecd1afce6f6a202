// The tools over the picture, as buttons and as the keys that people know: several, move (W, G), turn (E, R), add (N),
// beam (B), frame (F); Ctrl+D duplicates, Delete removes.

import {h, formatNumber, setText, onPageKey} from "./dom.js";
import {pageRole} from "./control.js";
import {framing} from "./camera.js";
import {duplicate, freeName, removeChosen} from "./many.js";
import {add, length, scale, sub} from "./projection.js";

const kNeighbours = 3;         // whose distance shows while a light is added
const kBefore_m = 0.05;        // a new light is so far before the surface that was clicked
const kLeastFrame_m = 0.75;    // radius of what one light fills the picture with
const kHints = {
    move: "Move: the pointer moves the selection, click or Enter puts it there, Esc takes it back; X Y Z hold an axis, Ctrl snaps to 0.1 m",
    turn: "Turn: the aim follows the pointer, click or Enter keeps it, Esc takes it back; X Y Z hold an axis, Ctrl snaps to 0.1 m",
    add: "Add: click the surface that the new light shall be on; Esc ends",
    several: "Several: presses on lights select beside the others, a drag draws a rectangle",
};

export class Tools {
    #store; #connection; #handles; #cameraHand; #beam;
    #buttons = {};
    #mode = "";            // of kHints
    #spacing = "";         // to the neighbours of where a light would be added
    #hint = h("p", {id: "tool-hint", role: "status", hidden: true});

    // screen: where the tools lie over the picture.
    constructor(store, connection, handles, cameraHand, beam, screen) {
        this.#store = store;
        this.#connection = connection;
        this.#handles = handles;
        this.#cameraHand = cameraHand;
        this.#beam = beam;
        const button = (name, text, title, run) => {
            this.#buttons[name] = h("button", {type: "button", class: "quiet", id: `tool-${name}`, title, onclick: run}, text);
            return this.#buttons[name];
        };
        const bar = h("div", {id: "tools", role: "toolbar", "aria-label": "Tools of the picture"},
            button("several", "Several", "Select several: presses on lights, or a rectangle (shift does the same)", () => this.#several()),
            button("move", "Move", "Move the selection (W or G)", () => this.#follow("move")),
            button("turn", "Turn", "Turn the selection (E or R)", () => this.#follow("turn")),
            button("add", "Add", "Add a light where the picture is clicked (N)", () => this.#add()),
            button("beam", "Beam", "Show the beam of the selected light: 50 % solid, 10 % dashed (B)", () => this.#toggleBeam()),
            button("frame", "Frame", "Bring the selection into the middle of the picture (F)", () => this.#frame()));
        bar.addEventListener("keydown", (event) => {
            const step = {ArrowRight: 1, ArrowLeft: -1}[event.key], all = Object.values(this.#buttons).filter((each) => !each.hidden);
            if (!step) return;
            event.preventDefault();
            event.stopPropagation();
            all[(all.indexOf(document.activeElement) + step + all.length) % all.length].focus();
        });
        if (pageRole === "viewer") for (const name of ["several", "move", "turn", "add"]) this.#buttons[name].hidden = true;
        screen.querySelector("#veil").before(bar, this.#hint);
        onPageKey((event) => this.#key(event));
    }

    update() {
        const pressed = {several: this.#handles.several, move: this.#mode === "move", turn: this.#mode === "turn", add: this.#mode === "add", beam: this.#beam.shown};
        for (const [name, on] of Object.entries(pressed)) this.#buttons[name].setAttribute("aria-pressed", String(on));
        const mode = this.#mode || (this.#handles.several ? "several" : "");
        this.#hint.hidden = mode === "";
        setText(this.#hint, [kHints[mode] ?? "", mode === "add" ? this.#spacing : ""].filter(Boolean).join(" · "));
    }

    // pick: what lies under the pointer.
    #tellSpacing(pick) {
        const place = pick && add(pick.point_m, scale(pick.normal, kBefore_m));
        const near = place ? this.#store.state.lights.filter((light) => !light.sun).map(({name, position}) => ({name, away_m: length(sub(place, position))}))
            .sort((a, b) => a.away_m - b.away_m).slice(0, kNeighbours) : [];
        this.#spacing = near.map(({name, away_m}) => `${formatNumber(away_m, 2)} m to ${name}`).join(", ");
        this.update();
    }

    #set(mode) {
        this.#mode = mode;
        this.#handles.cross("adding", mode === "add");
        this.#spacing = "";
        this.#handles.onHover = mode === "add" ? (pick) => this.#tellSpacing(pick) : null;
        this.#handles.onPlace = mode === "add" ? (place, event) => this.#addAt(place, event.shiftKey) : null;
        this.update();
    }

    #several() {
        this.#handles.several = !this.#handles.several;
        this.update();
    }

    #toggleBeam() {
        this.#beam.toggle();
        this.update();
    }

    #follow(mode) {
        this.#handles.setAiming(false);
        this.#set("");
        if (this.#handles.follow(mode === "turn", () => this.#set(""))) this.#set(mode);
    }

    #add() {
        if (pageRole === "viewer") return;
        this.#handles.setAiming(false);
        this.#set(this.#mode === "add" ? "" : "add");
    }

    // On the surface, aimed along its normal: down from ceilings, out of walls. Like the selected light, else the first
    // of the built-in luminaires.
    async #addAt(place, again) {
        if (!again) this.#set("");
        const pick = await this.#handles.pickAt(place);
        if (!pick?.hit) return;
        const like = this.#store.selected?.kind === "light" ? this.#store.light(this.#store.selected.name) : undefined;
        const name = this.#store.light("light 1") || this.#store.group("light 1") ? freeName(this.#store, "light") : "light 1";
        const light = {name, position_m: add(pick.point_m, scale(pick.normal, kBefore_m)), aim: pick.normal};
        const command = like && !like.sun ? {light, like: like.name} : {light: {...light, profile: {name: this.#store.state.profiles[0]}}};
        if ((await this.#connection.command({add_light: command}))?.code === "ok") this.#store.select("light", name);
    }

    #frame() {
        const {camera} = this.#store.state, chosen = this.#store.chosen.filter((light) => !light.sun);
        const lights = chosen.length ? chosen : this.#store.state.lights.filter((light) => !light.sun);
        if (lights.length === 0) return;
        this.#cameraHand.set(framing(this.#cameraHand.pose, camera.fov_rad, lights.map((light) => this.#store.position(light)), kLeastFrame_m));
    }

    #key(event) {
        if (event.key === "Escape" && this.#mode === "add") return this.#set("");
        if (event.target instanceof Element && event.target.closest("input, select, textarea")) return;
        if (event.altKey || !this.#store.state) return;
        const letter = event.key.toLowerCase();
        if (event.ctrlKey || event.metaKey) {
            if (letter !== "d" || pageRole === "viewer") return;
            event.preventDefault();
            duplicate(this.#store, this.#connection, this.#handles.eye.right);
        } else if ((event.key === "Delete" || event.key === "Backspace") && pageRole !== "viewer" && !this.#handles.busy) {
            removeChosen(this.#store, this.#connection);
        } else if (!this.#handles.busy) {
            ({w: () => this.#follow("move"), g: () => this.#follow("move"), e: () => this.#follow("turn"), r: () => this.#follow("turn"),
                n: () => this.#add(), f: () => this.#frame(), b: () => this.#toggleBeam()})[letter]?.();
        }
    }
}
