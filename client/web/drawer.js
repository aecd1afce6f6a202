// The drawer under the picture: one panel at a time, chosen by its tab. The tab of the open panel closes the drawer.

import {h} from "./dom.js";

// panels: [{id, title, make}]. make(element) fills the panel; where what it returns has toggle(open), that is told when
// the panel comes and goes.
export function drawer(node, panels) {
    const bar = h("div", {class: "drawer-tabs", role: "tablist", "aria-label": "Tools"});
    const body = h("div", {class: "drawer-body", hidden: true});
    const entries = panels.map(({id, title, make}) => {
        const tab = h("button", {type: "button", role: "tab", id: `${id}-toggle`, "aria-controls": id, onclick: () => show(current === entry ? null : entry)}, title);
        const element = h("section", {id, role: "tabpanel", "aria-labelledby": tab.id, hidden: true});
        const entry = {tab, element, made: make(element)};
        bar.append(tab);
        body.append(element);
        return entry;
    });
    let current = null;

    function show(entry) {
        const before = current;
        current = entry;
        body.hidden = !entry;
        const reached = entry ?? before ?? entries[0];    // by the Tab key; arrows go on from there
        for (const one of entries) {
            one.element.hidden = one !== entry;
            one.tab.setAttribute("aria-selected", String(one === entry));
            one.tab.setAttribute("aria-expanded", String(one === entry));
            one.tab.tabIndex = one === reached ? 0 : -1;
        }
        before?.made?.toggle?.(false);
        entry?.made?.toggle?.(true);
        entry?.tab.scrollIntoView({block: "nearest", inline: "nearest"});
    }

    bar.addEventListener("keydown", (event) => {
        const at = entries.findIndex(({tab}) => tab === document.activeElement), step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
        if (!step || at < 0) return;
        event.preventDefault();
        entries[(at + step + entries.length) % entries.length].tab.focus();
    });
    body.addEventListener("keydown", (event) => {
        if (event.key !== "Escape" || event.defaultPrevented || event.target.matches("input, select, textarea")) return;
        current.tab.focus();
        show(null);
    });
    node.append(bar, body);
    show(null);
}
