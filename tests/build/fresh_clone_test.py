"""A folder that has never been built in: CMake configures it, and ./dev run starts goniod in it."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]

# All packages are installed, whatever is asked for.
DPKG_QUERY = """#!/bin/sh
sed -n 's/=.*//; /^[a-z]/s/^/ii  /p' packages.txt
"""

# Configures, and builds a goniod that prints its arguments. The second step waits until the test has read of the first.
CMAKE = """#!/bin/sh
mkdir -p build/release/bin
case "$1" in
    --preset) echo configured; : > build/release/build.ninja ;;
    --build)
        echo "@ 1 2 40.5 @"
        read -r _ < first_was_shown
        echo "warning: a line of a compiler"
        echo "@ 2 2 81.0 @"
        printf '#!/bin/sh\\necho "started $*"\\n' > build/release/bin/goniod
        chmod +x build/release/bin/goniod ;;
esac
"""


class FreshClone(unittest.TestCase):
    def test_cmake_configures_where_nothing_is_generated_yet(self):
        with tempfile.TemporaryDirectory() as folder:
            run = subprocess.run(["cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release"],
                                 capture_output=True, text=True, check=False)
            self.assertEqual(run.returncode, 0, run.stderr)

    # With stand-ins for the package manager and CMake.
    def test_run_configures_tells_how_far_it_is_and_starts(self):
        with tempfile.TemporaryDirectory() as folder:
            clone = pathlib.Path(folder, "clone")
            programs = pathlib.Path(folder, "programs")
            clone.mkdir()
            programs.mkdir()
            for name in ("dev", "packages.txt"):
                shutil.copy(ROOT / name, clone)
            for name, text in (("dpkg-query", DPKG_QUERY), ("cmake", CMAKE)):
                (programs / name).write_text(text)
                (programs / name).chmod(0o755)
            fifo = clone / "first_was_shown"
            os.mkfifo(fifo)
            environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}
            with subprocess.Popen(["./dev", "run", "--scene", "atrium"], cwd=clone, env=environment, text=True,
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as dev:
                told = [dev.stderr.readline(), dev.stderr.readline()]
                self.assertEqual(told, ["configuring build/release\n",
                                        "building: 1 of 2 steps, about 0 min 40 s left\n"])
                fifo.write_text("\n")
                out, rest = dev.communicate()
            self.assertEqual(rest, "warning: a line of a compiler\nbuilding: 2 of 2 steps\n")
            self.assertEqual((dev.returncode, out), (0, "started --scene atrium\n"))


if __name__ == "__main__":
    unittest.main()
