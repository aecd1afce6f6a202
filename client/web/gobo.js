// The gobo of a light: a slot of its profile's wheel.

import {labelled, select} from "./controls.js";

// bound: the slot's number, 0: open. names: () => those of the wheel's slots, from 1. all: words for several lights.
export function goboControl(bound, names, all = "") {
    const choice = select({...bound, set: (value) => bound.set(Number(value))},
        {label: `Gobo${all}`, options: () => [["0", "Open"], ...names().map((name, i) => [String(i + 1), `${i + 1} ${name}`])]});
    if (!all) choice.node.id = "gobo";
    return {node: labelled("Gobo", choice.node), update: choice.update};
}
