#!/usr/bin/env python3
"""goniod and a sender that others wrote, in a network namespace of their own: nothing leaves this machine.

  run.py GONIOD GONIO ola|qlc|sacn|artnet|dmxnet|osc|interfaces

Each ends as a level in the scene and as a changed frame. Exit code 0: it did; 1: it did not; 77: the sender, or the right to
make a namespace, is missing here.
"""
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
PATCH = """
[[patch]]
sacn = 1
address = 1
target = "luminaire"
channels = ["level"]
[[patch]]
sacn = 2
address = 1
target = "luminaire"
channels = ["level"]
[[patch]]
artnet = 0
address = 1
target = "luminaire"
channels = ["level"]
[[patch]]
artnet = 2
address = 1
target = "luminaire"
channels = ["level"]
[[patch]]
artnet = 3
address = 1
target = "luminaire"
channels = ["level"]
[[patch]]
artnet = 5
address = 1
target = "luminaire"
channels = ["red"]
"""
NEEDS = {"ola": ["olad", "ola_patch", "runuser"], "qlc": ["qlcplus", "node"], "sacn": ["node"], "artnet": ["node"],
         "dmxnet": ["node"], "osc": ["oscsend"], "interfaces": []}
children = []


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def enter_namespace():
    """Starts this script again where only a loopback interface exists."""
    if os.environ.get("GONIO_NAMESPACE"):
        subprocess.run(["ip", "link", "set", "lo", "up", "multicast", "on"], check=True)
        return
    unshare = ["unshare", "--net"] if os.geteuid() == 0 else ["unshare", "--map-root-user", "--net"]
    if subprocess.run(unshare + ["true"], stderr=subprocess.DEVNULL).returncode != 0:
        skip("no right to make a network namespace")
    os.environ["GONIO_NAMESPACE"] = "1"
    os.execvp("unshare", unshare + [sys.executable, __file__, *sys.argv[1:]])


def start(command, **more):
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, **more)
    children.append(child)
    return child


class Server:
    def __init__(self, goniod, gonio, sacn, artnet, folder):
        self.gonio = gonio
        patch = folder / "patch.toml"
        patch.write_text(PATCH)
        self.process = start([goniod, "--listen", "127.0.0.1:0", "--size", "128x128", "--patch", str(patch), "--sacn", sacn,
                              "--artnet", artnet, "--osc", "127.0.0.1"], stdout=subprocess.PIPE, text=True)
        ready = self.process.stdout.readline()
        match = re.match(r"READY (http://\S+)", ready)
        if not match:
            raise RuntimeError(f"goniod said {ready!r}")
        self.url = match[1]
        while not self.ask("stats")["transport_ready"]:
            time.sleep(0.1)
        self.ask("report")  # the frame that shows its links; the next one need not

    def ask(self, *words):
        done = subprocess.run([self.gonio, "--server", self.url, "--json", *words], capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        return json.loads(done.stdout)

    def light(self):
        return self.ask("get", "lights[0]")

    def level(self):
        return self.light()["level_ratio"]

    def until(self, what, probe, time_s=20.0):
        end = time.monotonic() + time_s
        while time.monotonic() < end:
            if probe():
                print(f"ok - {what}")
                return
            time.sleep(0.1)
        print(f"not ok - {what}: level {self.level()}")
        print(json.dumps(self.ask("sources"), indent=1))
        raise SystemExit(1)

    def level_becomes(self, slot, what, time_s=20.0):
        self.until(f"{what}: level {slot}/255", lambda: abs(self.level() - slot / 255) < 1e-6, time_s)
        self.frame_is_cheap()

    def frame_is_cheap(self):
        rev = self.ask("get", "scene_rev")
        report = self.ask("report", "--rev", str(rev))
        ran = sorted({one["name"] for one in report["passes"] if one["state"] == "ran"})
        if report["scene_rev"] < rev or ran not in (["composite"], ["composite", "nv12"]):
            print(f"not ok - the frame of revision {rev} ran {ran}")
            raise SystemExit(1)
        print(f"ok - the frame of revision {rev} ran {ran}")

    def source(self, protocol, universe):
        return [row for row in self.ask("sources")["sources"] if (row["protocol"], row["universe"]) == (protocol, universe)]


def check(condition, what):
    print(("ok - " if condition else "not ok - ") + what)
    if not condition:
        raise SystemExit(1)


def osc(server, folder):
    subprocess.run(["oscsend", "osc.udp://127.0.0.1:9000", "/light/luminaire/level", "f", "0.75"], check=True)
    server.until("oscsend: level 0.75", lambda: abs(server.level() - 0.75) < 1e-6)
    server.frame_is_cheap()
    subprocess.run(["oscsend", "osc.tcp://127.0.0.1:9000", "/light/lum*/color", "fff", "1", "0.5", "0.25"], check=True)
    server.until("oscsend over TCP: a colour", lambda: server.light()["color_rgb"] == [1, 0.5, 0.25])


def sacn(server, folder):
    start(["node", "senders.js", "sacn"], cwd=HERE)
    server.level_becomes(102, "the npm sacn sender of priority 150 wins over 255 at 100")
    rows = server.source("sacn", 1)
    check({row["name"]: row["priority"] for row in rows} == {"npm-sacn": 100, "npm-sacn-backup": 150}, "both are in the table")
    check(all(row["out_of_order"] == 0 and row["lost"] == 0 for row in rows), "none of their packets is lost or late")
    server.level_becomes(255, "when it ends the other one is heard")


def artnet(server, folder):
    start(["node", "senders.js", "artnet"], cwd=HERE)
    server.level_becomes(153, "npm artnet")


def dmxnet(server, folder):
    start(["node", "senders.js", "dmxnet"], cwd=HERE, stdout=subprocess.DEVNULL)
    server.level_becomes(204, "npm dmxnet")


def interfaces(server, folder):
    """Listening on 0.0.0.0: multicast is heard on the loopback interface, on another one, and on one that comes later."""
    desk = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sequence = 0

    def send(address, level):
        nonlocal sequence
        sequence = (sequence + 1) % 256
        packet = bytearray(126 + 4)
        packet[0:16] = b"\x00\x10\x00\x00ASC-E1.17\x00\x00\x00"
        for at in (16, 38, 115):  # the lengths of the layers
            packet[at:at + 2] = (0x7000 | len(packet) - at).to_bytes(2, "big")
        packet[21], packet[43], packet[44:48], packet[108], packet[111] = 4, 2, b"desk", 100, sequence
        packet[22:38] = bytes(16 * [5])
        packet[114], packet[117], packet[118], packet[122], packet[124], packet[126] = 1, 2, 0xA1, 1, 5, level
        desk.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
        desk.sendto(packet, ("239.255.0.1", 5568))
        return True

    for name, address, level in (("the loopback interface", "127.0.0.1", 51), ("another interface", "10.7.0.1", 102),
                                 ("one that came later", "10.8.0.1", 153)):
        if level == 153:
            add_pair("w", address)
        server.until(f"sACN by multicast on {name}: level {level}/255",
                     lambda: send(address, level) and abs(server.level() - level / 255) < 1e-6)
    check(all(row["out_of_order"] == 0 for row in server.source("sacn", 1)), "each packet is heard once")


def add_pair(name, address):
    for command in (f"ip link add {name}0 type veth peer name {name}1", f"ip addr add {address}/24 dev {name}0",
                    f"ip link set {name}0 up multicast on", f"ip link set {name}1 up"):
        if subprocess.run(command.split()).returncode != 0:
            skip(f"'{command}' is not allowed here")


OLA_OFF = ("dmx4linux espnet ftdidmx gpio karate kinet milinst opendmx openpixelcontrol osc pathport renard sandnet shownet spi "
           "stageprofi uartdmx usbdmx usbserial nanoleaf").split()


def ola(server, folder):
    conf = folder / "ola"
    conf.mkdir()
    for plugin in OLA_OFF:
        (conf / f"ola-{plugin}.conf").write_text("enabled = false\n")
    (conf / "ola-dummy.conf").write_text("enabled = true\n")
    (conf / "ola-e131.conf").write_text("enabled = true\nip = 127.0.0.2\ncid = 11111111-2222-3333-4444-555555555555\n"
                                        "input_ports = 2\noutput_ports = 2\nrevision = 0.46\nignore_preview = true\n"
                                        "prepend_hostname = false\n")
    (conf / "ola-artnet.conf").write_text("enabled = true\nip = 127.0.0.2\nalways_broadcast = false\nuse_loopback = true\n"
                                          "use_limited_broadcast = false\nnet = 0\nsubnet = 0\noutput_ports = 1\nshort_name = OLA\n")
    for path in [folder, conf, *conf.iterdir()]:
        shutil.chown(path, "nobody")
    # olad refuses to run as root.
    start(["runuser", "-u", "nobody", "--", "olad", "-c", str(conf), "-l", "1", "--no-register-with-dns-sd", "--no-http"],
          stderr=subprocess.DEVNULL)

    def devices():
        done = subprocess.run(["ola_dev_info"], capture_output=True, text=True)
        return {name: re.search(rf"Device (\d+): .*{name}", done.stdout) for name in ("E1.31", "ArtNet")}

    end = time.monotonic() + 15
    while not all(devices().values()):
        check(time.monotonic() < end, "olad has its devices")
        time.sleep(0.2)
    number = {name: match[1] for name, match in devices().items()}
    for device, universe in ((number["E1.31"], 1), (number["ArtNet"], 2)):
        subprocess.run(["ola_patch", "-d", device, "-p", "0", "-u", str(universe)], check=True)
    subprocess.run(["ola_set_priority", "-d", number["E1.31"], "-p", "0", "-o", "120"], stdout=subprocess.DEVNULL)
    subprocess.run(["ola_set_dmx", "-u", "1", "-d", "51,128,64"], check=True)
    server.level_becomes(51, "OLA, E1.31 by multicast")
    row = server.source("sacn", 1)[0]
    check(row["priority"] == 120 and row["slots"] < 512, f"its priority is {row['priority']}, its packets have {row['slots']} slots")
    subprocess.run(["ola_patch", "-d", number["E1.31"], "-p", "0", "-u", "1", "--unpatch"], check=True)
    server.until("OLA terminates, without slots", lambda: server.source("sacn", 1)[0]["state"] == "terminated")
    subprocess.run(["ola_set_dmx", "-u", "2", "-d", "178,8,7"], check=True)
    universe = next((u for u in (0, 2) if server.source("artnet", u)), 0)
    server.level_becomes(178, f"OLA, Art-Net by unicast after our poll reply (universe {universe})")


def qlc(server, folder):
    environment = dict(os.environ, HOME=str(folder), XDG_RUNTIME_DIR=str(folder), QT_QPA_PLATFORM="offscreen")
    start(["qlcplus", "--nogui", "--operate", "--web", "--nowm", "--open", str(HERE / "qlc.qxw")], env=environment,
          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    server.until("QLC+ sends E1.31", lambda: any(row["state"] == "live" for row in server.source("sacn", 2)), 40)
    server.until("QLC+ sends Art-Net", lambda: server.source("artnet", 5))
    watch = start([server.gonio, "--server", server.url, "--json", "watch"], stdout=subprocess.PIPE, text=True)
    time.sleep(1)
    subprocess.run(["node", "--no-warnings", "--experimental-websocket", str(HERE / "qlc_say.js"), "QLC+API|setFunctionStatus|0|1"],
                   check=True)
    server.level_becomes(200, "QLC+, E1.31, at the end of its fade")
    server.until("QLC+, Art-Net, in the same fade: red", lambda: server.light()["color_rgb"][0] == 1)
    time.sleep(0.5)
    watch.terminate()
    levels = []
    for line in watch.stdout.read().splitlines():
        for light in (json.loads(line).get("state_changed", {}).get("state", {}) or {}).get("lights", []):
            if not levels or levels[-1] != light["level_ratio"]:
                levels.append(light["level_ratio"])
    levels = levels[1:] if levels and levels[0] == 1 else levels  # as the scene was before QLC+ held it at 0
    steps = [b - a for a, b in zip(levels, levels[1:])]
    print(f"# the 500 ms fade: {len(levels)} levels, {', '.join(f'{level * 255:.0f}' for level in levels)}")
    check(len(levels) >= 10, f"the fade has {len(levels)} levels")
    check(all(step > 0 for step in steps), "it only rises")
    check(max(steps) <= 0.2 * 200 / 255, f"its largest step is {max(steps) * 255:.0f} of 200")


def main():
    goniod, gonio, sender = sys.argv[1:]
    for program in NEEDS[sender] + ["ip", "unshare"]:
        if shutil.which(program) is None:
            skip(f"{program} is missing")
    if sender in ("sacn", "artnet", "dmxnet") and not (HERE / "node_modules" / sender).exists():
        skip(f"npm {sender} is missing")
    enter_namespace()
    sacn = artnet = "127.0.0.1"
    if sender == "ola":
        # OLA takes no loopback interface: one end of a pair carries its 127.0.0.2 and the multicast, and 127.0.0.4 where
        # goniod answers its polls.
        for command in ("ip link add v0 type veth peer name v1", "ip addr add 127.0.0.2/8 brd + dev v0", "ip addr add 127.0.0.4/8 brd + dev v0", "ip link set v0 up multicast on",
                        "ip link set v1 up", "ip route replace 239.255.0.0/16 dev v0 src 127.0.0.2",
                        "sysctl -qw net.ipv4.conf.all.route_localnet=1 net.ipv4.conf.v0.route_localnet=1"):
            if subprocess.run(command.split()).returncode != 0:
                skip(f"'{command}' is not allowed here")
        sacn, artnet = "127.0.0.2", "127.0.0.4"
    if sender == "interfaces":
        add_pair("v", "10.7.0.1")
        sacn = "0.0.0.0"
    with tempfile.TemporaryDirectory(prefix="gonio-consoles-") as folder:
        try:
            globals()[sender](Server(goniod, gonio, sacn, artnet, pathlib.Path(folder)), pathlib.Path(folder))
        finally:
            for child in reversed(children):
                child.terminate()
            for child in children:
                try:
                    child.wait(5)
                except subprocess.TimeoutExpired:
                    child.kill()


main()
