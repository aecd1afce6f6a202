#!/usr/bin/python3
"""Bakes a scene with `gonio bake` and has Blender show it: two sets of texture coordinates, emission from the second.

    bake.py GONIO

exits 0 if all holds, 1 if not, 77 (skipped) where blender is not installed.
"""

import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from headless import SKIPPED, run_script


def stopped(gonio, directory):
    """An interrupt ends a bake soon; what is finished stays and is taken over."""
    words = [gonio, "bake", "cylinder", directory + "/stopped", "--size", "128", "--bounces", "1"]
    with subprocess.Popen([*words, "--directions", "65536"], stderr=subprocess.PIPE, text=True) as running:
        while "bounce 1" not in running.stderr.readline():
            assert running.poll() is None
        began = time.monotonic()
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=30)
        assert running.returncode == 1 and "stopped" in said and time.monotonic() - began < 10, said
    parts = sorted(path.name for path in pathlib.Path(directory, "stopped/parts").iterdir())
    assert len(parts) == 6 and not pathlib.Path(directory, "stopped/maps.json").exists(), parts


def main():
    gonio, = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix="gonio-bake-") as directory:
        made = subprocess.run([gonio, "bake", "cylinder", directory, "--size", "128", "--directions", "32", "--bounces", "1"],
                              timeout=60, check=False, capture_output=True, text=True)
        if made.returncode != 0:
            raise SystemExit(f"gonio bake: {made.returncode}\n{made.stderr}")
        maps = json.loads((pathlib.Path(directory) / "maps.json").read_text())
        assert len(maps["maps"]) == 6 and abs(maps["maps"][0]["direct"]["mean_lx"] - 86.328 * 10.8 / 66.3) < 0.1, maps
        # What is wrong is refused: words with 2, the rest with 1.
        for words, code in ((["bake", "cylinder"], 2), (["bake", "cylinder", directory, "--size", "7"], 2),
                            (["bake", "cylinder", directory, "--memory", "16"], 1),
                            (["bake", "cylinder", directory, "light nobody --level 1"], 1)):
            refused = subprocess.run([gonio, *words], timeout=60, check=False, capture_output=True, text=True)
            assert refused.returncode == code and refused.stderr, (words, refused)
        stopped(gonio, directory)
        said = run_script("bake_scene.py", str(pathlib.Path(directory) / maps["glb"]))
        if said is None:
            return SKIPPED
    meshes = json.loads(next(line for line in said.splitlines() if line.startswith("BAKE "))[5:])
    assert len(meshes) == 3, meshes
    for mesh in meshes:
        assert len(mesh["layers"]) == 2 and 0.0 <= mesh["low"] < mesh["high"] <= 1.0, mesh
        assert mesh["emits"] and mesh["emits"][0]["size"] == [128, 128], mesh
        assert mesh["emits"][0]["uv"] == [mesh["layers"][1]] and mesh["emits"][0]["greatest"] > 0.5, mesh
    return 0


sys.exit(main())
