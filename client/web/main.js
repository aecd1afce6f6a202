// Wires the page: one connection, one store, and the parts that show it.

import {setText} from "./dom.js";
import {fitUnaskedSize} from "./fit_size.js";
import {Connection} from "./connection.js";
import {Store} from "./store.js";
import {Video} from "./video.js";
import {CameraHand} from "./camera.js";
import {BeamView} from "./beam.js";
import {IsoluxFigures} from "./isolux.js";
import {Handles} from "./handles.js";
import {LibraryPanel} from "./library.js";
import {Tools} from "./tools.js";
import {workLightBadge} from "./work_light.js";
import {legend} from "./legend.js";
import {scalePanel} from "./scale.js";
import {debugPanel} from "./debug.js";
import {hazePanel} from "./haze.js";
import {lookPanel} from "./look.js";
import {masterPanel, lightPanel, groupPanel} from "./lights.js";
import {viewProperty, viewTabs, followSelection, picturePanel, scenePanel} from "./picture.js";
import {inspector} from "./inspector.js";
import {drawer} from "./drawer.js";
import {shortcutHelp} from "./shortcuts.js";
import {themeSwitch} from "./theme.js";
import {ReportPanel} from "./report.js";
import {MeterPanel} from "./meter.js";
import {RenderPanel} from "./render.js";
import {statsStrip} from "./stats.js";
import {Toasts} from "./toast.js";
import {ConsolesPanel} from "./consoles.js";
import {SurfacesPanel} from "./surfaces.js";
import {viewPanel} from "./views.js";
import {ComparePanel} from "./compare.js";
import {GridPanel} from "./grid.js";
import {presetPanel} from "./presets.js";
import {CuePanel} from "./cues.js";
import {controlPanel, onlyLook} from "./control.js";
import {Uploads} from "./uploads.js";
import {undoPanel} from "./undo.js";
import {Shows} from "./shows.js";
import {PatchPanel} from "./patch.js";
import {panels} from "./panels.js";

const $ = (id) => document.getElementById(id);

const connection = new Connection(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/v1/ws`);
const store = new Store(connection);
const video = new Video(connection, $("canvas"), $("still"));
const cameraHand = new CameraHand(store, [$("canvas"), $("still")], (event) => handles.takes(event), (event) => handles.under(event));
const handles = new Handles(store, connection, $("screen"), [$("canvas"), $("still")]);
const beam = new BeamView(store, connection, handles, handles.svg);
const isolux = new IsoluxFigures(store, connection, video, handles, handles.svg);
const tools = new Tools(store, connection, handles, cameraHand, beam, $("screen"));
const toasts = new Toasts($("toasts"));
let compare = null;
drawer($("drawer"), [
    {id: "meter", title: "Meter", make: (node) => new MeterPanel(connection, node)},
    {id: "grids", title: "Grids", make: (node) => new GridPanel(store, connection, node, handles, handles.svg)},
    {id: "library", title: "Library", make: (node) => new LibraryPanel(store, connection, node, handles, $("screen"))},
    {id: "compare", title: "Compare", make: (node) => compare = new ComparePanel(store, connection, video, node, $("screen"))},
    {id: "render", title: "Render", make: (node) => new RenderPanel(store, connection, node, compare)},
    {id: "cues", title: "Cues", make: (node) => new CuePanel(store, connection, node)},
    {id: "consoles", title: "Consoles", make: (node) => new ConsolesPanel(connection, node)},
    {id: "surfaces", title: "Fader boxes", make: (node) => new SurfacesPanel(store, connection, node)},
    {id: "patch", title: "Patch", make: (node) => new PatchPanel(store, connection, node)},
    {id: "report", title: "Renderer", make: (node) => new ReportPanel(store, connection, node)},
]);

const shows = new Shows(store, connection, toasts, $("show"), $("screen"));
const parts = [
    masterPanel(store, $("master")), lightPanel(store, $("lights"), connection, () => handles.several), groupPanel(store, $("groups"), connection),
    presetPanel(store, $("presets"), connection), picturePanel(store, $("picture"), cameraHand, connection), viewTabs(store, $("views")),
    viewPanel(store, $("cameras"), cameraHand, connection), scenePanel(store, $("scene"), connection, (file, began) => shows.loadScene(file, began)),
    inspector(store, $("inspector"), connection, handles), controlPanel(store, $("control"), connection),
    beam, isolux, handles, tools, workLightBadge(store, connection, $("screen")),
    legend(store, $("screen")), scalePanel(store, $("scale"), connection), lookPanel(store, $("look"), connection), hazePanel(store, $("haze"), connection),
    debugPanel(store, $("debug"), viewProperty(store)), shows,
];
panels($("left"), $("stage"), $("drawer"));
themeSwitch($("page"));
shortcutHelp($("page"));
undoPanel(connection, $("history"));
onlyLook([$("left"), $("inspector"), $("scene"), $("views")]);
new Uploads(store, connection, toasts, $("scene"), $("screen"), (file) => shows.loadScene(file));
followSelection(store, connection);
const transport = statsStrip(store, video, connection, $("stats"), $("format"));

store.addEventListener("update", () => {
    parts.forEach((part) => part.update());
    document.body.classList.remove("blank");    // before the first state the controls would show nothing true
});
// Where the bar has no room for it, too.
const tellFormat = () => { if (video.lacks) toasts.show({code: "jpeg", message: video.lacks[1]}); };
video.addEventListener("mode", tellFormat);
tellFormat();
connection.addEventListener("refused", (event) => toasts.show(event.detail));

// The state of the connection: a pill that is always there, a veil over the picture while there is none.
let pictureSeen = false;
function showLink() {
    const {state, text, retryAt_ms} = connection.status;
    const left_s = Math.max(1, Math.ceil((retryAt_ms - performance.now()) / 1000));
    const wait = state === "waiting" ? `Retry in ${left_s} s` : text;
    $("link").dataset.state = state;
    setText($("link").querySelector("span"), state === "locked" ? "Locked" : wait);
    const waitingForPicture = state === "live" && !pictureSeen;
    $("veil").hidden = state === "live" && pictureSeen;
    $("veil").dataset.state = state;
    setText($("veil-text"), waitingForPicture ? "Waiting for the first picture…"
        : state === "waiting" ? `${text}. Trying again in ${left_s} s.` : state === "connecting" ? "Connecting…" : text);
    $("retry").hidden = state !== "waiting";
    $("token").hidden = state !== "locked";
    document.body.classList.toggle("offline", state !== "live");
    if (connection.hello) $("link").title = [connection.hello.server, connection.hello.renderer].filter(Boolean).join(" · ");
}
connection.addEventListener("status", showLink);
connection.addEventListener("ready", showLink);
fitUnaskedSize(connection);
video.addEventListener("shown", ({detail}) => { if (detail.final) handles.atRest(); });
video.addEventListener("shown", () => { pictureSeen = true; if (!$("veil").hidden) showLink(); });
setInterval(() => { if (connection.status.state === "waiting") showLink(); }, 250);
for (const id of ["link", "retry"]) $(id).addEventListener("click", () => connection.retry());
$("token").addEventListener("submit", (event) => {
    event.preventDefault();
    connection.unlock($("token").querySelector("input").value);
});

$("skip").addEventListener("click", (event) => {
    event.preventDefault();
    [$("canvas"), $("still")].find((picture) => !picture.hidden)?.focus();
});

// Read-only hooks for tests.
Object.defineProperty(window, "gonio", {value: Object.freeze({
    get framesDecoded() { return video.framesDecoded; },
    get shownRev() { return video.shownRev; },
    get shownFinal() { return video.shownFinal; },
    get sceneRev() { return store.state?.scene_rev ?? 0; },
    get connected() { return connection.live; },
    get mode() { return video.mode; },
    get gaps() { return video.gaps; },
    get answered() { return store.answered; },
    get transportReady() { return transport.ready; },
    get state() { return structuredClone(store.state); },
})});

showLink();
connection.open();
