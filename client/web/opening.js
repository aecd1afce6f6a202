// The luminous opening of a light: a shape and its measures in metres, or what its photometric file says.

import {h, setText} from "./dom.js";
import {labelled, number, select} from "./controls.js";

// As set_light.opening has them: "disc 0.4", "box 1.2x0.3x0.1".
const kShapes = [["file", "From the file", []], ["point", "Point", []], ["rect", "Rectangle", ["Length", "Width"]], ["disc", "Disc", ["Diameter"]],
    ["line", "Line", ["Length"]], ["sphere", "Sphere", ["Diameter"]], ["box", "Box", ["Length", "Width", "Height"]]];
const kFirst = [0.6, 0.6, 0.1];        // m, of a shape that had no measures
const kLeast = 0.001, kMost = 100;     // m
const measuresOf = (name) => kShapes.find(([known]) => known === name)?.[2] ?? [];

// bound: the property as set_light.opening takes it, "file" for the file's own. shown: () => what that is. all: words for several
// lights.
export function openingControl(bound, shown, all = "") {
    const parts = () => {
        const [name, sides = ""] = (bound.value() ?? "").split(" ");
        return {name, sides: sides === "" ? [] : sides.split("x").map(Number)};
    };
    const write = (name, sides) => {
        const all = measuresOf(name).map((_, i) => sides[i] ?? kFirst[i]);
        bound.set(all.length > 0 ? `${name} ${all.join("x")}` : name);
    };
    const shape = {...bound, value: () => (bound.value() === undefined ? undefined : parts().name), set: (name) => write(name, parts().sides)};
    const choice = select(shape, {label: `Luminous opening${all}`, options: () => kShapes.map(([name, text]) => [name, text])});
    if (!all) choice.node.id = "opening";
    const fields = [0, 1, 2].map((i) => {
        const side = {...bound, value: () => parts().sides[i] ?? NaN,
            set: (value) => write(parts().name, parts().sides.map((old, k) => (k === i ? value : old)))};
        const field = number(side, {label: `Opening, measure ${i + 1} in m${all}`, min: kLeast, max: kMost, step: "any", digits: 3, id: all ? undefined : `opening-${i}`});
        return {node: h("span", {class: "field"}, field.node, h("span", {class: "unit"}, "m")), input: field.node, update: field.update};
    });
    const hint = h("p", {class: "hint"});
    const node = h("div", {}, labelled("Opening", choice.node),
        h("div", {class: "row"}, ...fields.map((field) => field.node)), hint);
    return {node, update() {
        choice.update();
        const names = measuresOf(parts().name);
        fields.forEach((field, i) => {
            field.node.hidden = i >= names.length;
            if (names[i]) field.input.setAttribute("aria-label", `${names[i]} of the opening in m${all}`);
            field.update();
        });
        setText(hint, bound.value() === "file" ? `${shown()}${shown() === "point" ? "" : " m"}` : "");
        hint.hidden = bound.value() !== "file";
    }};
}
