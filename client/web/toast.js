// Refusals of the server, calmly: what was refused, which field, which value. One toast per kind, counted.

import {h, setText} from "./dom.js";

const kShownMs = 8000;

// A Result as a sentence: "must be …" gets its field as the subject, a place in a file goes in front.
export function sentence({code, field = "", message = ""}) {
    if (!message) return code.replaceAll("_", " ");
    const name = field.split(".").at(-1).replace(/_(m|rad|ratio|rgb|px)$/, "").replaceAll("_", " ");
    const text = /^must /.test(message) && name ? `${name} ${message}` : message;
    const place = /^line \d+/i.test(field) && !message.toLowerCase().includes(field.toLowerCase()) ? `${field}: ` : "";
    const whole = place + text;
    return whole[0].toUpperCase() + whole.slice(1) + (/[.!?]$/.test(whole) ? "" : ".");
}

export class Toasts {
    #node;
    #current = new Map();    // code and field -> {node, count, times, timer}

    constructor(node) { this.#node = node; }

    show(result) {
        const {code, field = "", value = ""} = result;
        const key = `${code}\n${field}`;
        let toast = this.#current.get(key);
        if (!toast) {
            const text = h("p"), detail = h("p", {class: "faint"}), times = h("span", {class: "count"});
            const node = h("div", {class: "toast"}, h("div", {}, text, detail), times,
                h("button", {type: "button", class: "quiet", "aria-label": "Dismiss", onclick: () => this.#end(key)}, "×"));
            toast = {node, text, detail, times, count: 0};
            this.#current.set(key, toast);
            this.#node.append(node);
        }
        toast.count++;
        setText(toast.text, sentence(result));
        setText(toast.detail, [code, field, value].filter(Boolean).join(" · "));
        setText(toast.times, toast.count > 1 ? `×${toast.count}` : "");
        clearTimeout(toast.timer);
        toast.timer = setTimeout(() => this.#end(key), kShownMs);
    }

    #end(key) {
        const toast = this.#current.get(key);
        clearTimeout(toast?.timer);
        toast?.node.remove();
        this.#current.delete(key);
    }
}
