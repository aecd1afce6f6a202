// The white of a light: its colour temperature, and the gel in front of it.

import {h, setText} from "./dom.js";
import {labelled, number, range, select} from "./controls.js";

const kTemperatures = [2700, 3200, 4000, 5600];
const kRange = [1000, 15000];    // K
const kWhite = 6504;             // what no temperature looks like: the white of Rec.709

const mired = (kelvin) => -1e6 / kelvin;    // equal steps look about equal; cold to the right

// bound: the property in K, 0 for none.
export function temperatureControl(bound, name = "") {
    const shown = {...bound, value: () => (bound.value() === 0 ? kWhite : bound.value())};
    const kelvins = {...bound, set: (value) => bound.set(value === 0 ? 0 : Math.min(kRange[1], Math.max(kRange[0], value)))};
    const track = range(shown, {label: `Colour temperature${name}`, id: name ? undefined : "cct", min: kRange[0], max: kRange[1], step: 1,
        toTrack: mired, fromTrack: (x) => Math.round(-1e6 / x), origin: kWhite,
        text: (kelvin) => (bound.value() === 0 ? "none" : `${Math.round(kelvin)} K`)});
    const field = number(kelvins, {label: `Colour temperature${name} in K; empty for none`, id: name ? undefined : "cct", min: 0, max: kRange[1], step: 100, digits: 0, none: "none"});
    const chip = (text, kelvin, title) => h("button", {type: "button", class: "chip", title, "data-kelvin": kelvin, onclick: () => bound.set(kelvin)}, text);
    const chips = [chip("None", 0, "The white of Rec.709; lux stay as they are"),
        ...kTemperatures.map((kelvin) => chip(`${kelvin} K`, kelvin, "Lux stay as they are"))];
    const node = h("div", {}, h("div", {class: "slider"}, h("span", {class: "label"}, "White"), track.node,
        h("span", {class: "field"}, field.node, h("span", {class: "unit"}, "K"))), h("div", {class: "chips"}, ...chips));
    return {node, update() {
        track.update();
        field.update();
        for (const one of chips) one.setAttribute("aria-pressed", String(Number(one.dataset.kelvin) === bound.value()));
    }};
}

const percent = (ratio) => `${(100 * ratio).toFixed(ratio < 0.1 ? 1 : 0)} %`;

// bound: the property that holds its name, "" for none; all: words for several lights.
export function gelControl(connection, bound, all = "") {
    let gels = [];
    connection.addEventListener("ready", async () => {
        gels = (await connection.request({gels: {}}).catch(() => ({}))).gels?.gels ?? [];
    });
    const passes = ({measured}) => [...new Set(measured.map((one) => percent(one.transmission_ratio)))].join(" / ");
    const choice = select(bound, {label: `Gel${all}`, options: () => [["", "None"], ...gels.map((gel) => [gel.name, `${gel.name}, ${passes(gel)}`])]});
    if (!all) choice.node.id = "gel";
    const source = h("p", {class: "hint gel-source"});
    const node = h("div", {}, labelled("Gel", choice.node), source);
    return {node, update() {
        choice.update();
        const gel = gels.find(({name}) => name === bound.value());
        setText(source, gel ? `Lux × ${passes(gel)}. ${gel.source}` : "");
        source.hidden = !gel;
    }};
}
