// The gobo of a light: a slot of its profile's wheel.

import {h} from "./dom.js";
import {select} from "./controls.js";

// bound: the slot's number, 0: open. names: () => those of the wheel's slots, from 1.
export function goboControl(bound, names) {
    const choice = select({...bound, set: (value) => bound.set(Number(value))},
        {label: "Gobo", options: () => [["0", "Open"], ...names().map((name, i) => [String(i + 1), `${i + 1} ${name}`])]});
    choice.node.id = "gobo";
    return {node: h("div", {class: "slider"}, h("span", {class: "label"}, "Gobo"), h("span", {class: "pair row"}, choice.node)), update: choice.update};
}
