// Long work on a connection of its own: the server gives it up when that ends, and the page's own connection goes on.

import {Connection} from "./connection.js";

// message: a ClientMessage. told(Progress): how far it is. Result: {answer, cancel}: answer resolves with the
// ServerMessage, and rejects where it was cancelled or the connection ended.
export function askAlone(connection, message, told) {
    const own = new Connection(connection.url);
    own.video = false;
    let cancel;
    const answer = new Promise((resolve, reject) => {
        cancel = () => {
            own.close();
            reject(new Error("Cancelled"));
        };
        own.addEventListener("progress", ({detail}) => told(detail));
        own.addEventListener("ready", () => own.request(message).then(resolve, reject), {once: true});
        own.addEventListener("status", ({detail}) => { if (detail.state === "waiting" || detail.state === "locked") reject(new Error(detail.text)); });
        own.open();
    }).finally(() => own.close());
    return {answer, cancel};
}
