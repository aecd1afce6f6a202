"""goniod --oneshot of sequences: killed at any moment and gone on with, in shards, and as docs/sequences.md has it.

usage: sequences_test.py GONIOD [--long]
"""
import hashlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).parents[3]
DOCS = ROOT / 'docs/sequences.md'
GONIOD = 'goniod'
LONG = False

# A luminaire's level, aim and the camera move. Path-traced: it needs no GL and starts at once.
SHORT = {
    'fps': 24, 'frames': 24, 'out': 'a/frame.####.png', 'first_number': 1,
    'capture': {'quality': 'reference', 'noise': 0.4, 'size': '96x54'},
    'set': [['exposure', '4']],
    'camera': {'keys': [{'t': 0, 'eye': [0, 2.5, 7], 'target': [0, 2, 0]}, {'t': 1, 'eye': [1, 2, 6], 'fov': 50}]},
    'tracks': [{'set': ['light', 'luminaire', '--level'], 'keys': [{'t': 0, 'value': 0.1}, {'t': 1, 'value': 1, 'ease': 'in'}]}],
    'video': {'file': 'a.mp4'},
}


def contents(folder):
    """All files below, hidden ones too, by name."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in pathlib.Path(folder).rglob('*') if path.is_file()}


class Sequences(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix='gonio_sequences_'))
        self.addCleanup(shutil.rmtree, self.folder)

    def job(self, sequence, name='job.json'):
        path = self.folder / name
        path.write_text(json.dumps({'sequence': sequence}))
        return path

    def start(self, job, out, *more, **how):
        return subprocess.Popen([GONIOD, '--oneshot', str(job), '--out', str(self.folder / out), *more],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)

    def run_to_end(self, job, out, *more, code=0, **how):
        process = self.start(job, out, *more, **how)
        text, errors = process.communicate()
        self.assertEqual(process.returncode, code, errors)
        return [json.loads(line) for line in text.splitlines()], errors

    def killed(self, sequence, kills):
        """An undisturbed run, then one that is killed so often, each time after another frame. Result: both folders."""
        job = self.job(sequence)
        events, _ = self.run_to_end(job, 'whole')
        seconds = [e['seconds'] for e in events if e['event'] == 'frame']
        mean = sum(seconds[1:]) / (len(seconds) - 1)
        print(f'{len(seconds)} frames in {events[-1]["seconds"]:.1f} s: the first one {seconds[0]:.1f} s, then {1 / mean:.2f} a second')
        random.seed(24)
        share = sequence['frames'] // (kills + 2)
        for kill in range(kills):
            process = self.start(job, 'killed')
            for line in process.stdout:  # as soon as it has made some of what was left
                event = json.loads(line)
                if event['event'] == 'frame' and event['state'] == 'written' and event['done'] >= (kill + 1) * share:
                    break
            time.sleep(random.random() * 1.5 * mean)
            process.kill()
            self.assertEqual(process.wait(), -signal.SIGKILL, 'it was killed, it had not ended')
            process.stdout.close()
            process.stderr.close()
        events, _ = self.run_to_end(job, 'killed')
        kept = [e for e in events if e['event'] == 'frame' and e['state'] == 'kept']
        self.assertGreaterEqual(len(kept), kills * share, 'frames that were complete were kept')
        self.assertEqual(contents(self.folder / 'killed'), contents(self.folder / 'whole'))

    def test_killed_runs_and_shards_make_the_same_bytes(self):
        self.killed(SHORT, 3)
        found = contents(self.folder / 'whole')
        entries = json.loads((self.folder / 'whole/manifest.json').read_text())
        self.assertEqual(len(entries), 25)
        for entry in entries:
            self.assertEqual(found[entry['name']], entry['sha256'])
            self.assertEqual((self.folder / 'whole' / entry['name']).stat().st_size, entry['bytes'])
        self.assertEqual(len(found), 2 * 25 + 1, 'a file and an entry each, and the manifest')
        self.assertNotEqual(found['a/frame.0001.png'], found['a/frame.0024.png'])
        # Of shards the last one ends the work; what is damaged is made anew.
        job = self.job(SHORT)
        events, _ = self.run_to_end(job, 'shards', '--shard', '1/2')
        self.assertEqual([e['event'] for e in events][-2:], ['waiting', 'end'])
        self.assertEqual([e['frame'] for e in events if e['event'] == 'frame'], list(range(1, 24, 2)))
        (self.folder / 'shards/a/frame.0004.png').write_bytes(b'damaged')
        events, _ = self.run_to_end(job, 'shards', '--shard', '0/2')
        self.assertEqual(events[-2], {'event': 'waiting', 'frames': 1})
        events, _ = self.run_to_end(job, 'shards', '--shard', '1/2')
        self.assertEqual([e['event'] for e in events][-2:], ['video', 'end'])
        self.assertEqual(events[-1]['written'], 1)
        self.assertEqual(contents(self.folder / 'shards'), found)
        # On a terminal there is a bar in place of the lines.
        (self.folder / 'shards/a/frame.0004.png').unlink()
        terminal, far_end = os.openpty()
        shown = subprocess.run([GONIOD, '--oneshot', str(job), '--out', str(self.folder / 'shards')], stdout=subprocess.PIPE,
                               stderr=far_end)
        os.close(far_end)
        bar = os.read(terminal, 65536).decode()
        os.close(terminal)
        self.assertEqual(shown.stdout, b'')
        self.assertIn('[############################..] 23/24', bar)
        self.assertRegex(bar, r'\[#{30}\] 24/24  [0-9.]+ frames/s  0:00 left')
        self.assertEqual(contents(self.folder / 'shards'), found)

    def test_videos_do_not_depend_on_what_memory_held(self):
        # MALLOC_PERTURB_ of mallopt(3) fills new memory. The frames are kept, the video is made anew.
        job = self.job({**SHORT, 'capture': {**SHORT['capture'], 'size': '64x36'}, 'video': {'file': 'a.mkv'}})
        self.run_to_end(job, 'out')
        made = {contents(self.folder / 'out')['a.mkv']}
        for held in ('0', '85', '170'):
            (self.folder / 'out/a.mkv').unlink()
            events, _ = self.run_to_end(job, 'out', env={**os.environ, 'MALLOC_PERTURB_': held})
            self.assertEqual(events[-1]['written'], 0)
            self.assertEqual([e['state'] for e in events if e['event'] == 'video'], ['written'])
            made.add(contents(self.folder / 'out')['a.mkv'])
        self.assertEqual(len(made), 1)

    def test_sigterm_and_a_full_disk_may_be_tried_again(self):
        process = self.start(self.job({**SHORT, 'frames': 2000}), 'out')
        for line in process.stdout:
            if json.loads(line)['event'] == 'frame':
                break
        process.terminate()
        _, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 75)
        self.assertIn('goes on', errors)
        few = self.job({**SHORT, 'frames': 3})
        limit = ['sh', '-c', 'ulimit -f 1; exec "$0" "$@"', GONIOD, '--oneshot', str(few), '--out', str(self.folder / 'full')]
        full = subprocess.run(limit, capture_output=True, text=True)
        self.assertEqual(full.returncode, 75, full.stderr)
        self.assertIn('frame.0001.png', full.stderr)
        self.assertEqual(list(contents(self.folder / 'full')), [], 'nothing is there by half')

    def test_what_is_wrong_is_never_tried_again_and_writes_nothing(self):
        late = {**SHORT, 'tracks': [  # after 23 frames that are right
            {'set': ['light', 'luminaire', '--level'], 'keys': [{'t': 0, 'value': 0}, {'t': 1, 'value': 1.0448}]}]}
        _, errors = self.run_to_end(self.job(late), 'none', code=78)
        self.assertEqual(errors, 'goniod: sequence.tracks[0] at frame 23, 0.958333 s: invalid_argument: must be a number from 0 to 1 '
                                 '(set_light.level_ratio: 1.00127)\n')
        path = self.folder / 'bad.json'
        path.write_text('{"sequence":')
        _, errors = self.run_to_end(path, 'none', code=78)
        self.assertIn('bad.json: bad_job: the job is not JSON (byte 13)', errors)
        path.write_text('{"sequence": {"frames": 1e999}}')
        _, errors = self.run_to_end(path, 'none', code=78)
        self.assertIn('bad.json: bad_job: the job has a number beyond double precision', errors)
        self.run_to_end(self.job(SHORT), 'none', '--shard', '2/2', code=2)
        self.assertFalse((self.folder / 'none').exists())

    def test_the_docs_examples(self):
        text = DOCS.read_text()
        blocks = {language: code for language, code in re.findall(r'```(json|python|sh|make)\n(.*?)```', text, re.S)}
        environment = {**os.environ, 'PATH': f'{pathlib.Path(GONIOD).resolve().parent}:{os.environ["PATH"]}'}
        running, done = [], []
        for language, command in (('python', [sys.executable, '-I', 'run']), ('sh', ['sh', '-eu', 'run']),
                                  ('make', ['make', '-s', '-j2', '-f', 'run'])):
            folder = self.folder / language
            folder.mkdir()
            (folder / 'job.json').write_text(blocks['json'])
            (folder / 'run').write_text(blocks[language])
            running.append((folder, subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE,
                                                     stderr=subprocess.STDOUT, text=True)))
        for folder, process in running:
            output, _ = process.communicate()
            self.assertEqual(process.returncode, 0, output)
            done.append(contents(folder / 'stills'))
        self.assertEqual(len(json.loads((folder / 'stills/manifest.json').read_text())), 9)
        self.assertIn('preview.mp4', done[0])
        self.assertEqual(done[0], done[1])
        self.assertEqual(done[0], done[2])

    @unittest.skipUnless(LONG or '--long' in sys.argv, 'takes minutes')
    def test_long_240_frames_killed_ten_times(self):
        self.killed({
            'fps': 24, 'frames': 240, 'out': 'frame.####.png',
            'capture': {'size': '640x360'},
            'set': [['exposure', '5'], ['light', 'luminaire', '--level', '1'], ['cue', 'add', '1', '--up', '2', '--hang', '1'],
                    ['light', 'luminaire', '--level', '0.3'], ['cue', 'add', '2', '--up', '3']],
            'camera': {'ease': 'in-out', 'keys': [
                {'t': 0, 'eye': [0, 2.5, 8], 'target': [0, 2, 0], 'fov': 40}, {'t': 5, 'eye': [1.5, 2, 7], 'target': [0, 1.5, 0]},
                {'t': 10, 'eye': [-1, 3, 6.5], 'target': [0, 2, 0], 'fov': 50}]},
            'tracks': [{'set': ['light', 'luminaire', '--aim'], 'keys': [
                {'t': 0, 'value': [0, -1, 0]}, {'t': 4, 'value': [0.4, -1, 0.1], 'ease': 'in-out'}, {'t': 9, 'value': [-0.3, -1, 0]}]}],
            'events': [{'t': 0, 'set': ['cue', 'go']}, {'t': 6, 'set': ['light', 'luminaire', '--cct', '3000']}],
            'video': {'file': 'all.mkv'},
        }, 10)


if __name__ == '__main__':
    GONIOD = str(pathlib.Path(sys.argv.pop(1)).resolve())
    LONG = '--long' in sys.argv
    names = ['Sequences.test_long_240_frames_killed_ten_times'] if LONG else [
        f'Sequences.{name}' for name in dir(Sequences) if name.startswith('test_') and not name.startswith('test_long')]
    unittest.main(argv=[sys.argv[0], *[a for a in sys.argv[1:] if a != '--long'], *(names if len(sys.argv) < 2 + LONG else [])])
