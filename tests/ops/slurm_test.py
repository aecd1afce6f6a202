#!/usr/bin/python3
"""Shards of a sequence: as a Slurm job array that loses a node, and killed at random.

    slurm_test.py GONIOD

The first needs root and Debian's slurmctld, slurmd, slurm-client and munge; all run in a folder and on ports of their own.
"""
import collections
import hashlib
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

GONIOD = pathlib.Path(sys.argv[1]).resolve()
SCRIPT = pathlib.Path(__file__).parents[2] / 'packaging/slurm-array.sh'
DAEMONS = ('munged', 'mungekey', 'slurmctld', 'slurmd', 'sbatch', 'scontrol')
PATH = f'{GONIOD.parent}:{os.environ["PATH"]}:/usr/sbin'
FRAMES, SHARDS = 40, 4  # the array of SCRIPT
# Path-traced: it needs no GL. A frame takes some tenths of a second on one processor.
JOB = {'sequence': {
    'fps': 24, 'frames': FRAMES, 'out': 'a/frame.####.png',
    'capture': {'quality': 'reference', 'noise': 0.15, 'size': '64x36'},
    'set': [['exposure', '4']],
    'camera': {'keys': [{'t': 0, 'eye': [0, 2.5, 7], 'target': [0, 2, 0]}, {'t': 2, 'eye': [1, 2, 6], 'fov': 50}]},
    'tracks': [{'set': ['light', 'luminaire', '--level'], 'keys': [{'t': 0, 'value': 0.1}, {'t': 2, 'value': 1, 'ease': 'in'}]}],
    'video': {'file': 'a.mp4'},
}}
CONFIGURATION = '''
ClusterName=gonio
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort={ports[0]}
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,bf_interval=2
MpiDefault=none
RequeueExit=75
SlurmdTimeout=8
SlurmdParameters=config_overrides
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port={ports[1]} CPUs=1 State=UNKNOWN
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port={ports[2]} CPUs=1 State=UNKNOWN
PartitionName=farm Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
'''


def contents(folder):
    """All files below, hidden ones too, by name."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in pathlib.Path(folder).rglob('*') if path.is_file()}


def frame_events(text):
    """Of goniod's lines those of frames; a kill may have cut the last one."""
    lines = text[:text.rfind('\n') + 1].splitlines()
    return [event for event in map(json.loads, lines) if event['event'] == 'frame']


def until(what, seconds, why):
    """The first result of what() that is not false."""
    deadline = time.monotonic() + seconds
    while not (result := what()):
        if time.monotonic() > deadline:
            raise AssertionError(f'not within {seconds} s: {why}')
        time.sleep(0.02)
    return result


def free_ports(count):
    sockets = [socket.create_server(('127.0.0.1', 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def ended(process):
    """TERM, and KILL where that does not help."""
    process.terminate()
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


class Shards(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix='gonio_shards_'))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.job = self.folder / 'job.json'
        self.job.write_text(json.dumps(JOB))
        subprocess.run([GONIOD, '--oneshot', self.job, '--out', self.folder / 'whole'], check=True, capture_output=True)

    def assert_complete(self, out):
        """Files, entries, video and manifest are those of the run that nothing disturbed, one of each."""
        self.assertEqual(contents(out), contents(self.folder / 'whole'))
        entries = json.loads((out / 'manifest.json').read_text())
        self.assertEqual([entry.get('frame') for entry in entries], [*range(FRAMES), None], 'one entry a frame, then the video')
        self.assertEqual(len(contents(out)), 2 * (FRAMES + 1) + 1, 'a file and an entry each, and the manifest')

    def assert_each_was_written_once(self, attempts):
        """attempts: the events of each run. A frame is written once; after a kill between entry and line only its entry tells."""
        written = collections.Counter(event['frame'] for events in attempts for event in events if event['state'] == 'written')
        self.assertEqual(set(written.values()), {1})
        kept = {event['frame'] for events in attempts for event in events if event['state'] == 'kept'}
        untold = set(range(FRAMES)) - set(written)
        self.assertLessEqual(untold, kept)
        return untold


class Kills(Shards):
    def test_two_shards_killed_ten_times(self):
        random.seed(25)
        out, logs, kills = self.folder / 'out', [[], []], [0, 0]

        def start(shard):
            logs[shard].append(self.folder / f'{shard}.{len(logs[shard])}')
            with logs[shard][-1].open('w') as log:
                return subprocess.Popen([GONIOD, '--oneshot', self.job, '--out', out, '--shard', f'{shard}/2'], stdout=log,
                                        stderr=log)

        running = [start(0), start(1)]
        try:
            while sum(kills) < 10:
                shard = random.randrange(2) if abs(kills[0] - kills[1]) < 2 else kills.index(min(kills))
                # Half of the kills come after another frame, so that there is work to lose; half at any time, in the start too.
                if sum(kills) % 2:
                    until(lambda: '"written"' in logs[shard][-1].read_text() or running[shard].poll() is not None, 60, 'a frame')
                time.sleep(random.random() * 0.15)
                running[shard].kill()
                self.assertEqual(running[shard].wait(), -signal.SIGKILL, logs[shard][-1].read_text())
                kills[shard] += 1
                running[shard] = start(shard)
            self.assertEqual([process.wait(120) for process in running], [0, 0])
        finally:
            for process in running:
                process.kill()
                process.wait()
        self.assert_complete(out)
        untold = self.assert_each_was_written_once([frame_events(log.read_text()) for log in logs[0] + logs[1]])
        self.assertLessEqual(len(untold), 10)
        print(f'killed {kills} times; untold {sorted(untold)}')


@unittest.skipUnless(os.geteuid() == 0 and all(shutil.which(name, path=PATH) for name in DAEMONS),
                     'Slurm is not installed, or this is not root: slurmctld, slurmd, slurm-client, munge')
class Array(Shards):
    def setUp(self):
        super().setUp()
        self.environment = {**os.environ, 'PATH': PATH, 'SLURM_CONF': str(self.folder / 'slurm.conf')}
        for name in ('state', 'spool/n1', 'spool/n2'):
            (self.folder / name).mkdir(parents=True)
        text = CONFIGURATION.format(ports=free_ports(3), folder=self.folder)
        (self.folder / 'slurm.conf').write_text(text)
        self.slurm('mungekey', '--create', f'--keyfile={self.folder}/munge.key')
        self.addCleanup(self.kill_what_is_left)
        files = [f'--{name}={self.folder}/munge.{end}' for name, end in
                 (('socket', 'socket'), ('key-file', 'key'), ('pid-file', 'pid'), ('log-file', 'log'), ('seed-file', 'seed'))]
        self.daemon('munged', '--foreground', '--force', *files)  # --force: the folder is ours alone
        until((self.folder / 'munge.socket').exists, 10, 'munged')
        self.daemon('slurmctld', '-D')
        self.nodes = {name: self.daemon('slurmd', '-D', '-N', name) for name in ('n1', 'n2')}
        until(lambda: self.slurm('sinfo', '--noheader', '--Node', '--format=%T').split() == ['idle', 'idle'], 60, self.logs())

    def daemon(self, *command):
        with (self.folder / 'daemons.log').open('a') as log:
            process = subprocess.Popen(command, env=self.environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                       cwd=self.folder)
        self.addCleanup(ended, process)
        return process

    def slurm(self, *command):
        """What a command of Slurm says; nothing where it fails."""
        return subprocess.run(command, env=self.environment, cwd=self.folder, stdout=subprocess.PIPE, text=True).stdout

    def logs(self):
        return '\n'.join(path.read_text() for path in self.folder.glob('*.log'))

    def processes(self):
        """All that have this test's SLURM_CONF: (pid, program, variables)."""
        for path in pathlib.Path('/proc').glob('[0-9]*'):
            try:
                lines = (path / 'environ').read_bytes().decode(errors='replace').split('\0')
                variables = dict(line.split('=', 1) for line in lines if '=' in line)
                if variables.get('SLURM_CONF') == self.environment['SLURM_CONF']:
                    yield int(path.name), os.readlink(path / 'exe'), variables
            except OSError:  # it has ended
                pass

    def tasks(self):
        """The goniod that run now, by node: {'n1': (pid, number of the shard)}."""
        return {variables['SLURMD_NODENAME']: (pid, int(variables['SLURM_ARRAY_TASK_ID']))
                for pid, program, variables in self.processes() if program == str(GONIOD)}

    def kill_what_is_left(self):
        """After the daemons: tasks, and what watches them, which would ask the controller for minutes."""
        for pid, _, _ in self.processes():
            os.kill(pid, signal.SIGKILL)
        until(lambda: not list(self.processes()), 10, 'dead')

    def events(self, task):
        return frame_events((self.folder / f'gonio-frames-{self.array}_{task}.jsonl').read_text())

    def test_a_job_array_that_loses_a_node_and_a_task(self):
        out = self.folder / 'out'
        said = self.slurm('sbatch', '--parsable', str(SCRIPT), str(self.job), str(out))
        self.array = said.strip()
        self.assertRegex(self.array, r'^\d+$')
        until(lambda: len(self.tasks()) == 2, 60, self.logs())
        running = self.tasks()
        for _, task in running.values():
            until(lambda: len(self.events(task)) >= 2, 60, 'two frames')
        self.assertEqual(self.tasks(), running)
        # Each has as many processors as Slurm said, its own.
        processors = [os.sched_getaffinity(pid) for pid, _ in running.values()]
        self.assertEqual([len(one) for one in processors], [1, 1])
        if os.cpu_count() > 1:
            self.assertNotEqual(*processors)
        # A machine goes: its slurmd, what watches the task, the task.
        pid, lost = running['n2']
        parent = int(pathlib.Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[1])
        self.assertIn('slurmstepd', pathlib.Path(f'/proc/{parent}/cmdline').read_text())
        for one in (self.nodes['n2'].pid, parent, pid):
            os.kill(one, signal.SIGKILL)
        until(lambda: 'n2' not in self.tasks(), 10, 'dead')
        # The other one is asked to stop, and says 75.
        stopped = running['n1'][1]
        os.kill(running['n1'][0], signal.SIGTERM)
        complete = {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in out.glob('a/*.png')
                    if (out / f'manifest/a/{path.name}.json').exists()}
        told = len(self.events(lost))
        self.assertTrue(2 <= told < FRAMES // SHARDS, 'killed in the middle')

        def done():
            # Slurm waits for two minutes before it starts a task again.
            for line in self.slurm('squeue', '--noheader', '--format=%i %r').splitlines():
                job, reason = line.split(' ', 1)
                if reason == 'BeginTime':
                    self.slurm('scontrol', 'update', f'jobid={job}', 'StartTime=now')
            time.sleep(0.5)
            return not self.slurm('squeue', '--noheader')

        until(done, 100, self.logs())
        states = {}
        for line in self.slurm('scontrol', '--oneliner', 'show', 'job', self.array).splitlines():
            fields = dict(field.split('=', 1) for field in line.split() if '=' in field)
            states[int(fields['ArrayTaskId'])] = (fields['JobState'], fields['ExitCode'], int(fields['Restarts']))
        self.assertEqual(states, {task: ('COMPLETED', '0:0', int(task in (lost, stopped))) for task in range(SHARDS)})
        self.assertRegex(self.slurm('sinfo', '--noheader', '--Node', '--nodes=n2', '--format=%T'), r'^down')
        self.assert_complete(out)
        for name, was in complete.items():
            now = (out / 'a' / name).stat()
            self.assertEqual((now.st_ino, now.st_mtime_ns), was, f'{name} was not made again')
        untold = self.assert_each_was_written_once([self.events(task) for task in range(SHARDS)])
        self.assertLessEqual(len(untold), 1)
        self.assertLessEqual({frame % SHARDS for frame in untold}, {lost})
        print(f'task {lost} of n2 killed after {told} of {FRAMES // SHARDS} frames, {stopped} of n1 stopped; untold {sorted(untold)}')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
