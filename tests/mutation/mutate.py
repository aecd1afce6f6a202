#!/usr/bin/env python3
"""Changes the source by one small mistake at a time and says which of them no test notices.

A mistake is a negated condition, another operator, a shifted constant, a removed statement or two swapped arguments.
After each one the test program is built whose tests include the file's header most often, and its suites that concern
the file are run until one fails: those that include the header, then those that include any header of its folder.
A survivor is a line that no test guards, or a change that changes nothing, which only a reader can tell.
"""
import argparse
import pathlib
import random
import re
import signal
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "release"
KEPT = ROOT / "build" / "mutate"  # the file as it was, while it is changed
BUILD_LIMIT_S, TEST_LIMIT_S = 1200, 600
FOLDERS = ("ies", "protocol", "server", "client")

OPERATORS = {
    " < ": " <= ", " <= ": " < ", " > ": " >= ", " >= ": " > ", " == ": " != ", " != ": " == ", " && ": " || ",
    " || ": " && ", " + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " += ": " -= ", " -= ": " += ",
}
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[-+]?\d+)?|\d+)(f|u)?(?![\w.'])")
SKIPPED = re.compile(r"\s*(#|//|\*|using |namespace |static_assert|template|public:|private:|EXPECT|TEST)")
ASSIGNMENT_OR_CALL = re.compile(r"\s*[\w.:\->\[\]*()]+(\([^;]*\)|\s[-+*/|&]?=\s[^;]*|\+\+|--);$|\s*(break|continue);$")
SWAPPABLE = re.compile(r"\b\w+\(([\w.\->]+), ([\w.\->]+)\)")
SUITE = re.compile(r"^(?:TEST|TEST_F|TEST_P)\(\s*(\w+)\s*,", re.MULTILINE)


def code_of(line):
    """The line with its strings and comments blanked, of the same length."""
    code = re.sub(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'', lambda m: "_" * len(m.group()), line)
    at = code.find("//")
    return code if at < 0 else code[:at] + " " * (len(code) - at)


def closing(code, start):
    """Where the parenthesis at `start` closes on this line; -1: it does not."""
    depth = 0
    for i in range(start, len(code)):
        depth += {"(": 1, ")": -1}.get(code[i], 0)
        if depth == 0:
            return i
    return -1


def mistakes(line):
    """All (kind, changed line) of one line."""
    if SKIPPED.match(line):
        return
    code = code_of(line)
    for match in re.finditer(r"\b(if|while) \(", code):
        start = match.end() - 1
        end = closing(code, start)
        if end > 0:
            yield "negated", line[: start + 1] + "!(" + line[start + 1 : end] + ")" + line[end:]
    for old, new in OPERATORS.items():
        for match in re.finditer(re.escape(old), code):
            yield "operator", line[: match.start()] + new + line[match.end() :]
    for match in NUMBER.finditer(code):
        digits = match.group(1)
        if "." in digits or "e" in digits:
            new = "1.0" if float(digits) == 0.0 else repr(2.0 * float(digits))
        else:
            new = str(int(digits) + 1)
        yield "constant", line[: match.start(1)] + new + line[match.end(1) :]
    stripped = code.rstrip()
    if ASSIGNMENT_OR_CALL.match(stripped) and stripped.count("(") == stripped.count(")"):
        yield "removed", line[: len(line) - len(line.lstrip())] + ";"
    for match in SWAPPABLE.finditer(code):
        if match.group(1) != match.group(2):
            swapped = line[match.start(2) : match.end(2)] + ", " + line[match.start(1) : match.end(1)]
            yield "swapped", line[: match.start(1)] + swapped + line[match.end(2) :]


def changed_lines():
    """{file: line numbers} of what differs from the last commit, or, where nothing does, of the last commit."""
    for base in (["HEAD"], ["HEAD~1", "HEAD"]):
        out = subprocess.run(["git", "diff", "-U0", *base, "--", *FOLDERS], cwd=ROOT, capture_output=True, text=True,
                             check=True).stdout
        found, path = {}, None
        for line in out.splitlines():
            if line.startswith("+++ b/"):
                path = line[6:]
            match = re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line)
            if match and path and path.endswith((".cpp", ".h")):
                first, count = int(match.group(1)), int(match.group(2) or 1)
                found.setdefault(path, set()).update(range(first, first + count))
        if found:
            return found
    return {}


def named_lines(names):
    found = {}
    for name in names:
        path = (ROOT / name).resolve()
        files = sorted(p for p in path.rglob("*") if p.suffix in (".cpp", ".h")) if path.is_dir() else [path]
        for file in files:
            if not file.is_file():
                sys.exit(f"mutate: there is no file {name}")
            found[str(file.relative_to(ROOT))] = None
    return found


def candidates(lines):
    for path, numbers in lines.items():
        for number, line in enumerate((ROOT / path).read_text().splitlines(), 1):
            if numbers is None or number in numbers:
                for kind, new in mistakes(line):
                    yield path, number, kind, line, new


def sources_of(program):
    """The files that a program is compiled from, also those that are compiled several as one."""
    out = subprocess.run(["ninja", "-C", str(BUILD), "-t", "inputs", f"bin/{program}"], capture_output=True,
                         text=True).stdout
    inputs = {(BUILD / line.strip()).resolve() for line in out.splitlines() if line.endswith((".cpp", "_cxx.cxx"))}
    shared = {path for path in inputs if path.suffix == ".cxx"}
    return inputs - shared | {pathlib.Path(name) for path in shared
                              for name in re.findall(r'#include "(.+\.cpp)"', path.read_text())}


def tests_by_program():
    """{test program: the texts of its test sources}, of those that link everything they test."""
    programs = {}
    units = sorted(path.name for path in (BUILD / "bin").glob("unit_*"))
    for program in (*units, "conformance_tests", "gl_tests", "bench_tests", "e2e_tests"):
        programs[program] = [source.read_text() for source in sources_of(program) if ROOT / "tests" in source.parents]
    return programs


def stages(path, programs):
    """[(program, suites)] to run in turn for a mistake in `path`."""
    header, folder = str(pathlib.Path(path).with_suffix(".h")), str(pathlib.Path(path).parent)
    result, done = [], set()
    for wanted in (re.escape(f'"{header}"'), re.escape(f'"{folder}/') + r'\w+\.h"'):
        found = {}  # {kind: {program: texts}}: unit tests are several programs, of one kind
        for program, texts in programs.items():
            own = [text for text in texts if re.search("#include " + wanted, text)]
            if own:
                found.setdefault("unit" if program.startswith("unit_") else program, {})[program] = own
        best = max(found.values(), key=lambda kind: sum(map(len, kind.values())), default={})
        for program, texts in best.items():
            fresh = {(program, suite) for text in texts for suite in SUITE.findall(text)} - done
            if fresh:
                result.append((program, sorted(suite for _, suite in fresh)))
                done |= fresh
    return result or [(program, ["*"]) for program in programs if program.startswith("unit_")]


def verdict(runs):
    """'caught', 'SURVIVED', or '' where it does not compile. runs: of stages()."""
    for program, suites in runs:
        try:
            built = subprocess.run(["ninja", "-C", str(BUILD), program], capture_output=True, timeout=BUILD_LIMIT_S)
        except subprocess.TimeoutExpired:
            return ""
        if built.returncode != 0:
            return ""
        wanted = ":".join(f"{suite}.*:*/{suite}.*" for suite in suites)
        try:
            ran = subprocess.run([str(BUILD / "bin" / program), f"--gtest_filter={wanted}", "--gtest_fail_fast"],
                                 cwd=BUILD, capture_output=True, timeout=TEST_LIMIT_S)
        except subprocess.TimeoutExpired:
            return "caught"  # it hangs
        if ran.returncode != 0:
            return "caught"
    return "SURVIVED"


def restore():
    for kept in KEPT.rglob("*") if KEPT.is_dir() else ():
        if kept.is_file():
            (ROOT / kept.relative_to(KEPT)).write_bytes(kept.read_bytes())
            kept.unlink()


def main():
    parser = argparse.ArgumentParser(prog="./dev mutate", description=__doc__.split("\n")[0])
    parser.add_argument("files", nargs="*",
                        help="files or folders; none: the lines changed since the last commit, or by it")
    parser.add_argument("--count", type=int, default=20, help="mistakes that compile, default 20")
    parser.add_argument("--seed", type=int, default=1, help="which mistakes are drawn, default 1")
    options = parser.parse_args()
    restore()  # what a run that was killed has left
    drawn = sorted(candidates(named_lines(options.files) if options.files else changed_lines()))
    if not drawn:
        sys.exit("mutate: there is no line to change")
    random.Random(options.seed).shuffle(drawn)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    programs, built, tried, survivors = tests_by_program(), set(), 0, 0
    for path, number, kind, old, new in drawn:
        if tried == options.count:
            break
        file, kept, runs = ROOT / path, KEPT / path, stages(path, programs)
        built.update(program for program, _ in runs)
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(file.read_bytes())
        try:
            lines = file.read_text().splitlines(keepends=True)
            lines[number - 1] = new + "\n"
            file.write_text("".join(lines))
            found = verdict(runs)
        finally:
            restore()
        if not found:
            continue
        tried += 1
        survivors += found == "SURVIVED"
        print(f"{found:8} {path}:{number}: {kind}\n    - {old.strip()}\n    + {new.strip()}", flush=True)
    subprocess.run(["ninja", "-C", str(BUILD), *sorted(built)], capture_output=True)  # as the source is again
    print(f"{tried} mistakes, {survivors} of them unnoticed")


if __name__ == "__main__":
    main()
