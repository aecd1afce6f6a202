// Senders of sACN and Art-Net that others wrote, one a call, all to 127.0.0.1:
//   node senders.js sacn|artnet|dmxnet
// sacn: two of universe 1, priorities 100 (slot 1: 255) and 150 (slot 1: 102); after 6 s the one of 150 ends.
// artnet: universe 0, slot 1: 153, sent again every second. dmxnet: universe 3, slot 1: 204.
const wanted = process.argv[2];

async function sacn() {
    const {Sender} = require("sacn");
    const sender = (sourceName, priority, cid) => new Sender({universe: 1, port: 5568, reuseAddr: true, minRefreshRate: 10,
        useUnicastDestination: "127.0.0.1", iface: "127.0.0.1",
        defaultPacketOptions: {sourceName, priority, useRawDmxValues: true, ...(cid ? {cid} : {})}});
    const main = sender("npm-sacn", 100), backup = sender("npm-sacn-backup", 150, Buffer.alloc(16, 9));
    await main.send({payload: {1: 255, 512: 7}});
    await backup.send({payload: {1: 102}});
    setTimeout(() => backup.close(), 6000);
}

function artnet() {
    const desk = require("artnet")({host: "127.0.0.1", port: 6454});
    setInterval(() => desk.set(0, 1, [153, 50, 25]), 1000);
}

function dmxnet() {
    const dmxnet = require("dmxnet");
    const sender = new dmxnet.dmxnet({log: {level: "error"}, hosts: ["127.0.0.1"]})
        .newSender({ip: "127.0.0.1", subnet: 0, universe: 3, net: 0, base_refresh_interval: 100});
    sender.prepChannel(0, 204);
    sender.transmit();
}

({sacn, artnet, dmxnet})[wanted]();
