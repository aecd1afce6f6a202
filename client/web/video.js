// The picture: H.264 access units from the WebSocket through WebCodecs onto the canvas; where that is missing, MJPEG in
// an <img>; where that fails too, PNG stills after each change.
// Events: "shown" ({scene_rev, final, ...}) for each picture drawn, "mode" when the way of showing changed.

import {MjpegStream} from "./mjpeg.js";

const kHeaderBytes = 32;
const kMaxDecoderErrors = 3;     // within kErrorWindowMs, then MJPEG
const kErrorWindowMs = 10000;
const kStillMinIntervalMs = 250;
const kMjpegRetryMs = 1000;
const kMjpegWatchMs = 200;

// The header of protocol/schema/frame_header.h; null where the message is no video frame of a known version.
export function parseFrameHeader(buffer) {
    if (buffer.byteLength <= kHeaderBytes) return null;
    const view = new DataView(buffer);
    if (view.getUint8(0) !== 2 || view.getUint8(1) !== 1) return null;
    const flags = view.getUint8(2);
    return {
        key: (flags & 1) !== 0, final: (flags & 2) !== 0, lane: view.getUint8(3),
        seq: view.getUint32(4, true), scene_rev: view.getUint32(8, true),
        rendered_us: Number(view.getBigUint64(16, true) / 1000n),
        render_us: view.getUint32(24, true), encode_us: view.getUint32(28, true),
        bytes: buffer.byteLength,
    };
}

// Why the picture is not H.264: in few words, and what can be done about it.
const kWhy = {
    browser: ["this browser has no H.264", "This browser has no WebCodecs: pictures are JPEGs."],
    insecure: ["H.264 needs https or localhost",
        "Browsers decode H.264 only from https or localhost: pictures are JPEGs. Open the page as https (goniod --tls-cert), or by a tunnel as localhost."],
    decoder: ["this browser could not decode H.264", "This browser could not decode the server's H.264: pictures are JPEGs."],
    server: ["this server makes no H.264", "This server has no encoder for H.264: pictures are JPEGs."],
    stream: ["no stream came through", "No stream of pictures came through: single pictures are fetched."],
};

export class Video extends EventTarget {
    mode = "VideoDecoder" in window ? "h264" : "mjpeg";    // "h264" | "mjpeg" | "still"
    framesDecoded = 0;
    gaps = 0;
    shownRev = 0;
    shownFinal = false;    // nothing newer follows what is shown, until something changes
    why = "VideoDecoder" in window ? "" : window.isSecureContext ? "browser" : "insecure";    // it is not H.264: a key of kWhy; "": it is

    #connection; #canvas; #image; #context;
    #decoder = null;
    #config = null;
    #headers = new Map();    // chunk timestamp -> header
    #nextTimestamp = 0;
    #lastSeq = null;
    #needKey = true;
    #errors = [];
    #stillTimer = 0;
    #imageErrors = 0;
    #watch = 0;
    #stream;    // of a server that asks for a token

    constructor(connection, canvas, image) {
        super();
        this.#connection = connection;
        this.#canvas = canvas;
        this.#image = image;
        this.#stream = new MjpegStream(image);
        this.#context = canvas.getContext("2d", {alpha: false});
        connection.video = this.mode === "h264";
        connection.addEventListener("ready", (event) => this.#start(event.detail.video_config));
        connection.addEventListener("config", (event) => this.#start(event.detail));
        connection.addEventListener("video", (event) => this.#receive(event.detail));
        connection.addEventListener("changed", () => { if (this.mode === "still") this.#fetchStill(); });
        connection.addEventListener("status", (event) => { if (event.detail.state === "waiting") this.#pause(); });
        image.addEventListener("error", () => this.#imageFailed());
        image.addEventListener("load", () => this.#imageLoaded());
    }

    // Why the picture is not H.264, [in few words, in a sentence]; null where it is.
    get lacks() { return kWhy[this.why] ?? null; }
    // The encoder and the lane of the frames, as the server tells them.
    get stream() { return {encoder: this.#config?.encoder ?? "", lane: this.#config?.lane ?? ""}; }
    get size() {
        return this.mode === "h264" ? [this.#canvas.width, this.#canvas.height]
            : [this.#image.naturalWidth, this.#image.naturalHeight];
    }

    async #start(config) {
        if (config) this.#config = config;
        if (config?.encoder === "mjpeg" && this.mode === "h264") return this.#setMode("mjpeg", "server");
        this.#canvas.hidden = this.mode !== "h264";
        this.#image.hidden = this.mode === "h264";
        if (this.mode === "mjpeg") {
            if (this.#connection.token) this.#stream.start(this.#connection.token);
            else this.#image.src = `/v1/mjpeg?${Date.now()}`;
            this.#watchStream();
        }
        else if (this.mode === "still") this.#fetchStill();
        else this.#configure();
    }

    #configure() {
        if (!this.#config?.codec) return;
        if (this.#decoder && this.#decoder.state !== "closed") this.#decoder.close();
        this.#headers.clear();
        this.#lastSeq = null;
        this.#needKey = true;
        const decoder = new VideoDecoder({
            output: (frame) => this.#show(frame),
            error: (error) => { if (this.#decoder === decoder) this.#failed(error); },
        });
        this.#decoder = decoder;
        try {
            decoder.configure({
                codec: this.#config.codec, codedWidth: this.#config.width_px, codedHeight: this.#config.height_px,
                optimizeForLatency: true,
            });
        } catch (error) {
            this.#failed(error);
        }
    }

    #receive(buffer) {
        const header = parseFrameHeader(buffer);
        if (!header || this.mode !== "h264") return;
        const gap = this.#lastSeq !== null && header.seq !== ((this.#lastSeq + 1) >>> 0);
        this.#lastSeq = header.seq;
        if (gap && !header.key) {
            // The decoder would go on without a complaint, with a broken picture.
            this.gaps++;
            this.#needKey = true;
            this.#connection.post({request_keyframe: {}});
        }
        if ((this.#needKey && !header.key) || this.#decoder?.state !== "configured") {
            this.#acknowledge(header);    // not shown, but its credit goes back
            // A stream that was joined in its middle: the server asks its encoder at most once a second.
            if (!gap && this.#needKey) this.#connection.post({request_keyframe: {}});
            return;
        }
        this.#needKey = false;
        const timestamp = this.#nextTimestamp++;
        header.received_ms = performance.now();
        this.#headers.set(timestamp, header);
        this.#decoder.decode(new EncodedVideoChunk({
            type: header.key ? "key" : "delta", timestamp, data: new Uint8Array(buffer, kHeaderBytes),
        }));
    }

    #show(frame) {
        const header = this.#headers.get(frame.timestamp);
        this.#headers.delete(frame.timestamp);
        if (this.#canvas.width !== frame.displayWidth || this.#canvas.height !== frame.displayHeight) {
            this.#canvas.width = frame.displayWidth;
            this.#canvas.height = frame.displayHeight;
        }
        this.#context.drawImage(frame, 0, 0);
        frame.close();
        this.framesDecoded++;
        if (!header) return;
        this.shownRev = header.scene_rev;
        this.shownFinal = header.final;
        header.decode_ms = performance.now() - header.received_ms;
        this.#acknowledge(header);
        this.#emit("shown", header);
    }

    #acknowledge(header) {
        const decode_us = Math.round(1000 * (header.decode_ms ?? 0));
        this.#connection.post({frame_ack: {seq: header.seq, decode_us}});
    }

    #failed(error) {
        const now = performance.now();
        this.#errors = [...this.#errors.filter((time) => now - time < kErrorWindowMs), now];
        if (error.name === "NotSupportedError" || this.#errors.length >= kMaxDecoderErrors) {
            this.#setMode("mjpeg", "decoder");
            return;
        }
        for (const header of this.#headers.values()) this.#acknowledge(header);
        this.#configure();
        this.#connection.post({request_keyframe: {}});
    }

    #setMode(mode, why) {
        this.#stream.stop();
        this.mode = mode;
        this.why = why;
        this.#emit("mode", mode);
        if (mode === "mjpeg") {
            this.#connection.video = false;
            this.#connection.reopen();    // identify again, without video
        } else {
            this.#start(null);
        }
    }

    // An MJPEG request would go on asking a server that is gone.
    #pause() {
        clearTimeout(this.#stillTimer);
        this.#stillTimer = 0;
        this.#stream.stop();
        if (this.mode === "mjpeg") this.#image.removeAttribute("src");
    }

    #fetchStill() {
        if (this.#stillTimer) return;
        this.#stillTimer = setTimeout(async () => {
            this.#stillTimer = 0;
            // Not as the image's own address: a token travels in a header only.
            const headers = this.#connection.token ? {Authorization: `Bearer ${this.#connection.token}`} : {};
            const response = await fetch("/v1/frame.png", {cache: "no-store", headers}).catch(() => null);
            if (!response?.ok || this.mode !== "still") return;
            const old = this.#image.src;
            this.#image.src = URL.createObjectURL(await response.blob());
            if (old.startsWith("blob:")) URL.revokeObjectURL(old);
        }, kStillMinIntervalMs);
    }

    // An endless image never fires "load" in some browsers: the first part is seen by its size.
    #watchStream() {
        clearInterval(this.#watch);
        this.#watch = setInterval(() => {
            if (this.mode === "mjpeg" && this.#image.naturalWidth === 0) return;
            clearInterval(this.#watch);
            if (this.mode === "mjpeg" && this.framesDecoded === 0) this.#imageLoaded();
        }, kMjpegWatchMs);
    }

    // A stream also ends when the server goes: only one that fails on a living connection is given up, at the second try.
    #imageFailed() {
        if (this.mode !== "mjpeg") return;
        setTimeout(() => {
            if (this.mode !== "mjpeg" || !this.#connection.live) return;
            if (++this.#imageErrors >= 2) this.#setMode("still", "stream");
            else this.#start(null);
        }, kMjpegRetryMs);
    }

    #imageLoaded() {
        this.#imageErrors = 0;
        this.framesDecoded++;
        this.#emit("shown", {scene_rev: 0, final: true, bytes: 0});
    }

    #emit(type, detail) {
        this.dispatchEvent(new CustomEvent(type, {detail}));
    }
}
