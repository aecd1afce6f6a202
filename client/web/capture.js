// Captures over the connection, so that a token is needed nowhere else, and saved as files.

import {h} from "./dom.js";

// query: a CaptureQuery. Resolves with the answer; the picture is saved where there is one.
export async function saveCapture(connection, store, query) {
    const reply = await connection.request({capture: query});
    if (!reply.capture) return reply;
    const {image, format, scene_rev} = reply.capture;
    const bytes = Uint8Array.from(atob(image), (letter) => letter.charCodeAt(0));
    const scene = (store.state?.scene ?? "scene").split("/").at(-1).replace(/\.\w+$/, "");
    const quality = query.quality !== "reference" ? "" : query.denoise ? "-denoised" : "-reference";
    saveFile(bytes, `image/${format}`, `${scene}-${store.state?.view}${quality}-${scene_rev}.${format}`);
    return reply;
}

// Into the browser's downloads.
export function saveFile(bytes, type, name) {
    const url = URL.createObjectURL(new Blob([bytes], {type}));
    h("a", {href: url, download: name}).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
}
