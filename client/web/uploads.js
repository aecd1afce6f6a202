// Scene files from this computer: chosen or dropped onto the picture, uploaded, loaded.

import {pageRole} from "./control.js";
import {h, setText} from "./dom.js";

const kEndings = [".glb", ".gltf", ".mvr"];

// Result: the name under which the server takes the file.
export function uploadName(name) {
    const at = name.lastIndexOf(".");
    const clean = (text) => text.replaceAll(/[^A-Za-z0-9._-]/g, "-");
    const ending = clean(name.slice(at)).toLowerCase();
    return `${clean(name.slice(0, at)).replace(/^\.+/, "").slice(0, 64 - ending.length) || "scene"}${ending}`;
}

export class Uploads {
    #connection; #load; #toasts;

    // node: where the button goes; target: where files may be dropped; load(file): loads what was uploaded.
    constructor(connection, toasts, node, target, load) {
        this.#connection = connection;
        this.#toasts = toasts;
        this.#load = load;
        const input = h("input", {type: "file", accept: kEndings.join(","), hidden: true, "aria-label": "Scene file to upload"});
        this.busy = h("span", {class: "faint busy", role: "status"});
        node.append(h("button", {type: "button", class: "quiet", title: "Upload a .glb, .gltf or .mvr from this computer; or drop it onto the picture",
            onclick: () => input.click()}, "Upload…"), input, this.busy);
        input.addEventListener("change", () => {
            if (input.files[0]) this.send(input.files[0]);
            input.value = "";
        });
        target.addEventListener("dragover", (event) => {
            if (event.dataTransfer?.types.includes("Files")) event.preventDefault();
        });
        target.addEventListener("drop", (event) => {
            const file = event.dataTransfer?.files[0];
            if (!file) return;
            event.preventDefault();
            this.send(file);
        });
    }

    async send(file) {
        if (pageRole === "viewer") return;
        if (!kEndings.some((ending) => file.name.toLowerCase().endsWith(ending))) {
            this.#refused("unsupported", file.name, "Only .glb, .gltf and .mvr files are scenes.");
            return;
        }
        const name = uploadName(file.name);
        setText(this.busy, `Uploading ${file.name}…`);
        const token = this.#connection.token;
        const response = await fetch(`/v1/uploads/${name}`, {
            method: "PUT", body: file, headers: token ? {Authorization: `Bearer ${token}`} : {},
        }).catch(() => null);
        setText(this.busy, "");
        if (response?.ok) await this.#load(`upload:${name}`);
        else this.#refused("upload", file.name, response ? (await response.text()).trim() : "The upload broke off.");
    }

    #refused(code, value, message) {
        this.#toasts.show({code, field: "", value, message});
    }
}
