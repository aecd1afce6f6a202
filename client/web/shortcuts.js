// Keys and pointers that do something in the page: one table, shown under "?".

import {h, onPageKey} from "./dom.js";

// A tool that listens to a key adds a row here.
export const shortcuts = [
    {part: "Camera", keys: "Drag", what: "Orbit around what is looked at"},
    {part: "Camera", keys: "Ctrl drag, two fingers", what: "Move sideways and up"},
    {part: "Camera", keys: "Wheel, pinch, + and −", what: "Nearer and farther"},
    {part: "Camera", keys: "Arrow keys", what: "Orbit; with Shift: move"},
    {part: "Camera", keys: "Middle drag", what: "Orbit; with Shift: move; with Ctrl: nearer and farther"},
    {part: "Camera", keys: "Right drag", what: "Look around. Meanwhile W A S D walk, Q and E go down and up, Shift runs, the wheel sets the speed"},
    {part: "Camera", keys: "Numpad 1, 3, 7", what: "From the front, the right, above; with Ctrl: the back, the left"},
    {part: "Camera", keys: "Home, F", what: "All of the scene; the selected lights"},
    {part: "Picture", keys: "1 … 5", what: "Choose what is shown, in the order of the tabs"},
    {part: "Picture", keys: "← and → on the divider", what: "Move it between A and B; with Shift: by 10 %"},
    {part: "Selection", keys: "Click on a light", what: "Select it; once more: the next one at that place"},
    {part: "Selection", keys: "Shift click, Shift drag", what: "Add a light; add those in a rectangle"},
    {part: "Selection", keys: "Ctrl A in the list", what: "All that the filter leaves"},
    {part: "Lights", keys: "Drag a light or its axes; W or G", what: "Move it; Ctrl: in steps of 0.1 m"},
    {part: "Lights", keys: "Drag the end of the aim line; E or R", what: "Turn it"},
    {part: "Lights", keys: "Drag the ring about the aim line", what: "Roll it; Ctrl: in steps of 15°"},
    {part: "Lights", keys: "X, Y, Z while moving", what: "Along this axis only"},
    {part: "Lights", keys: "A, then click", what: "Aim the selected lights there"},
    {part: "Lights", keys: "N, then click", what: "Add a light there"},
    {part: "Lights", keys: "Ctrl D, Delete", what: "Duplicate, remove"},
    {part: "Lights", keys: "B", what: "Show the beam on the surfaces"},
    {part: "Lights", keys: "Escape", what: "Take a drag back; end a tool"},
    {part: "Cues", keys: "Space", what: "GO, where the tool Cues is open and no button or field has the keys"},
    {part: "Cues", keys: "Shift Space", what: "STOP, likewise"},
    {part: "Work", keys: "Ctrl Z, Ctrl Shift Z", what: "Undo, redo what this page did to lights"},
    {part: "Work", keys: "?", what: "These keys"},
];

// node: where the button goes.
export function shortcutHelp(node) {
    const parts = [...new Set(shortcuts.map(({part}) => part))];
    const close = h("button", {type: "button", class: "quiet", "aria-label": "Close", onclick: () => dialog.close()}, "×");
    const dialog = h("dialog", {id: "shortcuts", "aria-label": "Keys and pointer"},
        h("header", {class: "row"}, h("h2", {}, "Keys and pointer"), h("span", {class: "grow"}), close),
        ...parts.map((part) => h("section", {"aria-label": part}, h("h3", {}, part), h("dl", {}, ...shortcuts.filter((row) => row.part === part)
            .flatMap(({keys, what}) => [h("dt", {}, keys), h("dd", {}, what)])))));
    dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });    // beside it
    document.body.append(dialog);
    node.append(h("button", {type: "button", class: "quiet", id: "help", title: "Keys and pointer (?)", "aria-label": "Keys and pointer", onclick: () => dialog.showModal()}, "?"));
    onPageKey((event) => {
        if (event.key !== "?" || event.ctrlKey || event.metaKey || event.target.closest("input:not([type=range]), select, textarea")) return;
        event.preventDefault();
        dialog.showModal();
    });
}
