// The right side where several lights are selected: what they have in common, and what is done with all of them.

import {h, setText, formatNumber, formatLarge} from "./dom.js";
import {property, nameForm, slider} from "./controls.js";
import {section} from "./inspector_parts.js";
import {kSections, lightControl, lightRows} from "./light_control.js";
import {openingControl} from "./opening.js";
import {giveProfile, kPhotometryAccepted, luminaireOf} from "./profile.js";
import {gelControl} from "./white.js";
import {aligned, distributed, moveEach, setAll} from "./many.js";

const kAxes = ["x", "y", "z"];
const kWords = {color: "colour", cct: "white"};    // of properties, where they have others
const kOfThese = " of the selected lights";

// Result: the value that all lights have; undefined where they differ.
function common(lights, valueOf) {
    const first = valueOf(lights[0]);
    return lights.every((light) => valueOf(light) === first) ? first : undefined;
}

// A number of all lights; empty where they differ, and then what is typed is meant for all.
function commonNumber({label, read, write}) {
    const input = h("input", {type: "number", step: "any", "aria-label": label, placeholder: "mixed", inputmode: "decimal"});
    let typing = false;
    input.addEventListener("input", () => { typing = true; });
    input.addEventListener("change", () => {
        const value = Number(input.value);
        typing = false;
        if (input.value.trim() !== "" && Number.isFinite(value)) write(value);
    });
    input.addEventListener("blur", () => { typing = false; });
    return {node: input, update() {
        if (typing) return;
        const value = read(), shown = value === undefined ? "" : formatNumber(value, 3);
        if (input.value !== shown) input.value = shown;
    }};
}

export function manyView(store, connection, {aimButton, remove, duplicate}) {
    const lights = () => store.chosen;
    const mean = (valueOf) => lights().reduce((sum, light) => sum + valueOf(light), 0) / lights().length;
    const all = (key, read, write) => property(store, () => `many:${key}`, () => (lights().length ? read() : undefined),
        (value) => setAll(lights(), write(value)));
    // A control shows the first light's value; that of the level shows the mean of all levels.
    const bound = (row) => all(row.name, () => (row.name === "level" ? mean((light) => light.level_ratio) : lights()[0][row.state_field]), (value) => ({[row.field]: value}));
    const rows = lightRows.filter((row) => row.name !== "position");
    const controls = new Map(rows.map((row) => [row.name, lightControl(row, bound(row), bound(row), () => lights()[0], kOfThese)]));
    const gel = gelControl(connection, all("gel", () => lights()[0].gel ?? "", (name) => ({gel: name})), kOfThese);
    const openingOf = (light) => (light.sun ? undefined : light.opening_of_file ? "file" : light.opening);
    const opening = openingControl(all("opening", () => openingOf(lights()[0]), (text) => ({opening: text})), () => lights()[0]?.opening ?? "", kOfThese);
    const placedRows = new Set(kSections.flatMap(([, names]) => names));
    const nodesOf = (wanted) => rows.filter((row) => wanted(row.name)).map((row) => controls.get(row.name).node);
    const beside = kSections.slice(1).filter(([, names]) => !names.includes("position"))
        .map(([heading, names]) => section(heading, ...nodesOf((name) => names.includes(name))));
    const mixed = h("p", {class: "hint", role: "status"});

    const move = (positions) => connection.command(moveEach(positions));
    const coordinates = kAxes.map((axis, i) => commonNumber({label: `${axis} of the selected lights`,
        read: () => common(lights(), (light) => light.position[i]),
        write: (value) => move(new Map(lights().map((light) => [light.name, light.position.map((x, k) => (k === i ? value : x))])))}));
    const placed = () => lights().filter((light) => !light.sun);
    const act = (text, title, make) => h("button", {type: "button", class: "chip", title, "aria-label": title, onclick: () => {
        const chosen = placed();
        if (chosen.length > 1) move(make(chosen));
    }}, text);
    const first = () => [store.light(store.selected.name), ...placed().filter(({name}) => name !== store.selected.name)];
    const row = (title, buttons) => h("div", {class: "slider"}, h("span", {class: "label"}, title), h("span", {class: "pair chips"}, ...buttons));
    const arrange = section("Arrange",
        row("To last", kAxes.map((axis, i) => act(axis.toUpperCase(), `Align ${axis} to the light that was selected last`, () => aligned(first(), i, "first")))),
        row("To mean", kAxes.map((axis, i) => act(axis.toUpperCase(), `Align ${axis} to the mean`, (chosen) => aligned(chosen, i, "mean")))),
        row("Evenly", kAxes.map((axis, i) => act(axis.toUpperCase(), `Distribute evenly along ${axis}, between the outermost`, (chosen) => distributed(chosen, i)))));

    const profile = h("select", {"aria-label": "Profile of the selected lights", onchange: () => {
        if (profile.value) connection.command(setAll(lights(), {profile: {name: profile.value}}));
    }});
    const file = h("input", {type: "file", accept: kPhotometryAccepted, hidden: true, "aria-label": `Photometric file${kOfThese}`, onchange: async () => {
        const chosen = file.files[0];
        if (!chosen) return;
        const result = await giveProfile(connection, lights(), chosen);
        file.value = "";    // the same file again is a new choice
        if (result.code !== "ok") connection.dispatchEvent(new CustomEvent("refused", {detail: {...result, value: `${chosen.name} ${result.value ?? ""}`.trim()}}));
    }});
    const title = h("h2", {id: "many-name"}), summary = h("p", {class: "faint"});
    const group = nameForm({title: "New group of the selected lights", opens: "Group the selected lights", placeholder: "Name of the group",
        label: "Name of the group of the selected lights", verb: "Create", sign: "Group",
        submit: async (name) => (await connection.command({set_group: {name, lights: lights().map((light) => light.name)}}))?.code === "ok"});
    const names = h("p", {class: "hint names"});
    const tools = h("div", {class: "row wrap"});
    const node = h("div", {id: "many-view", hidden: true}, h("header", {}, title, summary, tools, group.form),
        h("section", {"aria-label": "Level and colour of the selected lights"}, ...nodesOf((name) => !placedRows.has(name)), gel.node, opening.node, mixed), ...beside,
        section("Position, m", h("div", {class: "row vector"}, ...coordinates.map((field, i) =>
            h("label", {class: "scrubbed"}, h("span", {class: "scrub fixed"}, kAxes[i]), field.node)))),
        arrange, section("Profile", h("div", {class: "row"}, profile, h("button", {type: "button", onclick: () => file.click()}, "Upload…"), file)), section("Lights", names));
    let listed = "";
    return {node, update() {
        const chosen = lights();
        node.hidden = chosen.length < 2;
        if (node.hidden) return;
        if (aimButton.parentNode !== tools) tools.append(aimButton, duplicate, group.open, remove);    // shared with the view of one light
        setText(title, `${chosen.length} lights`);
        setText(summary, `${formatLarge(chosen.reduce((sum, light) => sum + light.flux_lm * light.multiplier * light.level_ratio, 0))} lm at their levels`);
        for (const part of [...controls.values(), gel, opening, ...coordinates]) part.update();
        // Slots of different wheels have nothing in common.
        const wheel = common(chosen, (light) => (light.gobos ?? []).join("\n"));
        for (const ofWheel of ["gobo", "gobo-turn"]) controls.get(ofWheel).node.hidden = !wheel;
        const differ = [...rows.filter(({name}) => !["pan", "tilt", "roll"].includes(name)).map((row) => [kWords[row.name] ?? row.name.replace("-", " "), (light) => String(light[row.state_field] ?? "")]), ["gel", (light) => light.gel ?? ""],
            ["profile", luminaireOf], ["opening", (light) => openingOf(light) ?? ""]]
            .filter(([, valueOf]) => common(chosen, valueOf) === undefined).map(([what]) => what);
        setText(mixed, differ.length ? `They differ in ${differ.join(", ")}.` : "");
        const same = common(chosen, (light) => light.profile) ?? "";
        const options = [...new Set([same, ...store.state.profiles])].filter((name) => name || same === "");
        if (JSON.stringify([same, options]) !== listed) {
            listed = JSON.stringify([same, options]);
            profile.replaceChildren(...options.map((name) => h("option", {value: name}, name || "mixed")));
            profile.value = same;
        }
        setText(names, chosen.slice(0, 30).map(({name}) => name).join(", ") + (chosen.length > 30 ? ` and ${chosen.length - 30} more` : ""));
    }};
}
