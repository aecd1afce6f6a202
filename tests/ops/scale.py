#!/usr/bin/python3
"""What one machine holds: the tables of docs/scale.md.

    scale.py GONIOD GONIO [--quick]

Lights under the ceiling of the scene cornell; triangles of a hilly floor of 20 × 20 m. Times are medians of goniod's own frame
reports at 800 × 800, memory is resident. --quick: the smallest rows alone.
"""
import json
import math
import pathlib
import statistics
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from goniod import Goniod  # noqa: E402

GONIOD, GONIO = (str(pathlib.Path(program).resolve()) for program in sys.argv[1:3])
QUICK = '--quick' in sys.argv[3:]
LIGHTS = [1, 16] if QUICK else [1, 64, 256, 1024]
SIDES = [64] if QUICK else [500, 1000, 1400, 2000]  # of the floor, in squares
CHANGES = 3 if QUICK else 15


def gonio(server, *words):
    done = subprocess.run([GONIO, '--server', server.url, *words], capture_output=True, text=True)
    assert done.returncode == 0, f'{words}: {done.stderr}'
    return done.stdout


def watch(server):
    return subprocess.Popen([GONIO, '--server', server.url, 'watch'], stdout=subprocess.DEVNULL)


def resident_mib(server):
    for line in pathlib.Path(f'/proc/{server.process.pid}/status').read_text().splitlines():
        if line.startswith('VmRSS:'):
            return int(line.split()[1]) / 1024
    raise AssertionError('no VmRSS')


def settle(server):
    """Waits until nothing better comes of the picture, which it does where somebody looks."""
    while not json.loads(gonio(server, 'report'))['settled']:
        time.sleep(0.1)


def frame_ms(server, change):
    """The median over frames that each show one change; change(i) gives the words of gonio."""
    times = []
    settle(server)
    for i in range(CHANGES):
        revision = gonio(server, *change(i)).split()[-1]
        times.append(json.loads(gonio(server, 'report', '--rev', revision))['frame_ms'])
    return statistics.median(times)


def floor_glb(side):
    """A floor of 2 × side² triangles with hills, as one .glb."""
    places, normals, indices = bytearray(), bytearray(), bytearray()
    for row in range(side + 1):
        for column in range(side + 1):
            x, z = 20 * column / side - 10, 20 * row / side - 10
            places += struct.pack('<3f', x, 0.3 * math.sin(x) * math.sin(z), z)
            slope = 0.3 * math.cos(x) * math.sin(z), 0.3 * math.sin(x) * math.cos(z)
            length = math.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
            normals += struct.pack('<3f', -slope[0] / length, 1 / length, -slope[1] / length)
    for row in range(side):
        for column in range(side):
            a = row * (side + 1) + column
            b, c, d = a + 1, a + side + 1, a + side + 2
            indices += struct.pack('<6I', a, c, b, b, c, d)
    count = (side + 1) ** 2
    data = bytes(places + normals + indices)
    text = json.dumps({
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'name': 'floor', 'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0, 'NORMAL': 1}, 'indices': 2}]}],
        'buffers': [{'byteLength': len(data)}],
        'bufferViews': [{'buffer': 0, 'byteOffset': at, 'byteLength': size} for at, size in (
            (0, len(places)), (len(places), len(normals)), (len(places) + len(normals), len(indices)))],
        'accessors': [
            {'bufferView': 0, 'componentType': 5126, 'count': count, 'type': 'VEC3', 'min': [-10, -0.3, -10],
             'max': [10, 0.3, 10]},
            {'bufferView': 1, 'componentType': 5126, 'count': count, 'type': 'VEC3'},
            {'bufferView': 2, 'componentType': 5125, 'count': 6 * side * side, 'type': 'SCALAR'}]}).encode()
    text += b' ' * (-len(text) % 4)
    chunks = struct.pack('<II', len(text), 0x4E4F534A) + text + struct.pack('<II', len(data), 0x004E4942) + data
    return struct.pack('<4sII', b'glTF', 2, 12 + len(chunks)) + chunks


def lights():
    print('| lights | a level | all levels | one moves | camera moves | memory |\n|---|---|---|---|---|---|')
    for count in LIGHTS:
        server = Goniod(GONIOD, '--scene', 'cornell', '--surfaces', 'off')
        viewer = None  # until all are there: else each that comes is rendered
        try:
            gonio(server, 'set', 'exposure', '6')
            names = [f'l{i}' for i in range(1, count)]
            side = math.ceil(math.sqrt(count))
            for i, name in enumerate(names):
                x, z = (i % side + 0.5) / side, (i // side + 0.5) / side
                gonio(server, 'add', 'light', name, '--like', 'luminaire', '--position',
                      f'{0.3 * x - 0.15:.4f},2.4,{0.3 * z - 0.15:.4f}')
            gonio(server, 'group', 'all', 'luminaire', *names)
            viewer = watch(server)
            level = frame_ms(server, lambda i: ('set', 'light', 'luminaire', '--level', f'{0.4 + 0.02 * i}'))
            levels = frame_ms(server, lambda i: ('set', 'light', 'all', '--level', f'{0.4 + 0.02 * i}'))
            moves = frame_ms(server, lambda i: ('set', 'light', 'luminaire', '--position', f'{0.01 * i},2.3,0'))
            camera = frame_ms(server, lambda i: ('set', 'camera', '--fov', f'{40 + i}'))
            memory = resident_mib(server)
            print(f'| {count:,} | {level:.1f} ms | {levels:.1f} ms | {moves:.1f} ms | {camera:.0f} ms | {memory:.0f} MiB |',
                  flush=True)
        finally:
            if viewer:
                viewer.kill()
                viewer.wait()
            server.stop()


def triangles():
    print('| triangles | file | until READY | light moves | camera moves | memory |\n|---|---|---|---|---|---|')
    for side in SIDES:
        with tempfile.NamedTemporaryFile(suffix='.glb') as file:
            file.write(floor_glb(side))
            file.flush()
            size = pathlib.Path(file.name).stat().st_size
            began = time.monotonic()
            server = Goniod(GONIOD, '--scene', file.name, '--surfaces', 'off')
            ready = time.monotonic() - began
            viewer = watch(server)
            try:
                gonio(server, 'set', 'exposure', '6')
                gonio(server, 'add', 'light', 'lamp', '--profile', 'flood', '--position', '0,5,0')
                moves = frame_ms(server, lambda i: ('set', 'light', 'lamp', '--position', f'{0.1 * i},5,0'))
                camera = frame_ms(server, lambda i: ('set', 'camera', '--fov', f'{40 + i}'))
                print(f'| {2 * side * side:,} | {size / 2**20:.0f} MiB | {ready:.1f} s | {moves:.0f} ms | {camera:.0f} ms '
                      f'| {resident_mib(server):.0f} MiB |', flush=True)
            finally:
                viewer.kill()
                viewer.wait()
                server.stop()


lights()
print()
triangles()
