// Another scene or show is about to take the place of one that is worked on: asks what becomes of it.

import {h} from "./dom.js";

// show: state.show. save(name): saves it and returns whether it did; name is null where the server keeps no shows and the
// page downloads it. keepable: whether the next scene may have the lights of this one. mergeable: whether it may be the next
// edition of this one's MVR show. Result: null: stay; else what of it stays, as load_scene has it: keep, or merge.
export function askUnsaved(show, save, keepable, mergeable = false) {
    if (document.getElementById("unsaved-dialog")) return Promise.resolve(null);    // one question at a time
    const name = h("input", {type: "text", maxlength: 100, value: show.name ?? "", required: true, "aria-label": "Name to save the show under", placeholder: "Name of the show"});
    const problem = h("p", {class: "problem", role: "alert", hidden: true}, "It was not saved.");
    const keep = h("input", {type: "checkbox", id: "unsaved-keep"}), merge = h("input", {type: "checkbox", id: "unsaved-merge"});
    for (const [one, other] of [[keep, merge], [merge, keep]]) one.addEventListener("change", () => { if (one.checked) other.checked = false; });
    let answer = null;
    const end = (goesOn) => {
        if (goesOn) answer = mergeable && merge.checked ? {merge: true} : {keep: keepable && keep.checked ? ["lights", "cues", "views", "grids"] : []};
        dialog.close();
    };
    const form = h("form", {class: "inline"}, show.can_save ? name : null, h("button", {id: "unsaved-save"}, show.can_save ? "Save, then load" : "Download, then load"));
    form.hidden = !show.unsaved;
    form.addEventListener("submit", async (event) => {
        event.preventDefault();
        problem.hidden = true;
        if (await save(show.can_save ? name.value.trim() : null)) end(true);
        else problem.hidden = false;
    });
    const dialog = h("dialog", {id: "unsaved-dialog", "aria-labelledby": "unsaved-title"},
        h("h2", {id: "unsaved-title"}, !show.unsaved ? `${show.name} is saved` : show.name ? `${show.name} has changed since it was saved` : "The show is not saved"),
        h("p", {class: "hint"}, `Undo brings it back after loading. ${show.can_save ? "A show saved on the server stays beyond that." : "A downloaded show can be opened again beyond that."}`),
        keepable ? h("label", {}, keep, " Keep the lights, cues, views and grids: another file of the same room") : null,
        mergeable ? h("label", {}, merge, " Merge: the next edition of this MVR show. Cues, presets, levels and grids stay; what the file changed is told") : null, form, problem,
        h("div", {class: "row"}, h("button", {type: "button", class: "quiet", id: "unsaved-discard", onclick: () => end(true)}, show.unsaved ? "Load without saving" : "Load"),
            h("button", {type: "button", class: "quiet", id: "unsaved-cancel", onclick: () => end(false)}, "Cancel")));
    document.body.append(dialog);
    dialog.showModal();
    return new Promise((resolve) => dialog.addEventListener("close", () => {
        dialog.remove();
        resolve(answer);
    }));
}
