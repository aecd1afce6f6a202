// What is done with the lights that are selected, one or several: each is one command and one step of undo.

import {add, scale} from "./projection.js";

const kCopyOff_m = 0.3;    // of a duplicate, to the right as the camera sees it

// Result: the first of "name 2", "name 3", … that no light and no group has and that is not among `taken` yet.
export function freeName(store, name, taken = new Set()) {
    const base = name.replace(/ \d+$/, "");
    for (let n = 2; ; n++) {
        const tried = `${base} ${n}`;
        if (!store.light(tried) && !store.group(tried) && !taken.has(tried)) return tried;
    }
}

// values: Map of name -> what SetLight says beside it.
export const setEach = (values) => ({edit_lights: {set: [...values].map(([name, value]) => ({name, ...value}))}});
// same: what SetLight says of all of them.
export const setAll = (lights, same) => (lights.length === 1 ? {set_light: {name: lights[0].name, ...same}}
    : {edit_lights: {names: lights.map(({name}) => name), same}});

// Copies of the selected lights, a little to the side; they are selected then. right: the camera's.
export async function duplicate(store, connection, right) {
    const lights = store.chosen.filter((light) => !light.sun), taken = new Set();
    if (lights.length === 0) return;
    const copies = lights.map((light) => {
        const name = freeName(store, light.name, taken);
        taken.add(name);
        return {like: light.name, light: {name, position_m: add(light.position, scale(right, kCopyOff_m))}};
    });
    const command = copies.length === 1 ? {add_light: copies[0]} : {edit_lights: {add: copies}};
    if ((await connection.command(command))?.code === "ok") store.choose([...taken]);
}

export function removeChosen(store, connection) {
    const names = store.chosen.map(({name}) => name);
    if (names.length === 0) return null;
    return connection.command(names.length === 1 ? {remove_light: {name: names[0]}} : {edit_lights: {remove: names}});
}

// Result: positions of the lights with coordinate `axis` (0..2) as that of `to`: "first" or "mean" of them.
export function aligned(lights, axis, to) {
    const values = lights.map((light) => light.position[axis]);
    const value = to === "first" ? values[0] : values.reduce((sum, x) => sum + x, 0) / values.length;
    return new Map(lights.map((light) => [light.name, light.position.map((x, i) => (i === axis ? value : x))]));
}

// Result: positions of the lights evenly between the outermost ones along `axis`, in the order in which they stand there.
export function distributed(lights, axis) {
    const sorted = [...lights].sort((a, b) => a.position[axis] - b.position[axis]);
    const low = sorted[0].position[axis], high = sorted.at(-1).position[axis];
    return new Map(sorted.map((light, n) => {
        const share = n / (sorted.length - 1);
        return [light.name, light.position.map((x, i) => (i === axis ? low * (1 - share) + high * share : x))];
    }));
}

export const moveEach = (positions) => setEach(new Map([...positions].map(([name, position_m]) => [name, {position_m}])));
