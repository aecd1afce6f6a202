// How large the panels are, and which of their parts are folded: changed by mouse and keyboard, kept by this browser.

import {h} from "./dom.js";

const kKey = "gonio.panels";
const kStepPx = 16;
// What can be dragged: the custom property of the style sheet, and between which sizes. grows: towards which way of the
// pointer it grows. box: whose size it is.
const kEdges = {
    left: {property: "--left-w", label: "Width of the left panel", least: 200, most: 480, vertical: true, grows: 1, box: "#left"},
    right: {property: "--right-w", label: "Width of the right panel", least: 260, most: 560, vertical: true, grows: -1, box: "#inspector"},
    drawer: {property: "--drawer-h", label: "Height of the tools", least: 120, most: 560, vertical: false, grows: -1, box: ".drawer-body"},
};

// A browser may refuse to keep anything: then it lasts as long as the page.
function kept() {
    try {
        const {sizes = {}, folded = []} = JSON.parse(localStorage.getItem(kKey) ?? "{}");
        return {sizes, folded: new Set(folded)};
    } catch {
        return {sizes: {}, folded: new Set()};
    }
}

export function panels(left, stage, drawer) {
    const {sizes, folded} = kept();
    const keep = () => {
        try {
            localStorage.setItem(kKey, JSON.stringify({sizes, folded: [...folded]}));
        } catch { /* see above */ }
    };
    for (const [name, edge] of Object.entries(kEdges)) {
        const node = separator(name, edge, sizes, keep);
        // After the picture, so that the Tab key reaches that first.
        if (name === "drawer") drawer.prepend(node);
        else stage.append(node);
    }
    for (const section of left.querySelectorAll(":scope > section")) foldable(section, folded, keep);
}

// The edge of a panel. Result: the element that is dragged; its size is as it was kept.
function separator(name, {property, label, least, most, vertical, grows, box}, sizes, keep) {
    const root = document.documentElement.style;
    const node = h("div", {class: `edge ${name}`, role: "separator", tabindex: "0", "aria-label": label, "aria-orientation": vertical ? "vertical" : "horizontal",
        "aria-valuemin": least, "aria-valuemax": most, title: `${label}: drag it, or use the arrow keys; Home: as it was`});
    const size = () => {
        const {width, height} = document.querySelector(box).getBoundingClientRect();
        return Math.round(vertical ? width : height);
    };
    const tell = () => node.setAttribute("aria-valuenow", String(Math.min(most, Math.max(least, size()))));
    const set = (px) => {
        if (px === null) delete sizes[name];
        else sizes[name] = Math.round(Math.min(most, Math.max(least, px)));
        if (px === null) root.removeProperty(property);
        else root.setProperty(property, `${sizes[name]}px`);
        tell();
    };
    let from = null;    // {at, size} of a drag
    const at = (event) => (vertical ? event.clientX : event.clientY);
    node.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        event.preventDefault();
        node.focus({preventScroll: true});
        node.setPointerCapture(event.pointerId);
        from = {at: at(event), size: size()};
    });
    node.addEventListener("pointermove", (event) => { if (from) set(from.size + grows * (at(event) - from.at)); });
    for (const type of ["pointerup", "pointercancel"]) node.addEventListener(type, () => { from = null; keep(); });
    node.addEventListener("dblclick", () => { set(null); keep(); });
    node.addEventListener("keydown", (event) => {
        const [less, more] = vertical ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
        const step = {[less]: -kStepPx, [more]: kStepPx}[event.key];
        if (step === undefined && event.key !== "Home") return;
        event.preventDefault();
        set(event.key === "Home" ? null : size() + grows * step);
        keep();
    });
    if (Number.isFinite(sizes[name])) set(sizes[name]);
    else tell();
    addEventListener("resize", tell);
    return node;
}

// A part of the left panel whose heading folds it.
function foldable(section, folded, keep) {
    const heading = section.querySelector(":scope > h2");
    if (!heading || !section.id) return;
    const words = heading.firstChild.textContent.trim();
    const button = h("button", {type: "button", class: "fold", "aria-label": `Show or hide ${words}`, onclick: () => {
        folded.has(section.id) ? folded.delete(section.id) : folded.add(section.id);
        show();
        keep();
    }});
    const show = () => {
        section.classList.toggle("folded", folded.has(section.id));
        button.setAttribute("aria-expanded", String(!folded.has(section.id)));
    };
    heading.prepend(button);
    show();
}
