// A panel of the drawer: a title, a line of news, a table; while it is open the server is asked again and again.

import {h, setText, tableHead} from "./dom.js";

export class PolledPanel {
    head = h("p", {class: "faint"});
    rows = h("tbody");
    #period_ms; #poll;
    #timer = 0;
    #open = false;

    // columns: of the table's head, as tableHead() takes them.
    // poll(): asks and shows; rejects where the connection is gone.
    constructor(node, {title, period_ms, columns, poll}) {
        this.#period_ms = period_ms;
        this.#poll = poll;
        node.append(h("header", {}, h("h2", {}, title), this.head),
            h("div", {class: "scroll", tabindex: "0"}, h("table", {}, tableHead(columns), this.rows)));
    }

    get open() { return this.#open; }

    toggle(open) {
        this.#open = open;
        clearTimeout(this.#timer);
        if (open) this.refresh();
    }

    // At once instead of with the next period.
    async refresh() {
        clearTimeout(this.#timer);
        try {
            if (!document.hidden) await this.#poll();
        } catch {
            setText(this.head, "Not connected");
        }
        clearTimeout(this.#timer);
        if (this.#open) this.#timer = setTimeout(() => this.refresh(), this.#period_ms);
    }
}
