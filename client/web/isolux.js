// The figures of isolux lines over the picture. The server finds their places among the values that it drew the lines by;
// they are shown while the picture is the one that they were found in, and go where anything moves.

import {svg} from "./dom.js";
import {figure, scaleOf} from "./legend.js";

const kRest_ms = 300;       // no picture came for so long: they are asked for
const kAgain_ms = 1000;     // while pictures of the same revision get better
const kLetter_px = 7, kLine_px = 15;

export class IsoluxFigures {
    #store; #connection; #video; #handles;
    #node = svg("svg", {id: "isolux", "aria-hidden": "true"});
    #found = {scene_rev: 0, figures: []};
    #timer = 0;
    #waiting = false;
    #asked_ms = 0;
    #seenRev = 0;           // of the picture that was shown last
    #drawn = "";

    // before: the element that it lies under.
    constructor(store, connection, video, handles, before) {
        this.#store = store;
        this.#connection = connection;
        this.#video = video;
        this.#handles = handles;
        before.before(this.#node);
        new ResizeObserver(() => this.update()).observe(this.#node.parentElement);
        video.addEventListener("shown", () => this.#plan());
        connection.addEventListener("ready", () => { this.#found = {scene_rev: 0, figures: []}; });
    }

    get #wanted() { return scaleOf(this.#store.state)?.isolux === true; }

    // A picture or a state came: asks where neither comes any more, and now and then while a picture gets better.
    #plan() {
        clearTimeout(this.#timer);
        if (!this.#wanted) return;
        const rests = this.#video.shownRev === this.#seenRev;
        this.#seenRev = this.#video.shownRev;
        if (rests && performance.now() - this.#asked_ms > kAgain_ms) this.#ask();
        else this.#timer = setTimeout(() => this.#ask(), kRest_ms);
    }

    async #ask() {
        if (this.#waiting || !this.#connection.live) return;
        this.#waiting = true;
        this.#asked_ms = performance.now();
        try {
            this.#found = (await this.#connection.request({isolux: {}})).isolux ?? this.#found;
        } catch {
            // the connection has ended
        }
        this.#waiting = false;
        this.update();
    }

    update() {
        if (!this.#store.state?.size_px) return;
        const {left, top, width, height} = this.#handles.frame;
        const shown = this.#wanted && this.#found.scene_rev === this.#store.state.scene_rev ? this.#found.figures ?? [] : [];
        if (this.#wanted && this.#found.scene_rev !== this.#store.state.scene_rev && !this.#waiting) this.#plan();
        const signature = JSON.stringify([left, top, width, height, shown]);
        if (signature === this.#drawn) return;
        this.#drawn = signature;
        for (const [side, value] of Object.entries({left, top, width, height})) this.#node.style[side] = `${value}px`;
        const taken = [];
        const fits = (box) => box.x >= 0 && box.y >= 0 && box.x + box.wide <= width && box.y + box.high <= height
            && !taken.some((other) => box.x < other.x + other.wide && other.x < box.x + box.wide && box.y < other.y + other.high && other.y < box.y + box.high);
        this.#node.replaceChildren(...shown.flatMap(({value = 0, x = 0, y = 0}) => {
            const text = svg("text", {x: x * width, y: y * height + 4, "data-value": value}), wide = kLetter_px * (figure(value).length + 1);
            const box = {x: x * width - wide / 2, y: y * height - kLine_px / 2, wide, high: kLine_px};
            if (!fits(box)) return [];
            taken.push(box);
            text.textContent = figure(value);
            return [text];
        }));
    }
}
