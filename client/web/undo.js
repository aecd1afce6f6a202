// Undo and redo of what this page did: two buttons that say what they would do, and the keys that people know.

import {h, onPageKey} from "./dom.js";
import {pageRole} from "./control.js";

const kTyping = "textarea, select, input:not([type=range], [type=checkbox], [type=color])";    // these have an undo of their own

export function undoPanel(connection, node) {
    const run = async (name) => {
        const result = await connection.command({[name]: {}});
        if (result?.code === "ok" && result.warnings?.length)
            connection.dispatchEvent(new CustomEvent("refused", {detail: {code: name, message: result.warnings.join("; ")}}));
    };
    const button = (name, sign) => h("button", {type: "button", class: "quiet", id: name, disabled: true, onclick: () => run(name)}, sign);
    const undo = button("undo", "↶"), redo = button("redo", "↷");
    const show = (node, word, keys, label) => {
        node.disabled = !label;
        node.title = label ? `${word}: ${label} (${keys})` : `Nothing to ${word.toLowerCase()}`;
        node.setAttribute("aria-label", label ? `${word}: ${label}` : word);
    };
    connection.addEventListener("undo", ({detail: {undo_label = "", redo_label = ""}}) => {
        show(undo, "Undo", "Ctrl+Z", undo_label);
        show(redo, "Redo", "Ctrl+Shift+Z", redo_label);
    });
    if (pageRole === "viewer") return;
    node.append(undo, redo);
    onPageKey((event) => {
        if (!(event.ctrlKey || event.metaKey) || event.altKey || event.target.closest(kTyping)) return;
        const key = event.key.toLowerCase();
        if (key !== "z" && (key !== "y" || event.shiftKey)) return;
        event.preventDefault();
        run(key === "y" || event.shiftKey ? "redo" : "undo");
    });
}
