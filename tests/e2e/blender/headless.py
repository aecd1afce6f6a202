"""Runs a script inside Blender without a display, for the tests beside this file. Needs the standard library only."""

import os
import shutil
import subprocess

SKIPPED = 77
HERE = os.path.dirname(os.path.abspath(__file__))


def run_script(script, *arguments, timeout_s=240):
    """script: beside this file. Result: what it printed, or None, and a line that says so, where Blender or what its glTF add-on
    needs is not installed. Ends the program where the script fails."""
    blender = shutil.which("blender")
    if not blender:
        print("skipped: blender is not installed")
        return None
    command = [blender, "-b", "--factory-startup", "--python-exit-code", "1", "--python", os.path.join(HERE, script), "--", *arguments]
    # Blender's Python takes its home from the first python3 on the path, which must be the system's, with its numpy.
    environment = dict(os.environ, PATH="/usr/bin:/bin:" + os.environ.get("PATH", ""))
    result = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=timeout_s,
                            check=False)
    if "No module named 'numpy'" in result.stdout:
        print("skipped: blender's glTF add-on needs python3-numpy")
        return None
    if result.returncode != 0:
        print(result.stdout)
        raise SystemExit(1)
    return result.stdout
