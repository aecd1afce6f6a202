// The strip under the picture: frames shown, response time; while the renderer's steps are shown also what a frame takes.

import {h, setText, formatNumber} from "./dom.js";
import {saveCapture} from "./capture.js";

const kWindowMs = 1000;
const kRefreshMs = 250;
const kResponseFadeMs = 5000;
const kTransportPollMs = 500;

// Time from sending a change to the first picture that contains it, seen from here.
class ResponseMeter {
    #sent = [];      // {sent_ms, scene_rev}, waiting for their picture
    #shown = [];     // {time_ms, scene_rev}, the newest pictures
    last = null;     // {response_ms, time_ms}

    applied({sent_ms, scene_rev}) {
        // The picture may have come before the answer.
        const picture = this.#shown.find((shown) => shown.scene_rev >= scene_rev && shown.time_ms >= sent_ms);
        if (picture) this.last = {response_ms: picture.time_ms - sent_ms, time_ms: picture.time_ms};
        else if (!this.#shown.length || this.#shown.at(-1).scene_rev < scene_rev) this.#sent.push({sent_ms, scene_rev});
    }

    shown(scene_rev) {
        const time_ms = performance.now();
        this.#shown = [...this.#shown.slice(-15), {time_ms, scene_rev}];
        const seen = this.#sent.filter((sent) => sent.scene_rev <= scene_rev);
        if (!seen.length) return;
        this.#sent = this.#sent.filter((sent) => sent.scene_rev > scene_rev);
        this.last = {response_ms: time_ms - seen.at(-1).sent_ms, time_ms};
    }

    reset() {
        this.#sent = [];
        this.#shown = [];
    }
}

// What the picture lacks while the transport of a new scene is traced: asked for until every bounce is there.
class TransportWatch {
    text = "";
    ready = false;

    constructor(store, connection) {
        let scene = null, asking = false;
        connection.addEventListener("ready", () => { scene = null; });
        setInterval(async () => {
            const {scene: now, technique} = store.state ?? {};
            if (now !== scene) this.ready = false, scene = now;
            if (asking || this.ready || !store.state) return;
            asking = true;
            const {stats} = await connection.request({stats: {}}).catch(() => ({}));
            asking = false;
            if (!stats || now !== scene) return;
            this.ready = stats.transport_ready || technique !== "default";
            const links = stats.transport?.links_per_surfel ?? 0;
            this.text = this.ready ? "" : links ? "bounced light is coarse so far" : "direct light so far";
        }, kTransportPollMs);
    }
}

// format: where the size is told, and the codec in its tooltip. Result: what the picture lacks.
export function statsStrip(store, video, connection, node, format) {
    const cell = (name, title) => {
        const value = h("b");
        node.append(h("span", {class: "stat", title}, value, h("span", {class: "faint"}, name)));
        return value;
    };
    const fps = cell("fps", "Pictures shown in the last second; none while nothing changes");
    const response = cell("ms until seen", "From sending a change to the picture that contains it");
    const render = cell("ms render", "Queue drained to picture in memory, on the server");
    const encode = cell("ms encode", "On the server");
    const size = cell("kB", "Size of the last frame");
    const gaps = cell("gaps", "Frames missing in the sequence; each asks for a key frame");
    const still = h("button", {type: "button", class: "quiet", id: "save", title: "Save the picture as PNG, without video compression",
        onclick: () => saveStill(store, connection)}, "Save still");
    node.append(h("span", {class: "grow"}), still);

    const transport = new TransportWatch(store, connection);
    const responses = new ResponseMeter();
    let frames = [], last = null;
    connection.addEventListener("applied", (event) => responses.applied(event.detail));
    connection.addEventListener("ready", () => responses.reset());
    video.addEventListener("shown", (event) => {
        last = event.detail;
        frames.push(performance.now());
        responses.shown(last.scene_rev);
    });
    setInterval(() => {
        const now = performance.now();
        frames = frames.filter((time_ms) => now - time_ms < kWindowMs);
        const idle = last !== null && frames.length === 0;
        setText(fps, idle ? "idle" : String(frames.length));
        setText(fps.nextSibling, idle ? "" : "fps");
        node.dataset.mode = video.mode;    // without H.264 nothing is known of a frame
        setText(gaps, String(video.gaps));
        gaps.parentNode.classList.toggle("bad", video.gaps > 0);
        if (!last) return;
        const recent = responses.last && now - responses.last.time_ms < kResponseFadeMs;
        setText(response, responses.last ? formatNumber(responses.last.response_ms, 0) : "–");
        response.classList.toggle("old", !recent);
        if (video.mode === "h264") {
            setText(render, formatNumber(last.render_us / 1000, 1));
            setText(encode, formatNumber(last.encode_us / 1000, 1));
            setText(size, formatNumber(last.bytes / 1000, 1));
        }
        const name = {h264: "H.264", mjpeg: "MJPEG", still: "Stills"}[video.mode];
        const {encoder, lane} = video.mode === "h264" ? video.stream : {};
        const [short = "", long = ""] = video.lacks ?? [];
        setText(format, [video.size.join(" × "), transport.text, short && `JPEG: ${short}`].filter(Boolean).join(" · "));
        format.title = [name, encoder, lane && `${lane} lane`, long].filter(Boolean).join(" · ");
    }, kRefreshMs);
    return transport;
}

async function saveStill(store, connection) {
    const reply = await saveCapture(connection, store, {format: "png"}).catch(() => ({}));
    if (reply.capture) return;
    const detail = reply.result ?? {code: "disconnected", message: "The still was not saved: there is no connection."};
    connection.dispatchEvent(new CustomEvent("refused", {detail}));
}
