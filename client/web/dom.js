// Small DOM helpers. No inline style attributes: the page runs under a strict content security policy.

// h("button", {class: "x", onclick: f}, "text", child): properties that start with "on" are listeners.
export function h(tag, props = {}, ...children) {
    return fill(document.createElement(tag), props, children);
}

export function svg(tag, props = {}, ...children) {
    return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), props, children);
}

function fill(node, props, children) {
    for (const [name, value] of Object.entries(props)) {
        if (value === undefined || value === null || value === false) continue;
        if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
        else node.setAttribute(name, value === true ? "" : value);
    }
    node.append(...children.filter((child) => child !== null && child !== undefined));
    return node;
}

// A table's head, from the titles of its columns. A title that ends with # is for a column of figures, which is aligned to the
// right. One that begins with ~ is for screen readers alone.
export function tableHead(texts) {
    return h("thead", {}, h("tr", {}, ...texts.map((text) => {
        const words = text.replace(/^~|#$/g, "");
        return h("th", {scope: "col", class: text.endsWith("#") ? "figure" : null}, text.startsWith("~") ? h("span", {class: "unseen"}, words) : words);
    })));
}

// Keys of the page as a whole: while a dialog is open they are the dialog's alone.
export function onPageKey(listener) {
    document.addEventListener("keydown", (event) => {
        if (!document.querySelector("dialog[open]")) listener(event);
    });
}

// Writes only what differs, so that a running screen reader or a text selection is left alone.
export function setText(node, text) {
    if (node.textContent !== text) node.textContent = text;
}

export function formatNumber(value, digits) {
    if (!Number.isFinite(value)) return "–";
    const text = value.toFixed(digits);
    return Number(text) === 0 ? (0).toFixed(digits) : text;  // no "-0.00"
}

// 12345.6 -> "12 346": thin spaces, as on data sheets.
export function formatLarge(value) {
    if (!Number.isFinite(value)) return "–";
    const digits = Math.abs(value) < 10 ? 2 : Math.abs(value) < 100 ? 1 : 0;
    return value.toFixed(digits).replace(/\B(?=(\d{3})+(?!\d))/g, digits ? "" : "\u2009");
}
