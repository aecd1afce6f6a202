// How soon a page shows what another client commands: how it compares with the server's own times. It runs alone.
//   node latency_test.mjs GONIOD_BINARY

import {check, inBrowser, listen, settled, startServer, until} from "./harness.mjs";

await inBrowser(async (browser, servers) => {
    servers.push(await startServer("127.0.0.1:0"));
    const page = await (await browser.newContext({viewport: {width: 1440, height: 900}})).newPage();
    listen(page);
    await page.goto(servers[0].url);
    await until("a decoded frame", () => page.evaluate(() => window.gonio.framesDecoded > 0));
    await settled(page);

    // From sending a command to the picture on the canvas that contains it.
    const latency = await page.evaluate(() => new Promise((resolve) => {
        const socket = new WebSocket(`ws://${location.host}/v1/ws`, "gonio.v1.json");
        const tick = () => new Promise((done) => { const {port1, port2} = new MessageChannel(); port1.onmessage = done; port2.postMessage(0); });
        const times = [];
        const home = window.gonio.state.exposure_ev100;
        let sent = 0;
        const send = () => {
            const back = times.length === 30;
            sent = performance.now();
            socket.send(JSON.stringify({request_id: 2, command: {set_exposure: {ev100: back ? home : home + 0.01 * (1 + times.length)}}}));
        };
        socket.onopen = () => socket.send(JSON.stringify({request_id: 1, identify: {client: "stopwatch"}}));
        socket.onmessage = async ({data}) => {
            const message = JSON.parse(data);
            if (message.ready) return send();
            if (message.request_id !== 2) return;
            while (window.gonio.shownRev < message.result.scene_rev) await tick();
            if (times.length === 30) { socket.close(); return resolve(times.sort((a, b) => a - b)); }
            times.push(performance.now() - sent);
            setTimeout(send, 20);
        };
    }));
    // At most 1.5 frame times, the encoder's and 10 ms where nothing else runs; here the browser shares the cores.
    const timed_ms = await page.evaluate(async () => {
        const text = await (await fetch("/metrics")).text();
        const mean = (name) => ["sum", "count"].map((part) => Number(text.match(new RegExp(`^gonio_${name}_${part}(?:{[^}]*})? (.*)$`, "m"))[1]))
            .reduce((sum, count) => 1000 * sum / count);
        return 1.5 * Math.max(1000 / 60, mean("render_seconds")) + mean("encode_seconds") + 10;
    });
    check(latency.length === 30 && latency[15] < 2 * timed_ms, "each of 30 commands was drawn soon",
        `command to canvas p50 ${latency[15].toFixed(1)} ms, p90 ${latency[27].toFixed(1)} ms; 1.5 frames, encoder and 10 ms: ${timed_ms.toFixed(1)} ms`);
});
