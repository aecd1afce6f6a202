// Light or dark: as the system asks, or as chosen here; kept by this browser.

import {h} from "./dom.js";

const kThemes = [["", "Light or dark: as the system"], ["light", "Light"], ["dark", "Dark"]];
const kKey = "gonio.theme";

// A browser may refuse to keep anything: then the choice lasts as long as the page.
function kept() {
    try {
        return localStorage.getItem(kKey) ?? "";
    } catch {
        return "";
    }
}

function keep(theme) {
    try {
        localStorage.setItem(kKey, theme);
    } catch { /* see above */ }
}

// node: where the button goes.
export function themeSwitch(node) {
    const button = h("button", {type: "button", class: "quiet", id: "theme"}, "◐");
    let at = Math.max(0, kThemes.findIndex(([theme]) => theme === kept()));
    const show = () => {
        const [theme, text] = kThemes[at];
        if (theme) document.documentElement.dataset.theme = theme;
        else delete document.documentElement.dataset.theme;
        button.title = `${text}. Click to change`;
        button.setAttribute("aria-label", `Appearance: ${text}`);
    };
    button.addEventListener("click", () => {
        at = (at + 1) % kThemes.length;
        keep(kThemes[at][0]);
        show();
    });
    show();
    node.append(button);
}
