// node --experimental-websocket qlc_say.js MESSAGE…: tells QLC+ something over its web interface.
const socket = new WebSocket("ws://127.0.0.1:9999/qlcplusWS");
socket.onopen = () => {
    for (const message of process.argv.slice(2)) socket.send(message);
    setTimeout(() => process.exit(0), 1000);
};
socket.onmessage = (event) => console.log(`# QLC+ says ${event.data}`);
socket.onerror = (error) => {
    console.error(error.message);
    process.exit(1);
};
