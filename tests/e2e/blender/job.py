#!/usr/bin/python3
"""Does what docs/page.md says of a whole job, from a Blender room to a signed report of its lux, command by command.

    job.py GONIOD GONIO PAGE.md

exits 0 if every step works and the report is right, 1 if not, 77 (skipped) where blender, its glTF exporter or openssl is missing.
The room is grey all over, so that the mean of its lux is known: what the luminaires give is what the walls swallow,
    flux = (1 - reflectance) * sum over the surfaces of mean lux times area.
"""

import csv
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

from daemon import ask, ending, start
from headless import SKIPPED, run_script

GREY, LENGTH, WIDTH, HEIGHT = 0.5, 6.0, 4.0, 2.8    # office_scene.py
BALANCE = 0.03                                      # of the flux


def steps(page):
    """Result: the commands of the job, one text for each block."""
    with open(page, encoding="utf-8") as file:
        job = file.read().split("## A job:", 1)[1].split("\n## ", 1)[0]
    return re.findall(r"^```sh\n(.*?)^```$", job, re.MULTILINE | re.DOTALL)


def check(condition, text):
    print(("ok   " if condition else "BAD  ") + text)
    if not condition:
        sys.exit(1)


def run_steps(page, directory, environment):
    for block in steps(page):
        print(block.rstrip())
        subprocess.run(["bash", "-euo", "pipefail", "-c", block], cwd=directory, env=environment, check=True, timeout=280)


def face_lx(gonio, url, corner, u, v, normal):
    grid = ask(gonio, url, "meter", "--point=" + corner, "--normal=" + normal, "--u=" + u, "--v=" + v, "--count", "8x8")
    return grid["mean_lx"]


def check_balance(gonio, url):
    """The energy that the luminaires send out ends in the six surfaces."""
    x, z = LENGTH / 2, WIDTH / 2
    faces = [
        (LENGTH * WIDTH, f"{-x},0,{-z}", f"{LENGTH},0,0", f"0,0,{WIDTH}", "0,1,0"),
        (LENGTH * WIDTH, f"{-x},{HEIGHT},{-z}", f"{LENGTH},0,0", f"0,0,{WIDTH}", "0,-1,0"),
        (LENGTH * HEIGHT, f"{-x},0,{-z}", f"{LENGTH},0,0", f"0,{HEIGHT},0", "0,0,1"),
        (LENGTH * HEIGHT, f"{-x},0,{z}", f"{LENGTH},0,0", f"0,{HEIGHT},0", "0,0,-1"),
        (WIDTH * HEIGHT, f"{-x},0,{-z}", f"0,0,{WIDTH}", f"0,{HEIGHT},0", "1,0,0"),
        (WIDTH * HEIGHT, f"{x},0,{-z}", f"0,0,{WIDTH}", f"0,{HEIGHT},0", "-1,0,0"),
    ]
    swallowed = sum((1 - GREY) * area * face_lx(gonio, url, *where) for area, *where in faces)
    lights = ask(gonio, url, "get")["lights"]
    sent = sum(light["flux_lm"] * light["multiplier"] * light["level_ratio"] for light in lights)
    check(abs(swallowed - sent) < BALANCE * sent, f"the walls swallow {swallowed:.0f} lm of the luminaires' {sent:.0f} lm")


def check_report(directory):
    def path(name):
        return os.path.join(directory, name)

    with open(path("report.csv"), encoding="utf-8", newline="") as file:
        lux = [float(row["lx"]) for row in csv.DictReader(file)]
    mean = sum(lux) / len(lux)
    with open(path("grid.json"), encoding="utf-8") as file:
        live = json.load(file)
    check(live["count"] == [8, 5] and len(lux) == 40, "the standard's 8 x 5 points")
    check(abs(live["mean_lx"] - mean) < 0.05 * mean, f"the live mean, {live['mean_lx']:.1f} lx, agrees with the path-traced {mean:.1f} lx")
    check(abs(live["uniformity_ratio"] - min(lux) / mean) < 0.05, f"uniformity {live['uniformity_ratio']:.3f}")
    check([row["name"] for row in live["checks"]] == ["Em", "U0"], "held against the target")
    with open(path("report.html"), encoding="utf-8") as file:
        report = file.read()
    check("<title>Room – lux report</title>" in report and "office-writing" in report and "seat" in report and "<script" not in report, "the report has title, target and observer, and no scripts")
    check(report.count("data:image/") >= 2, "and its pictures")
    with open(path("report.sha256"), encoding="utf-8") as file:
        signed = dict(reversed(line.split()) for line in file)
    check(set(signed) == {"room.glb", "report.html", "report.csv", "lux.exr"}, "all files are named")
    for name, digest in signed.items():
        with open(path(name), "rb") as file:
            check(hashlib.sha256(file.read()).hexdigest() == digest, f"{name} is the file that was signed for")


def check_signature(directory):
    verify = ["openssl", "pkeyutl", "-verify", "-pubin", "-inkey", "public.pem", "-rawin", "-in", "report.sha256", "-sigfile", "report.sig"]

    def holds():
        return subprocess.run(verify, cwd=directory, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode == 0

    check(holds(), "the signature holds")
    with open(os.path.join(directory, "report.sha256"), "a", encoding="utf-8") as file:
        file.write(" ")
    check(not holds(), "and holds no more once a byte has changed")


def main():
    if len(sys.argv) != 4:
        raise SystemExit(__doc__)
    goniod, gonio, page = (os.path.abspath(argument) for argument in sys.argv[1:])
    if not shutil.which("openssl"):
        print("skipped: openssl is not installed")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="gonio-job-") as directory:
        if run_script("office_scene.py", os.path.join(directory, "room.blend")) is None:
            return SKIPPED
        with ending(start(goniod, "--size", "320x240")) as (_, url):
            # Blender's Python takes its home from the first python3 on the path.
            environment = dict(os.environ, GONIO_SERVER=url, PATH=os.pathsep.join(["/usr/bin", "/bin", os.path.dirname(gonio), os.environ.get("PATH", "")]))
            run_steps(page, directory, environment)
            check_balance(gonio, url)
        check_report(directory)
        check_signature(directory)
    return 0


sys.exit(main())
