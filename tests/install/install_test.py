#!/usr/bin/python3
"""Installs a build into an empty folder, and starts what is there.

    install_test.py CMAKE BUILD_FOLDER

exits 0 if all files are at their places, and the installed goniod serves its page and a picture.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import urllib.request

CMAKE, BUILD = sys.argv[1:3]
FILES = ("bin/goniod", "bin/gonio", "bin/gonio-bench", "lib/systemd/system/goniod.service", "lib/udev/rules.d/70-gonio.rules",
         "lib/sysusers.d/gonio.conf", "share/doc/gonio/LICENSE", "share/doc/gonio/operations.md")


class Install(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        subprocess.run([CMAKE, "--install", BUILD, "--prefix", "/opt/gonio"], check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "DESTDIR": self.folder.name})
        self.prefix = pathlib.Path(self.folder.name) / "opt/gonio"

    def test_files_are_at_their_places(self):
        for name in FILES:
            self.assertTrue((self.prefix / name).is_file(), name)
        unit = (self.prefix / "lib/systemd/system/goniod.service").read_text()
        self.assertIn("\nExecStart=/opt/gonio/bin/goniod ", unit)

    def test_the_installed_goniod_serves_its_page_and_a_picture(self):
        goniod = self.prefix / "bin/goniod"
        version = subprocess.run([goniod, "--version"], check=True, capture_output=True, text=True).stdout
        self.assertRegex(version, r"^goniod \d+\.\d+\.\d+\n$")
        with subprocess.Popen([goniod, "--listen", "127.0.0.1:0", "--size", "64x64"], cwd=self.folder.name, text=True,
                              stdout=subprocess.PIPE) as process:
            try:
                url = process.stdout.readline().removeprefix("READY ").strip()
                with urllib.request.urlopen(url) as page:
                    self.assertIn(b"<html", page.read())
                with urllib.request.urlopen(url + "/v1/frame.png", timeout=60) as still:
                    self.assertEqual(still.read(8), b"\x89PNG\r\n\x1a\n")
            finally:
                process.terminate()
        self.assertEqual(process.returncode, 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
