#!/usr/bin/python3
"""Compares pictures of the built-in scene cornell with those of Blender's Cycles, direct light and one bounce apart.

    cycles.py GONIO_BENCH [--markdown FILE]

exits 0 if the reference agrees within 2 % of Cycles' mean in every channel, 1 if not, 77 (skipped) where blender or its
glTF importer is not installed. gonio-bench writes the scenes and compares; cycles_scene.py renders them in Blender.
"""

import subprocess
import sys
import tempfile

from headless import SKIPPED, run_script

SIZE_PX = 128  # gonio-bench's
SAMPLES, SAMPLES_OF_THE_PAGE = 64, 256


def main():
    arguments = sys.argv[1:]
    if len(arguments) not in (1, 3) or (len(arguments) == 3 and arguments[1] != "--markdown"):
        raise SystemExit(__doc__)
    bench, markdown = arguments[0], arguments[1:]
    samples = SAMPLES_OF_THE_PAGE if markdown else SAMPLES
    with tempfile.TemporaryDirectory(prefix="gonio-cycles-") as directory:
        names = subprocess.run([bench, "crosscheck", "--prepare", directory], stdout=subprocess.PIPE, text=True,
                               timeout=60, check=True).stdout.split()
        printed = run_script("cycles_scene.py", directory, str(SIZE_PX), str(samples), *names)
        if printed is None:
            return SKIPPED
        print(next(line for line in printed.splitlines() if line.startswith("calibration")), flush=True)
        return subprocess.run([bench, "crosscheck", directory, *markdown], timeout=240, check=False).returncode


sys.exit(main())
