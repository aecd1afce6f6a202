// The show as a file: saved, opened and downloaded from here; what is not saved, and what a restart of the server lost.

import {pageRole} from "./control.js";
import {h, setText, tableHead} from "./dom.js";
import {plainName, saveFile} from "./capture.js";
import {bytesOf} from "./connection.js";
import {askUnsaved} from "./unsaved.js";
import {putFile} from "./upload_file.js";

const kNotHeld = "The show will not hold its scene: the scene's files have more than 128 MiB, or could not be read again. It opens only where they are.";
const kSizes = ["B", "kB", "MB"];

function sizeText(bytes) {
    let at = 0;
    for (; bytes >= 1000 && at + 1 < kSizes.length; ++at) bytes /= 1000;
    return `${bytes.toFixed(at && bytes < 10 ? 1 : 0)} ${kSizes[at]}`;
}

function ageText(seconds) {
    for (const [unit, one] of [["day", 86400], ["h", 3600], ["min", 60]])
        if (seconds >= one) return `${Math.floor(seconds / one)} ${unit}${unit === "day" && seconds >= 2 * one ? "s" : ""} ago`;
    return "just now";
}

export class Shows {
    #store; #connection; #toasts;
    #name = h("span");
    #state = h("span", {class: "warn", id: "show-state", role: "status"});
    #loose = h("button", {type: "button", class: "quiet warn bad", id: "show-loose", hidden: true, onclick: () => this.#list(true)}, "Scene not in the show");
    #held = h("p", {class: "warn bad", id: "show-not-held", role: "alert", hidden: true});
    #lost = h("span", {class: "warn", id: "show-lost", role: "alert"});
    #forget = h("button", {type: "button", class: "quiet", "aria-label": "Dismiss what the restart lost", hidden: true, onclick: () => this.#tellLost("")}, "×");
    #field = h("input", {type: "text", maxlength: 100, "aria-label": "Name to save the show under", placeholder: "Name of the show"});
    #hint = h("p", {class: "hint"});
    #rows = h("tbody");
    #problem = h("p", {class: "problem", role: "alert", hidden: true});
    #dialog;
    #seen = null;    // boot, scene_rev and unsaved of the last state that was shown

    // node: in the bar; drop: where the file of a show may be dropped.
    constructor(store, connection, toasts, node, drop) {
        this.#store = store;
        this.#connection = connection;
        this.#toasts = toasts;
        const file = h("input", {type: "file", accept: ".json,application/json", hidden: true, "aria-label": "Show file to open"});
        file.addEventListener("change", () => {
            if (file.files[0]) this.openFile(file.files[0]);
            file.value = "";
        });
        const saveAs = h("form", {class: "inline", id: "show-save-as"}, this.#field, h("button", {}, "Save as"));
        saveAs.addEventListener("submit", (event) => {
            event.preventDefault();
            this.#save(this.#field.value.trim());
        });
        const mine = pageRole === "viewer" ? [] : [
            h("div", {class: "row"}, h("button", {type: "button", id: "show-save", title: "Ctrl+S", onclick: () => this.#save("")}, "Save"), saveAs)];
        const open = pageRole === "viewer" ? [] : [h("button", {type: "button", class: "quiet", onclick: () => file.click()}, "Open a file…"), file];
        this.#dialog = h("dialog", {id: "show-dialog", "aria-label": "Shows"},
            h("header", {class: "row"}, h("h2", {}, "Shows"), h("span", {class: "grow"}),
                h("button", {type: "button", class: "quiet", "aria-label": "Close", onclick: () => this.#dialog.close()}, "×")),
            this.#held, ...mine, this.#problem, this.#hint,
            h("div", {class: "scroll", tabindex: "0"}, h("table", {},
                tableHead(["Show", "Size", "Saved", "~Open, rename, remove"]), this.#rows)),
            h("div", {class: "row"}, ...open,
                h("button", {type: "button", class: "quiet", id: "show-download", onclick: () => this.#download("")}, "Download the show as it stands"),
                h("button", {type: "button", class: "quiet", id: "scene-download-glb", title: "Surfaces, lights and camera as glTF, for Blender and other programs", onclick: () => this.#downloadScene("glb")}, "Scene as .glb"),
                h("button", {type: "button", class: "quiet", id: "scene-download-mvr", title: "Surfaces, fixtures and patch as MVR, for consoles and other programs", onclick: () => this.#downloadScene("mvr")}, "Scene as .mvr")));
        document.body.append(this.#dialog);
        node.append(h("button", {type: "button", class: "quiet", id: "show-open", title: "Save, open and download shows", onclick: () => this.#list(true)}, "Show ", this.#name),
            this.#state, this.#loose, this.#lost, this.#forget);
        connection.addEventListener("ready", ({detail}) => this.#compare(detail.state));
        document.addEventListener("keydown", (event) => {
            if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "s" || pageRole === "viewer") return;
            event.preventDefault();    // also under a dialog: the browser's own would save the page
            if (document.querySelector("dialog[open]")) return;
            this.#store.state?.show?.name ? this.#save("") : this.#list(true);
        });
        drop.addEventListener("drop", (event) => {
            const dropped = event.dataTransfer?.files[0];
            if (!dropped?.name.toLowerCase().endsWith(".json")) return;
            event.preventDefault();
            event.stopImmediatePropagation();    // it is no scene
            this.openFile(dropped);
        }, {capture: true});
    }

    update() {
        const {show = {}, boot, scene_rev} = this.#store.state;
        this.#seen = {boot, scene_rev, unsaved: show.unsaved};
        setText(this.#name, show.name ?? "");
        setText(this.#state, show.unsaved ? "Not saved" : "");
        const save = this.#dialog.querySelector("#show-save");
        if (save) save.disabled = !show.can_save || !show.name;
        this.#held.hidden = this.#loose.hidden = !show.not_held;
        setText(this.#held, show.not_held ? kNotHeld : "");
        this.#loose.title = this.#held.textContent;
        this.#state.title = show.unsaved ? "The show has changed since it was saved or opened" : "";
    }

    // A run of the server that began with less than this page has seen.
    #compare({boot, restored_rev = 0}) {
        if (!this.#seen?.boot || this.#seen.boot === boot) return;
        const lost = restored_rev ? this.#seen.scene_rev > restored_rev : this.#seen.unsaved;
        this.#tellLost(!lost ? "" : restored_rev ? "The restart lost unsaved changes" : "The server began anew: unsaved changes are lost");
        if (!lost) this.#toasts.show({code: "restarted", message: `The server restarted${restored_rev ? "" : " and began anew"}. Nothing unsaved was lost.`});
    }

    #tellLost(text) {
        setText(this.#lost, text);
        this.#forget.hidden = !text;
    }

    // Result: the answer's part of this name; null after a refusal, which is told.
    async #ask(message, part) {
        const answer = await this.#connection.request(message).catch(() => ({result: {code: "disconnected", message: "There is no connection."}}));
        const refused = answer.result && answer.result.code !== "ok" ? answer.result : null;
        this.#refuse(refused);
        return refused ? null : answer[part];
    }

    #refuse(result) {
        this.#problem.hidden = !result;
        if (result) setText(this.#problem, [result.message, result.value].filter(Boolean).join(" · "));
        if (result && !this.#dialog.open) this.#toasts.show(result);
    }

    async #list(opens = false) {
        if (opens && !this.#dialog.open) this.#dialog.showModal();
        const {show = {}} = this.#store.state ?? {};
        if (opens) this.#field.value = show.name ?? "";
        for (const node of this.#dialog.querySelectorAll("#show-save-as *")) node.disabled = !show.can_save;
        const shows = await this.#ask({shows: {}}, "shows");
        if (!shows) return;
        const {shows: list = [], left_out = 0} = shows;
        setText(this.#hint, !show.can_save ? "This server keeps no shows: goniod --shows names a folder. Files can be opened and downloaded."
            : left_out ? `${left_out} more are in the server's folder.` : list.length ? "" : "Nothing is saved yet.");
        this.#hint.hidden = !this.#hint.textContent;
        this.#rows.replaceChildren(...list.map(({name, bytes, age_s}) => h("tr", {"data-show": name}, h("td", {}, name === show.name ? h("strong", {}, name) : name),
            h("td", {}, sizeText(bytes)), h("td", {}, ageText(age_s)),
            h("td", {}, pageRole === "viewer" ? null : h("button", {type: "button", class: "quiet", "aria-label": `Open ${name}`, onclick: () => this.#openShow(name)}, "Open"),
                h("button", {type: "button", class: "quiet", "aria-label": `Download ${name}`, onclick: () => this.#download(name)}, "Download"),
                ...(pageRole === "viewer" ? [] : [
                    h("button", {type: "button", class: "quiet", "aria-label": `Rename ${name}`, onclick: () => this.#rename(name)}, "Rename"),
                    h("button", {type: "button", class: "quiet", "aria-label": `Delete ${name}`, onclick: () => this.#remove(name)}, "Delete")])))));
    }

    // Result: null: the user wants this scene to stay; else what of it stays when another one takes its place, as
    // load_scene has it. Asks where something is not saved and, if the next one is a scene, of a show with a name.
    async replace(byScene, file = "") {
        const {show, lights = [], scene = ""} = this.#store.state ?? {};
        const keepable = byScene && lights.length > 0, isMvr = (name) => name.toLowerCase().endsWith(".mvr");
        if (!show?.unsaved && !(keepable && show?.name)) return {};
        return askUnsaved(show, (name) => name === null ? this.#download("") : this.#save(name), keepable, byScene && isMvr(file) && isMvr(scene));
    }

    // began: told when the question is answered and the scene is loaded.
    async loadScene(file, began = () => {}) {
        const stays = await this.replace(true, file);
        if (!stays) return null;
        began();
        const result = await this.#connection.command({load_scene: {file, ...stays}}, {quiet: true});
        if (result?.code === "ok") this.#store.noteLoad(result);
        else if (result) this.#toasts.show({...result, value: [file.replace(/^upload:/, ""), result.value].filter(Boolean).join(": ")});
        return result;
    }

    // name: "" is that of the show. Result: whether it is saved.
    async #save(name, replace = false) {
        const answer = await this.#connection.request({save_show: {name, replace}}).catch(() => ({}));
        const result = answer.result ?? {code: "disconnected", message: "There is no connection."};
        if (result.code === "already_exists" && confirm(`There is another show ${name}. Write over it?`)) return this.#save(name, true);
        this.#refuse(result.code === "ok" ? null : result);
        if (result.code === "ok") this.#toasts.show({code: "saved", message: [`The show is saved as ${this.#store.state.show?.name || name}`, ...result.warnings ?? []].join(". ")});
        if (result.code === "ok" && this.#dialog.open) this.#list();
        return result.code === "ok";
    }

    // Result: whether the server did what the message asks for; the list is that of its folder then.
    async #edit(message) {
        const answer = await this.#connection.request(message).catch(() => ({}));
        const result = answer.result ?? {code: "disconnected", message: "There is no connection."};
        this.#refuse(result.code === "ok" ? null : result);
        if (result.code === "ok") await this.#list();
        return result.code === "ok";
    }

    #rename(name) {
        const new_name = prompt("Another name of the show", name)?.trim();
        if (new_name && new_name !== name) this.#edit({rename_show: {name, new_name}});
    }

    #remove(name) {
        if (confirm(`Delete the show ${name} for good?`)) this.#edit({remove_show: {name}});
    }

    async #openShow(name) {
        if (!await this.replace(false)) return;
        const result = await this.#connection.command({open_show: {name}}, {quiet: true}) ?? {code: "disconnected", message: "The connection ended before the server answered."};
        this.#refuse(result.code === "ok" ? null : result);
        if (result.code !== "ok") return;
        this.#dialog.close();
        this.#store.noteLoad(result);
    }

    async openFile(file) {
        if (pageRole === "viewer") return;
        const {name, refused} = await putFile(this.#connection, file);
        if (refused) this.#refuse(refused);
        else await this.#openShow(name);
    }

    async #downloadScene(format) {
        const token = this.#connection.token;
        const response = await fetch(`/v1/scene.${format}`, {cache: "no-store", headers: token ? {Authorization: `Bearer ${token}`} : {}}).catch(() => null);
        this.#refuse(response?.ok ? null : {code: "download", message: response ? (await response.text()).trim() : "The download broke off."});
        if (response?.ok) saveFile(await response.blob(), `${plainName(this.#store.state?.scene)}.${format}`);
    }

    async #download(name) {
        const shows = await this.#ask({shows: {text_of: name}}, "shows");
        if (!shows) return false;
        if (shows.not_held) this.#refuse({code: "download", message: `The file has no scene: ${shows.not_held}`});
        saveFile(new Blob([bytesOf(shows.text)], {type: "application/json"}), `${name || this.#store.state.show?.name || "show"}.json`);
        return true;
    }
}
