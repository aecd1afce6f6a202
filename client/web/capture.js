// Captures over the connection, so that a token is needed nowhere else, and saved as files.

import {bytesOf} from "./connection.js";
import {h} from "./dom.js";

// query: a CaptureQuery. Resolves with the answer; the picture is saved where there is one.
export async function saveCapture(connection, store, query) {
    const reply = await connection.request({capture: query});
    if (!reply.capture) return reply;
    const {blob, name} = pictureOf(reply.capture, store.state, query);
    saveFile(blob, name);
    return reply;
}

// Result: {blob, name} of a CaptureResult: its file, and a name for it that tells scene, view, quality and revision.
export function pictureOf({image, format, scene_rev}, state, query) {
    const quality = query.quality !== "reference" ? "" : query.denoise ? "-denoised" : "-reference";
    const type = {png: "image/png", jpg: "image/jpeg", exr: "image/x-exr"}[format];
    return {blob: new Blob([bytesOf(image)], {type}), name: `${plainName(state?.scene)}-${query.view || state?.view}${quality}-${scene_rev}.${format}`};
}

// "/scenes/room.glb" -> "room".
export const plainName = (file) => (file || "scene").split("/").at(-1).replace(/\.\w+$/, "");

// Into the browser's downloads.
export function saveFile(blob, name) {
    const url = URL.createObjectURL(blob);
    h("a", {href: url, download: name}).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
}
