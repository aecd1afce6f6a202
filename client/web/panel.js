// A panel of the drawer: a title, a line of news, a table; while it is open the server is asked again and again.

import {h, setText} from "./dom.js";

export class PolledPanel {
    head = h("p", {class: "faint"});
    rows = h("tbody");
    #period_ms; #poll;
    #timer = 0;
    #open = false;

    // columns: texts of the table's head; a text that ends with # heads figures.
    // poll(): asks and shows; rejects where the connection is gone.
    constructor(node, {title, period_ms, columns, poll}) {
        this.#period_ms = period_ms;
        this.#poll = poll;
        const column = (text) => h("th", {scope: "col", class: text.endsWith("#") ? "figure" : null}, text.replace("#", ""));
        node.append(h("header", {}, h("h2", {}, title), this.head),
            h("div", {class: "scroll", tabindex: "0"}, h("table", {}, h("thead", {}, h("tr", {}, ...columns.map(column))), this.rows)));
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
