// Files from this computer: chosen or dropped onto the picture. A scene is uploaded and loaded. A photometric file becomes the
// profile of the selected luminaires, or comes into the library where none is selected.

import {pageRole} from "./control.js";
import {h, setText} from "./dom.js";
import {giveProfile, kPhotometry} from "./profile.js";
import {putFile} from "./upload_file.js";

const kEndings = [".glb", ".gltf", ".mvr"];

export class Uploads {
    #store; #connection; #load; #toasts;

    // node: where the button goes; target: where files may be dropped; load(file): loads what was uploaded.
    constructor(store, connection, toasts, node, target, load) {
        this.#store = store;
        this.#connection = connection;
        this.#toasts = toasts;
        this.#load = load;
        const input = h("input", {type: "file", accept: [...kEndings, ...kPhotometry].join(","), hidden: true, "aria-label": "Scene file to upload"});
        this.busy = h("span", {class: "faint busy", role: "status"});
        node.append(h("button", {type: "button", class: "quiet", title: "Upload a scene (.glb, .gltf, .mvr) or a photometric file from this computer; or drop it onto the picture",
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
        const ends = (endings) => endings.some((ending) => file.name.toLowerCase().endsWith(ending)), isScene = ends(kEndings);
        if (!isScene && !ends(kPhotometry))
            return this.#refused("unsupported", file.name, `Scenes are ${kEndings.join(", ")} files, photometry is ${kPhotometry.join(", ")}.`);
        if (!isScene && this.#store.chosen.length > 0) return this.#light(file);
        const name = await this.#put(file);
        if (!name) return;
        if (isScene) await this.#load(name);
        else this.#toasts.show({code: "library", message: `${file.name} is in the library.`});
    }

    // The file as the profile of what is selected.
    async #light(file) {
        const lights = this.#store.chosen, result = await giveProfile(this.#connection, lights, file);
        if (result.code === "ok") this.#toasts.show({code: "profile", message: `${file.name} is the profile of ${lights.length === 1 ? lights[0].name : `${lights.length} lights`} now.`});
        else this.#refused(result.code, file.name, result.message);
    }

    // Result: the name by which the server finds the file; undefined where it was refused, which is told.
    async #put(file) {
        setText(this.busy, `Uploading ${file.name}…`);
        const {name, refused} = await putFile(this.#connection, file);
        setText(this.busy, "");
        if (refused) this.#toasts.show(refused);
        return name;
    }

    #refused(code, value, message) {
        this.#toasts.show({code, field: "", value, message});
    }
}
