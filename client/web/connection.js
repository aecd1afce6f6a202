// The WebSocket to goniod: identify, requests with replies, reconnecting with exponential backoff and jitter.
// Events: "status" (see `status`), "ready" (Ready), "changed" (StateChanged), "config" (VideoConfig),
// "undo" (UndoState), "video" (ArrayBuffer), "refused" (Result with a code other than "ok"), "applied" ({sent_ms, scene_rev}).

import {addressOf, pageRole} from "./control.js";

const kFirstDelayMs = 250;
const kMaxDelayMs = 10000;
const kReadyTimeoutMs = 10000;   // from opening the socket to Ready
const kProbeMs = 15000;          // a question in silence finds half-open connections
const kWrongToken = 4003;        // close code of PROTOCOL.md
const kProbeTimeoutMs = 20000;   // generous: the server may be loading a scene

// Base64, as JSON has bytes -> bytes.
export const bytesOf = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));

export class Connection extends EventTarget {
    // status: {state: "connecting" | "live" | "waiting" | "locked", text, retryAt_ms}
    status = {state: "connecting", text: "Connecting"};
    hello = null;
    video = true;    // ask for H.264

    #url;
    #socket = null;
    #replies = new Map();    // request_id -> {resolve, reject, progress}
    #nextId = 1;
    #attempt = 0;
    #timer = 0;
    #probe = 0;
    #farewell = "";
    #notBefore_ms = 0;       // after a Goodbye: when the server can be back

    constructor(url) {
        super();
        this.#url = url;
        addEventListener("online", () => this.retry());
        document.addEventListener("visibilitychange", () => { if (!document.hidden) this.retry(); });
    }

    // Whose undo and redo this page goes on with, also after a reload.
    get undoKey() {
        const kept = sessionStorage.getItem("gonio.undo");
        if (kept) return kept;
        const made = `page:${[...crypto.getRandomValues(new Uint32Array(4))].map((x) => x.toString(36)).join("-")}`;
        sessionStorage.setItem("gonio.undo", made);
        return made;
    }

    get token() { return sessionStorage.getItem("gonio.token") ?? ""; }
    get live() { return this.status.state === "live"; }

    open() {
        clearTimeout(this.#timer);
        this.#farewell = "";
        this.#setStatus({state: "connecting", text: "Connecting"});
        const socket = new WebSocket(this.#url, "gonio.v1.json");
        socket.binaryType = "arraybuffer";
        this.#socket = socket;
        this.#timer = setTimeout(() => socket.close(), kReadyTimeoutMs);
        socket.onopen = () => {
            this.#emit("undo", {});    // the server tells where there is something
            this.post({identify: {client: "page", video: this.video, state: true, token: this.token, role: pageRole, undo_key: this.undoKey}});
        };
        socket.onmessage = (event) => {
            if (this.#socket !== socket) return;
            if (typeof event.data === "string") this.#receive(JSON.parse(event.data));
            else this.#emit("video", event.data);
        };
        socket.onclose = (event) => { if (this.#socket === socket) this.#closed(event.code); };
    }

    // At once instead of after the backoff.
    retry() {
        if (this.status.state === "waiting") this.open();
    }


    // Drops the connection and opens a new one, e.g. to identify with other wishes.
    reopen() {
        this.#drop();
        this.open();
    }

    unlock(token) {
        sessionStorage.setItem("gonio.token", token);
        this.reopen();
    }

    // message: a ClientMessage without request_id. Resolves with the ServerMessage; rejects when the connection ends.
    // progress(Progress) is called meanwhile. An AbortSignal has what takes long given up; its answer has the code "cancelled".
    request(message, {progress, signal} = {}) {
        return new Promise((resolve, reject) => {
            if (this.#socket?.readyState !== WebSocket.OPEN) return reject(new Error("not connected"));
            const id = this.#nextId++;
            this.#replies.set(id, {resolve, reject, progress});
            signal?.addEventListener("abort", () => { if (this.#replies.has(id)) this.post({cancel: {request: id}}); }, {once: true});
            this.#socket.send(JSON.stringify({request_id: id, ...message}));
        });
    }

    // A change of the scene. Resolves with the Result, also when it was refused (then "refused" is told too, unless
    // quiet); with null when the connection ended before an answer came.
    async command(command, {quiet = false} = {}) {
        if (pageRole === "viewer") return null;
        let result = null;
        const sent_ms = performance.now();
        try {
            result = (await this.request({command})).result ?? null;
        } catch {
            return null;
        }
        if (result?.code === "ok") this.#emit("applied", {sent_ms, scene_rev: result.scene_rev});
        else if (result && !quiet) this.#emit("refused", result);
        return result;
    }

    // No reply wanted.
    post(message) {
        if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
    }

    #receive(message) {
        const reply = message.request_id ? this.#replies.get(message.request_id) : undefined;
        if (reply) this.#replies.delete(message.request_id);
        if (message.hello) this.hello = message.hello;
        if (message.ready) this.#ready(message.ready);
        if (message.state_changed) this.#emit("changed", message.state_changed);
        if (message.video_config) this.#emit("config", message.video_config);
        if (message.undo_state) this.#emit("undo", message.undo_state);
        if (message.progress) this.#replies.get(message.progress.request)?.progress?.(message.progress);
        if (message.goodbye) {
            this.#farewell = message.goodbye.reason;
            this.#notBefore_ms = performance.now() + (message.goodbye.reconnect_after_ms ?? 0);
        }
        if (reply) reply.resolve(message);
        else if (message.result && message.result.code !== "ok") {
            this.#emit("refused", message.result);
        }
    }

    #ready(ready) {
        const address = addressOf(ready.role);
        if (address) return location.replace(address);
        clearTimeout(this.#timer);
        this.#attempt = 0;
        this.#setStatus({state: "live", text: "Live"});
        this.#emit("ready", ready);
        clearInterval(this.#probe);
        const socket = this.#socket;
        this.#probe = setInterval(() => {
            const timeout = setTimeout(() => socket.close(), kProbeTimeoutMs);
            this.request({stats: {}}).catch(() => {}).finally(() => clearTimeout(timeout));
        }, kProbeMs);
    }

    #drop() {
        const socket = this.#socket;
        this.#socket = null;
        this.#settle();
        socket?.close();
    }

    #settle() {
        clearTimeout(this.#timer);
        clearInterval(this.#probe);
        for (const {reject} of this.#replies.values()) reject(new Error("connection closed"));
        this.#replies.clear();
    }

    #closed(code) {
        this.#settle();
        if (code === kWrongToken) {
            // Asking again by itself would not help.
            this.#setStatus({state: "locked", text: this.token ? "The server did not take this token." : "This server asks for a token."});
            return;
        }
        const span = Math.min(kMaxDelayMs, kFirstDelayMs * 2 ** this.#attempt++);
        const delay_ms = Math.max(span * (0.5 + 0.5 * Math.random()), this.#notBefore_ms - performance.now());
        this.#timer = setTimeout(() => this.open(), delay_ms);
        const text = this.#farewell ? `Server said goodbye: ${this.#farewell}` : "Connection lost";
        this.#setStatus({state: "waiting", text, retryAt_ms: performance.now() + delay_ms});
    }

    #setStatus(status) {
        this.status = status;
        this.#emit("status", status);
    }

    #emit(type, detail) {
        this.dispatchEvent(new CustomEvent(type, {detail}));
    }
}
