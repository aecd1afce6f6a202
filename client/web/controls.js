// Sliders, number fields, selects and tabs that are bound to a property of the store.
//
// A property is {key, read, write}: key() names it for the store's overrides, read() is the server's value, and
// write(value) is the command that sets it. Every control has `node` and update().

import {h, formatNumber} from "./dom.js";

const kKeyHoldMs = 600;    // arrow keys on a slider count as a hand for this long

export function property(store, key, read, write) {
    return {
        store, key,
        value: () => store.value(key(), read()),
        set: (value) => store.set(key(), value, write(value)),
        hold: () => store.hold(key(), read()),
    };
}

// One component of a vector property, as a property.
export function component(whole, index) {
    return {
        ...whole,
        value: () => whole.value()?.[index],
        set: (value) => whole.set(whole.value().map((old, i) => (i === index ? value : old))),
    };
}

// Another unit or scale: shown = toShown(value).
export function mapped(inner, toShown, fromShown) {
    return {...inner, value: () => toShown(inner.value()), set: (value) => inner.set(fromShown(value))};
}

const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

// The bare slider. toTrack/fromTrack bend the scale; origin is where the filled part begins.
export function range(prop, {label, min, max, step, origin = min, toTrack = (x) => x, fromTrack = (x) => x, text, id}) {
    const low = toTrack(min), high = toTrack(max);
    const input = h("input", {type: "range", min: low, max: high, step, "aria-label": label, id});
    let heldKey = null, timer = 0;
    const hold = () => {
        clearTimeout(timer);
        if (heldKey !== null) return;
        heldKey = prop.key();
        prop.hold();
    };
    const release = () => {
        clearTimeout(timer);
        if (heldKey !== null) prop.store.release(heldKey);
        heldKey = null;
    };
    input.addEventListener("pointerdown", () => { hold(); });
    input.addEventListener("pointerup", release);
    input.addEventListener("pointercancel", release);
    input.addEventListener("blur", release);
    input.addEventListener("keydown", (event) => {
        if (!/^(Arrow|Page|Home|End)/.test(event.key)) return;
        hold();
        timer = setTimeout(release, kKeyHoldMs);
    });
    input.addEventListener("input", () => prop.set(clamp(fromTrack(Number(input.value)), min, max)));
    const update = () => {
        const value = prop.value();
        const usable = Number.isFinite(value);
        input.disabled = !usable;
        const at = usable ? clamp(toTrack(value), low, high) : low;
        if (Number(input.value) !== at) input.value = at;
        if (text) input.setAttribute("aria-valuetext", usable ? text(value) : "");
        const percent = (x) => `${(((x - low) / (high - low)) * 100).toFixed(2)}%`;
        const zero = toTrack(origin);
        input.style.setProperty("--from", percent(Math.min(zero, at)));
        input.style.setProperty("--to", percent(Math.max(zero, at)));
    };
    return {node: input, update};
}

// The bare number field: Enter or leaving commits, Escape takes back. digits: how many, or of a value how many.
// none: what stands in the empty field where the value is 0, which then means that there is none.
export function number(prop, {label, min, max, step, digits = 2, id, none}) {
    const input = h("input", {type: "number", min, max, step, "aria-label": label, id: id && `${id}-number`, inputmode: "decimal", placeholder: none});
    let typing = false;
    const commit = () => {
        typing = false;
        const value = input.value.trim() === "" ? (none ? 0 : NaN) : Number(input.value);
        // Beyond the bounds the nearest bound is meant; what is no number at all changes nothing.
        if (Number.isFinite(value)) prop.set(clamp(value, min ?? -Infinity, max ?? Infinity));
        update();
    };
    input.addEventListener("input", () => { typing = true; });
    input.addEventListener("change", commit);
    input.addEventListener("focus", () => input.select());
    input.addEventListener("blur", () => { typing = false; update(); });
    input.addEventListener("keydown", (event) => {
        if (event.key !== "Escape") return;
        typing = false;
        update();
        input.select();
    });
    function update() {
        if (typing) return;
        const value = prop.value();
        input.disabled = !Number.isFinite(value);
        const shown = none && value === 0 ? "" : Number.isFinite(value) ? formatNumber(value, typeof digits === "function" ? digits(value) : digits) : "";
        if (input.value !== shown) input.value = shown;
    }
    return {node: input, update};
}

// Label, slider, number, unit in one row.
export function slider(prop, options) {
    const track = range(prop, options);
    const field = number(prop, {...options, step: options.fieldStep ?? "any"});
    const node = h("div", {class: "slider"}, h("span", {class: "label"}, options.caption ?? options.label), track.node,
        h("span", {class: "field"}, field.node, options.unit ? h("span", {class: "unit"}, options.unit) : null));
    return {node, update() { track.update(); field.update(); }};
}

// A number whose letter can be dragged sideways.
export function scrub(prop, {letter, label, perPixel = 0.01, ...options}) {
    const field = number(prop, {...options, label});
    const handle = h("span", {class: "scrub", title: `Drag to change ${label}`}, letter);
    let start = null;
    handle.addEventListener("pointerdown", (event) => {
        const value = prop.value();
        if (!Number.isFinite(value)) return;
        event.preventDefault();
        handle.setPointerCapture(event.pointerId);
        start = {x: event.clientX, value, key: prop.key()};
        prop.hold();
    });
    handle.addEventListener("pointermove", (event) => {
        if (!start) return;
        const fine = event.shiftKey ? 0.1 : 1;
        prop.set(clamp(start.value + (event.clientX - start.x) * perPixel * fine,
            options.min ?? -Infinity, options.max ?? Infinity));
    });
    const end = () => {
        if (start) prop.store.release(start.key);
        start = null;
    };
    handle.addEventListener("pointerup", end);
    handle.addEventListener("pointercancel", end);
    return {node: h("label", {class: "scrubbed"}, handle, field.node), update: field.update};
}

// options: () => [[value, text], …]; a value that is not among them is added, so that the truth is always shown.
export function select(prop, {label, options}) {
    const input = h("select", {"aria-label": label});
    let shown = "";
    input.addEventListener("change", () => prop.set(input.value));
    const update = () => {
        const value = prop.value();
        const list = options();
        if (value !== undefined && !list.some(([known]) => known === String(value))) {
            list.unshift([String(value), String(value)]);
        }
        const signature = JSON.stringify(list);
        if (signature !== shown) {
            shown = signature;
            input.replaceChildren(...list.map(([known, text]) => h("option", {value: known}, text)));
        }
        input.disabled = value === undefined;
        if (value !== undefined && input.value !== String(value)) input.value = String(value);
    };
    return {node: input, update};
}

// A row of controls behind the name of what they choose.
export function labelled(label, ...controls) {
    return h("div", {class: "slider"}, h("span", {class: "label"}, label), h("span", {class: "row pair"}, ...controls));
}

// A radio group in a row; arrow keys move within it.
export function tabs(prop, node, entries) {
    const buttons = entries.map(([value, text, title]) => h("button", {
        type: "button", role: "radio", "data-value": value, title, onclick: () => prop.set(value),
    }, text));
    node.append(...buttons);
    node.addEventListener("keydown", (event) => {
        const step = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
        if (!step) return;
        event.preventDefault();
        const at = buttons.indexOf(document.activeElement);
        const next = buttons[(at + step + buttons.length) % buttons.length];
        next.focus();
        next.click();
    });
    return {
        node,
        update() {
            const value = prop.value();
            const known = buttons.some((button) => button.dataset.value === value);
            buttons.forEach((button, i) => {
                const on = button.dataset.value === value;
                button.setAttribute("aria-checked", String(on));
                button.tabIndex = on || (!known && i === 0) ? 0 : -1;
            });
        },
    };
}

// A "+", or another sign, and the form for a name that it opens. submit(name) resolves with whether it was taken; then
// the form closes. before: the name that the form begins with.
export function nameForm({title, opens, placeholder, label, verb, submit, sign = "+", before = () => ""}) {
    const input = h("input", {type: "text", maxlength: 128, placeholder, "aria-label": label});
    const form = h("form", {class: "inline", hidden: true}, input, h("button", {}, verb));
    const open = h("button", {type: "button", class: "quiet", title, "aria-label": opens,
        onclick: () => {
            form.hidden = !form.hidden;
            if (form.hidden) return;
            input.value = before();
            input.select();
            input.focus();
        }}, sign);
    form.addEventListener("keydown", (event) => {
        if (event.key !== "Escape") return;
        form.hidden = true;
        open.focus();
    });
    form.addEventListener("submit", async (event) => {
        event.preventDefault();
        const name = input.value.trim();
        if (!name || !await submit(name)) return;
        input.value = "";
        form.hidden = true;
    });
    return {open, form};
}
