// The controls of a light's properties, of one light or of several: each row of the server's table has one.

import {h} from "./dom.js";
import {component, mapped, scrub, slider} from "./controls.js";
import {goboControl} from "./gobo.js";
import {colorSection} from "./inspector_parts.js";
import {percent} from "./lights.js";
import {properties} from "./properties.js";    // made of the server's table
import {temperatureControl} from "./white.js";

const kDegree = Math.PI / 180;

// Shown within −180..180, both ends kept; the server keeps whatever turn it was given.
function toDegrees(rad) {
    const degrees = rad / kDegree;
    return Math.abs(degrees) <= 180.0001 ? degrees : degrees - 360 * Math.round(degrees / 360);
}

function vectorSection(title, vector, letters, options) {
    const fields = letters.map((letter, i) => scrub(component(vector, i),
        {letter, label: `${title} ${letter}`, ...options}));
    return {node: h("div", {class: "row vector"}, ...fields.map((field) => field.node)),
        update: () => fields.forEach((field) => field.update())};
}

export const capital = (text) => text[0].toUpperCase() + text.slice(1);

// Properties that a light's own control sets: those of the table with a field of their own.
export const lightRows = properties.filter((row) => row.field && row.component < 0);

// The control of one row of the table of properties. bound: the property store's handle for it; level: that of the level.
// light: () => the light, or the first of several. all: words behind the labels where it is one of several.
export function lightControl(row, bound, level, light, all = "") {
    const caption = capital(row.name.replace("-", " ")), title = caption + all, id = all ? undefined : row.name;
    if (row.name === "level") return slider(percent(level), {label: title, caption, id, min: 0, max: 100, step: 0.5, digits: 1, unit: "%"});
    if (row.name === "color") return colorSection(bound, all);
    if (row.name === "gobo") return goboControl(bound, () => light()?.gobos ?? [], all);
    if (row.name === "cct") return temperatureControl(bound, all);
    if (row.values === 3) return vectorSection(title, bound, ["x", "y", "z"], {step: 0.05, digits: 3, perPixel: 0.01});
    const angle = row.unit_name === "°" && row.low < 0, long = row.unit_name.length > 1;    // a long unit stands in the caption
    const from = angle ? -180 : row.or_none ? 0 : row.low / row.unit, to = angle ? 180 : row.high / row.unit;
    const shown = mapped(bound, angle ? toDegrees : (value) => value / row.unit, (value) => value * row.unit);
    return slider(shown, {label: title, id, caption: long ? `${caption}, ${row.unit_name}` : caption, min: from, max: to,
        origin: Math.max(0, from), step: angle ? 0.5 : (to - from) / 200, fieldStep: angle ? 1 : (to - from) / 100,
        digits: row.unit_name === "°" ? 1 : 3, unit: long ? "" : row.unit_name});
}

// Where the rows stand; one that is named nowhere stands in the first section.
export const kSections = [["Level and colour", []], ["Beam", ["zoom", "gobo", "gobo-turn", "shutter", "strobe"]], ["Position, m", ["position"]], ["Aim", ["pan", "tilt", "roll", "aim"]]];
