#!/usr/bin/python3
"""Compares light in a room that Blender's own exporter wrote with what Blender's Cycles measures in it, at points.

    room.py GONIO_BENCH [--markdown FILE]

exits 0 if every group of points agrees (tests/accuracy/exported.h), 1 if not, 77 (skipped) where blender or its glTF exporter is
not installed. room_scene.py builds, exports and measures in Blender; gonio-bench reads the file and compares.
"""

import subprocess
import sys
import tempfile

from headless import SKIPPED, run_script


def main():
    arguments = sys.argv[1:]
    if len(arguments) not in (1, 3) or (len(arguments) == 3 and arguments[1] != "--markdown"):
        raise SystemExit(__doc__)
    bench, markdown = arguments[0], arguments[1:]
    with tempfile.TemporaryDirectory(prefix="gonio-room-") as directory:
        if run_script("room_scene.py", directory) is None:
            return SKIPPED
        return subprocess.run([bench, "exported", directory, *markdown], timeout=240, check=False).returncode


sys.exit(main())
