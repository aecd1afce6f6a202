"""A goniod of a test's own, and questions to it by gonio. Needs the standard library only."""

import contextlib
import json
import select
import subprocess
import time


def wait_ready(daemon, seconds=120.0):
    """Result: the URL of the READY line."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        ready, _, _ = select.select([daemon.stdout], [], [], 1.0)
        if not ready:
            continue
        line = daemon.stdout.readline()
        if not line:
            raise SystemExit("goniod ended before it was ready")
        if line.startswith("READY "):
            return line.split()[1]
    raise SystemExit("goniod was not ready in time")


def ask(gonio, url, *words):
    result = subprocess.run([gonio, "--server", url, "--json", *words], stdout=subprocess.PIPE, text=True, timeout=120,
                            check=False)
    if result.returncode != 0:
        raise SystemExit(f"gonio {' '.join(words)} ended with {result.returncode}: {result.stdout}")
    return json.loads(result.stdout)


def start(goniod, *arguments):
    """Result: the process, on a port of its own."""
    return subprocess.Popen([goniod, "--listen", "127.0.0.1:0", *arguments], stdout=subprocess.PIPE, text=True)


@contextlib.contextmanager
def ending(daemon):
    """Gives the process and its URL; ends it."""
    try:
        yield daemon, wait_ready(daemon)
    finally:
        daemon.terminate()
        try:
            daemon.wait(timeout=20)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()
