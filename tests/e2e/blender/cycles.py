#!/usr/bin/python3
"""Compares pictures of the built-in scene cornell with those of Blender's Cycles, direct light and one bounce apart.

    cycles.py GONIO_BENCH [--markdown FILE]

exits 0 if the reference agrees within 2 % of Cycles' mean in every channel, 1 if not, 77 (skipped) where blender or its
glTF importer is not installed. gonio-bench writes the scenes and compares; cycles_scene.py renders them in Blender.
"""

import os
import shutil
import subprocess
import sys
import tempfile

SIZE_PX, SAMPLES = 128, 256  # the size is gonio-bench's
SKIPPED = 77
HERE = os.path.dirname(os.path.abspath(__file__))


def main():
    arguments = sys.argv[1:]
    if len(arguments) not in (1, 3) or (len(arguments) == 3 and arguments[1] != "--markdown"):
        raise SystemExit(__doc__)
    bench, markdown = arguments[0], arguments[1:]
    blender = shutil.which("blender")
    if not blender:
        print("skipped: blender is not installed")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="gonio-cycles-") as directory:
        names = subprocess.run([bench, "crosscheck", "--prepare", directory], stdout=subprocess.PIPE, text=True,
                               timeout=60, check=True).stdout.split()
        command = [blender, "-b", "--factory-startup", "--python-exit-code", "1", "--python",
                   os.path.join(HERE, "cycles_scene.py"), "--", directory, str(SIZE_PX), str(SAMPLES), *names]
        # Blender's Python takes its home from the first python3 on the path, which must be the system's, with its numpy.
        environment = dict(os.environ, PATH="/usr/bin:/bin:" + os.environ.get("PATH", ""))
        result = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=240,
                                check=False)
        if "No module named 'numpy'" in result.stdout:
            print("skipped: blender's glTF importer needs python3-numpy")
            return SKIPPED
        if result.returncode != 0:
            print(result.stdout)
            return 1
        print(next(line for line in result.stdout.splitlines() if line.startswith("calibration")), flush=True)
        return subprocess.run([bench, "crosscheck", directory, *markdown], timeout=240, check=False).returncode


sys.exit(main())
