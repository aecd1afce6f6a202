"""What a build costs keeps to its bounds: how many files see a generated protobuf header, and how many lines goniod's read.

    budget_test.py BUILD_FOLDER

Both come from what ninja noted of the last build (`ninja -t deps`): the files that each object was made of. Lines are those of
these files, before the preprocessor drops any. A bound is what was measured when it was set, and 5 % more. Who meets it looks for
an include that a header does not need: `protocol/schema/messages.h` names messages without their definitions.
"""
import functools
import pathlib
import subprocess
import sys
import unittest

BUILD = pathlib.Path(sys.argv.pop())
MOST_MORE = 1.05
SEE_PROTOBUF = 172      # translation units
GONIOD_LINES = 30.2e6   # of all of its translation units


@functools.cache
def files_of_objects():
    """{object: the files that it was made of}, of the last build."""
    found, current = {}, None
    out = subprocess.run(['ninja', '-C', BUILD, '-t', 'deps'], capture_output=True, text=True, check=True).stdout
    for line in out.splitlines():
        if line.startswith('    '):
            current.append(line.strip())
        elif line.endswith('(VALID)'):
            current = found[line.split(':')[0]] = []
    return found


@functools.cache
def lines_of(path):
    return (BUILD / path).read_bytes().count(b'\n')


@unittest.skipIf('GONIO_UNITY:BOOL=OFF' in (BUILD / 'CMakeCache.txt').read_text(), 'each file is compiled by itself')
class Budget(unittest.TestCase):
    def test_few_files_see_a_generated_protobuf_header(self):
        objects = files_of_objects()
        self.assertGreater(len(objects), 100)
        see = [name for name, files in objects.items() if any(file.endswith('.pb.h') for file in files)]
        print(f'{len(see)} of {len(objects)} translation units see a generated protobuf header')
        self.assertGreater(len(see), 0)
        self.assertLess(len(see), MOST_MORE * SEE_PROTOBUF)

    def test_goniod_reads_few_lines(self):
        inputs = subprocess.run(['ninja', '-C', BUILD, '-t', 'inputs', 'bin/goniod'], capture_output=True, text=True,
                                check=True).stdout.split()
        objects = files_of_objects()
        own = [name for name in inputs if name in objects]
        self.assertGreater(len(own), 50)
        lines = sum(lines_of(file) for name in own for file in objects[name])
        print(f'goniod: {len(own)} translation units read {lines / 1e6:.2f} million lines')
        self.assertLess(lines, MOST_MORE * GONIOD_LINES)


if __name__ == '__main__':
    unittest.main()
