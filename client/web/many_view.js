// The right side where several lights are selected: what they have in common, and what is done with all of them.

import {h, setText, formatNumber, formatLarge} from "./dom.js";
import {property, nameForm, slider} from "./controls.js";
import {percent} from "./lights.js";
import {colorSection, section} from "./inspector_parts.js";
import {temperatureControl, gelControl} from "./white.js";
import {aligned, distributed, moveEach, setAll} from "./many.js";

const kAxes = ["x", "y", "z"];

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
    const level = slider(percent(all("level", () => mean((light) => light.level_ratio), (level_ratio) => ({level_ratio}))),
        {label: "Level of the selected lights", caption: "Level", min: 0, max: 100, step: 0.5, digits: 1, unit: "%"});
    const color = colorSection(all("color", () => lights()[0].color_rgb, (color_rgb) => ({color_rgb})), " of the selected lights");
    const white = temperatureControl(all("cct", () => lights()[0].cct_k, (cct_k) => ({cct_k})), " of the selected lights");
    const gel = gelControl(connection, all("gel", () => lights()[0].gel ?? "", (name) => ({gel: name})), " of the selected lights");
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
    const title = h("h2", {id: "many-name"}), summary = h("p", {class: "faint"});
    const group = nameForm({title: "New group of the selected lights", opens: "Group the selected lights", placeholder: "Name of the group",
        label: "Name of the group of the selected lights", verb: "Create", sign: "Group",
        submit: async (name) => (await connection.command({set_group: {name, lights: lights().map((light) => light.name)}}))?.code === "ok"});
    const names = h("p", {class: "hint names"});
    const tools = h("div", {class: "row wrap"});
    const node = h("div", {id: "many-view", hidden: true}, h("header", {}, title, summary, tools, group.form),
        h("section", {"aria-label": "Level and colour of the selected lights"}, level.node, color.node, white.node, gel.node, mixed),
        section("Position, m", h("div", {class: "row vector"}, ...coordinates.map((field, i) =>
            h("label", {class: "scrubbed"}, h("span", {class: "scrub fixed"}, kAxes[i]), field.node)))),
        arrange, section("Profile", profile), section("Lights", names));
    let listed = "";
    return {node, update() {
        const chosen = lights();
        node.hidden = chosen.length < 2;
        if (node.hidden) return;
        if (aimButton.parentNode !== tools) tools.append(aimButton, duplicate, group.open, remove);    // shared with the view of one light
        setText(title, `${chosen.length} lights`);
        setText(summary, `${formatLarge(chosen.reduce((sum, light) => sum + light.flux_lm * light.multiplier * light.level_ratio, 0))} lm at their levels`);
        for (const part of [level, color, white, gel, ...coordinates]) part.update();
        const differ = [["level", (light) => light.level_ratio], ["colour", (light) => light.color_rgb.join()], ["white", (light) => light.cct_k], ["gel", (light) => light.gel ?? ""],
            ["profile", (light) => light.profile], ["aim", (light) => light.aim.join()]]
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
