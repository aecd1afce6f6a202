#!/usr/bin/python3
"""Saves scenes with `gonio save scene`: opened again they read the same lux, and Blender finds geometry and punctual lights.

    saved.py GONIOD GONIO

exits 0 if all holds, 1 if not, 77 (skipped) where blender is not installed: the lux are compared all the same.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import urllib.request

from daemon import ask, ending, start
from headless import SKIPPED, run_script

TOLERANCE = 0.001
NEGLIGIBLE_LX = 0.001  # what a path more or less brings to a dark place
LUMENS_PER_WATT = 683.0


def vector(numbers):
    return ",".join(f"{number:.9g}" for number in numbers)


def at(bounds, x, y, z):
    """Result: a place by its shares of the scene's size."""
    return [low + share * (high - low) for low, high, share in zip(bounds["min_m"], bounds["max_m"], (x, y, z))]


def rig(gonio, url):
    """Lights that differ in all that a light can be."""
    state = ask(gonio, url, "get")
    bounds = state["bounds"]
    for light in state["lights"]:
        ask(gonio, url, "set", "light", light["name"], "--level", "0.35", "--color", "1,0.6,0.3")
    for name, profile, place, more in (
            ("wash", "wall_washer", (0.4, 0.6, 0.5), ("--pan", "40", "--tilt", "35", "--roll", "70", "--level", "0.6")),
            ("warm", "flood", (0.6, 0.7, 0.4), ("--pan", "-100", "--tilt", "60", "--roll", "10", "--cct", "2800", "--gel", "L201")),
            ("soft", "downlight", (0.5, 0.8, 0.6), ("--opening", "rect 0.3x0.1"))):
        ask(gonio, url, "add", "light", name, "--profile", profile, "--position=" + vector(at(bounds, *place)))
        ask(gonio, url, "set", "light", name, *more)
    ask(gonio, url, "set", "master", "0.8")
    ask(gonio, url, "set", "exposure", "6")  # else it moves by itself


def ten_lux(gonio, url, bounds):
    """Result: of ten places that face all ways the lux, direct and in all."""
    lux = []
    for i in range(10):
        place = at(bounds, 0.2 + 0.06 * i, 0.15 + 0.07 * (3 * i % 10), 0.2 + 0.06 * (7 * i % 10))
        words = ["--point=" + vector(place), "--normal=" + vector((math.sin(2.0 * i), 1.5 * math.cos(1.3 * i), math.cos(2.0 * i)))]
        reading = ask(gonio, url, "meter", *words, "--quality", "reference", "--noise", "0.3")
        lux += [reading["direct_lx"], reading["total_lx"]]
    return lux


def same_lux(goniod, gonio, scene, ending_of_file, directory):
    file = os.path.join(directory, f"{scene}.{ending_of_file}")
    with ending(start(goniod, "--scene", scene, "--size", "64x64")) as (_, url):
        rig(gonio, url)
        state = ask(gonio, url, "get")
        before = ten_lux(gonio, url, state["bounds"])
        said = ask(gonio, url, "save", "scene", file)
        assert said["scene_rev"] >= state["scene_rev"] and said["format"] == ending_of_file, said
        with urllib.request.urlopen(f"{url}/v1/scene.{ending_of_file}", timeout=60) as answer, open(file, "rb") as saved:
            assert answer.read() == saved.read(), "the same bytes over HTTP"
            assert answer.headers["X-Scene-Rev"] == str(said["scene_rev"]), answer.headers
        ask(gonio, url, "load", "scene", file)
        ask(gonio, url, "set", "master", "1")
        again = ask(gonio, url, "get")
        assert [light["name"] for light in again["lights"]] == [light["name"] for light in state["lights"]], again["lights"]
        after = ten_lux(gonio, url, state["bounds"])
    lit = 0
    for a, b in zip(before, after):
        assert abs(a - b) <= TOLERANCE * a + NEGLIGIBLE_LX, (scene, a, b)
        lit += a > 0.1
    assert lit >= 12, (scene, before)
    print(f"ok   {scene}.{ending_of_file}: {os.path.getsize(file)} bytes, the same lux at ten points")
    return file, state


def refused(gonio, directory):
    for words, code in ((["save", "scene"], 2), (["save", "scene", directory + "/a.png"], 2), (["save", "scene", directory + "/no/a.glb"], 3)):
        said = subprocess.run([gonio, "--server", "127.0.0.1:1", *words], timeout=60, check=False, capture_output=True, text=True)
        assert said.returncode == code and said.stderr, (words, said)


def blender_finds(glb, state):
    said = run_script("saved_scene.py", glb)
    if said is None:
        return False
    found = json.loads(next(line for line in said.splitlines() if line.startswith("SAVED "))[6:])
    with open(glb, "rb") as file:
        data = file.read()
    document = json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])
    shown = [node for node in document["nodes"] if "mesh" in node]
    assert len(found["meshes"]) == len(shown), (len(found["meshes"]), len(shown))
    accessors = [document["accessors"][primitive["indices"]] for node in shown for primitive in document["meshes"][node["mesh"]]["primitives"]]
    assert sum(mesh["triangles"] for mesh in found["meshes"]) == sum(accessor["count"] for accessor in accessors) // 3
    for k in range(3):
        assert abs(min(mesh["low"][k] for mesh in found["meshes"]) - state["bounds"]["min_m"][k]) < 1e-4, (k, state["bounds"])
        assert abs(max(mesh["high"][k] for mesh in found["meshes"]) - state["bounds"]["max_m"][k]) < 1e-4, (k, state["bounds"])
    return found


def blender_lights(glb, found, state):
    """Every measured light is there, where it stands, with the watts of its stand-in: 683 lm each, as the importer has it."""
    with open(glb, "rb") as file:
        data = file.read()
    document = json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])
    lights = document["extensions"]["KHR_lights_punctual"]["lights"]
    seen = {light["name"]: light for light in found["lights"]}
    assert set(seen) == {light["name"] for light in state["lights"]}, (set(seen), state["lights"])
    for node in document["nodes"]:
        if "KHR_lights_punctual" not in node.get("extensions", {}):
            continue
        stand_in, light = lights[node["extensions"]["KHR_lights_punctual"]["light"]], seen[node["name"]]
        watts = stand_in["intensity"] * 4 * math.pi / LUMENS_PER_WATT
        assert abs(light["watts"] - watts) <= 1e-4 * watts and watts > 0, (light, watts)
        assert math.dist(light["position"], node["translation"]) < 1e-5, (light, node)
        if stand_in["type"] == "spot":
            assert light["type"] == "SPOT" and abs(light["cone_rad"] - 2 * stand_in["spot"]["outerConeAngle"]) < 1e-5, (light, stand_in)


def check_punctual(goniod, gonio, directory):
    """A point, a spot and a sun come from a file, and go into one that Blender reads: in W, of 683 lm each."""
    lights = [{"type": "point", "intensity": 50.0, "color": [1, 0.5, 0.25], "name": "bulb"},
              {"type": "spot", "intensity": 400.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}, "name": "spot"},
              {"type": "directional", "intensity": 3000.0, "name": "sun"}]
    half = math.sqrt(0.5)
    nodes = [{"name": light["name"], "translation": [1.0 * i, 2.0, 3.0], "rotation": [-half, 0, 0, half],
              "extensions": {"KHR_lights_punctual": {"light": i}}} for i, light in enumerate(lights)]
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}], "nodes": nodes, "extensionsUsed": ["KHR_lights_punctual"],
                "extensions": {"KHR_lights_punctual": {"lights": lights}}}
    source, file = os.path.join(directory, "lights.gltf"), os.path.join(directory, "lights.glb")
    with open(source, "w", encoding="utf-8") as out:
        json.dump(document, out)
    with ending(start(goniod, "--scene", source, "--size", "64x64", "--renderer", "null")) as (_, url):
        ask(gonio, url, "set", "light", "spot", "--level", "0.5", "--pan", "90", "--tilt", "90")
        ask(gonio, url, "save", "scene", file)
        state = ask(gonio, url, "get")
    said = run_script("saved_scene.py", file)
    if said is None:
        return
    found = {light["name"]: light for light in json.loads(next(line for line in said.splitlines() if line.startswith("SAVED "))[6:])["lights"]}
    assert set(found) == {"bulb", "spot", "sun"}, found
    for name, kind, watts in (("bulb", "POINT", 50.0 * 4 * math.pi / LUMENS_PER_WATT), ("spot", "SPOT", 200.0 * 4 * math.pi / LUMENS_PER_WATT),
                              ("sun", "SUN", 3000.0 / LUMENS_PER_WATT)):
        light, stated = found[name], next(one for one in state["lights"] if one["name"] == name)
        assert light["type"] == kind and abs(light["watts"] / watts - 1.0) < 1e-4, (light, watts)
        assert math.dist(light["position"], stated["position"]) < 1e-5 and math.dist(light["aim"], stated["aim"]) < 1e-5, (light, stated)
    assert math.dist(found["bulb"]["color"], (1, 0.5, 0.25)) < 1e-6, found["bulb"]
    assert abs(found["spot"]["cone_rad"] - 1.2) < 1e-5, found["spot"]
    print("ok   Blender has point, spot and sun")


def main():
    goniod, gonio = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="gonio-saved-") as directory:
        refused(gonio, directory)
        saved = [same_lux(goniod, gonio, scene, "glb", directory) for scene in ("cornell", "atrium")]
        same_lux(goniod, gonio, "cornell", "mvr", directory)
        for glb, state in saved:
            found = blender_finds(glb, state)
            if not found:
                return SKIPPED
            blender_lights(glb, found, state)
            print(f"ok   Blender has the geometry and the lights of {os.path.basename(glb)}")
        check_punctual(goniod, gonio, directory)
    return 0


sys.exit(main())
