// Refusals of the server, calmly: what was refused, which field, which value. One toast per kind, counted.

import {h, setText} from "./dom.js";

const kShownMs = 8000;

export class Toasts {
    #node;
    #current = new Map();    // code and field -> {node, count, times, timer}

    constructor(node) { this.#node = node; }

    show({code, field = "", value = "", message = ""}) {
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
        setText(toast.text, message || "The server refused the change.");
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
