#!/usr/bin/python3
"""Compares Gonio's direct light with Cycles' on a scene that Blender's own exporter wrote.

    run.py GONIOD GONIO

exits 0 if every point agrees within 2 %, 1 if not, 77 (skipped) where blender or its glTF exporter is not installed.
The scene is built by export_scene.py in a temporary directory.
"""

import json
import os
import sys
import tempfile

from daemon import ask, ending, start
from headless import SKIPPED, run_script

TOLERANCE = 0.02  # of Cycles' figure
DARK_LX = 0.05    # what a point in shadow may read


def export(directory):
    """Result: expected.json as a value, or None where Blender cannot export glTF here."""
    if run_script("export_scene.py", directory) is None:
        return None
    with open(os.path.join(directory, "expected.json"), encoding="utf-8") as file:
        return json.load(file)


def vector(numbers):
    return ",".join(f"{number:.9g}" for number in numbers)


def compare(goniod, gonio, scene_file, expected):
    """Result: how many points disagree."""
    wrong = 0
    with ending(start(goniod, "--scene", scene_file, "--size", "320x240")) as (_, url):
        state = ask(gonio, url, "get")
        if len(state["lights"]) != 1:
            print("one light was exported, the scene has", len(state["lights"]))
            wrong += 1
        for point in expected["points"]:
            # "--point=" keeps a leading minus from being taken for an option.
            answer = ask(gonio, url, "meter", "--point=" + vector(point["point_m"]), "--normal=" + vector(point["normal"]))
            measured, truth = answer["direct_lx"], point["direct_lx"]
            good = abs(measured - truth) <= max(TOLERANCE * truth, DARK_LX)
            wrong += not good
            print(f"{'ok  ' if good else 'BAD '} {point['name']:28} gonio {measured:9.4f} lx   cycles {truth:9.4f} lx")
    return wrong


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    goniod, gonio = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="gonio-blender-") as directory:
        expected = export(directory)
        if expected is None:
            return SKIPPED
        wrong = 0
        for name in ("scene.glb", "scene.gltf"):
            print(name)
            wrong += compare(goniod, gonio, os.path.join(directory, name), expected)
    return 1 if wrong else 0


sys.exit(main())
