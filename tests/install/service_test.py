#!/usr/bin/python3
"""The service's files agree with each other, and goniod says what a service needs said.

    service_test.py GONIOD GONIO
"""
import json
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

GONIOD, GONIO = sys.argv[1:3]
PACKAGING = pathlib.Path(__file__).parents[2] / 'packaging'
UNIT = (PACKAGING / 'goniod.service').read_text()
MOST_EXPOSED = 16  # tenths of what systemd-analyze security counts


def setting(name):
    return re.search(rf'^{name}=(.*)$', UNIT, re.M)[1].split()


class Service(unittest.TestCase):
    def test_user_groups_and_devices_agree(self):
        made = re.findall(r'^([gum]) (\S+) (\S+)', (PACKAGING / 'gonio.sysusers').read_text(), re.M)
        (user,) = setting('User')
        self.assertNotIn('\nDynamicUser=yes', UNIT)
        self.assertNotIn('\nSupplementaryGroups=', UNIT)  # one that is missing would stop the start
        self.assertIn(('u', user, '-'), made)
        self.assertIn(('g', setting('Group')[0], '-'), made)
        for group in ('video', 'render', 'audio'):  # of DRM, its render nodes and ALSA: udev(7)'s 50-udev-default.rules
            self.assertIn(('m', user, group), made)
        rules = set(re.findall(r'GROUP="(\w+)"', (PACKAGING / '70-gonio.rules').read_text()))
        self.assertEqual(rules, set(setting('Group')))

    def test_it_is_confined(self):
        if not shutil.which('systemd-analyze'):
            self.skipTest('there is no systemd-analyze')
        said = subprocess.run(['systemd-analyze', 'security', '--offline=true', f'--threshold={MOST_EXPOSED}',
                               PACKAGING / 'goniod.service'], capture_output=True, text=True)
        self.assertEqual(said.returncode, 0, said.stdout[-200:] + said.stderr)


class Goniod(unittest.TestCase):
    def test_its_log_is_json_where_asked(self):
        with subprocess.Popen([GONIOD, '--listen', '127.0.0.1:0', '--size', '64x64', '--log', 'json'], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            self.assertTrue(process.stdout.readline().startswith('READY '))
            process.terminate()
            entries = [json.loads(line) for line in process.stderr.read().splitlines()]
        self.assertEqual(process.returncode, 0)
        self.assertIn('stopping', [entry['message'] for entry in entries])
        for entry in entries:
            self.assertEqual(list(entry), ['time', 'level', 'message'])
            self.assertRegex(entry['time'], r'^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$')

    def test_the_end_of_a_start_is_json_too(self):
        with socket.create_server(('127.0.0.1', 0)) as taken:
            at = f'127.0.0.1:{taken.getsockname()[1]}'
            said = subprocess.run([GONIOD, '--listen', at, '--renderer', 'null', '--log', 'json'], capture_output=True, text=True)
        self.assertEqual(said.returncode, 69)
        self.assertEqual(json.loads(said.stderr.splitlines()[-1])['level'], 'critical')

    def test_a_name_with_a_new_line_does_not_break_its_line(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / 'odd "\nname.glb'
            scene.write_text('x')
            command = [GONIOD, '--scene', scene, '--listen', '127.0.0.1:0', '--renderer', 'null', '--log']
            said = {form: subprocess.run([*command, form], capture_output=True, text=True) for form in ('json', 'text')}
        self.assertEqual([one.returncode for one in said.values()], [2, 2])
        self.assertIn('odd "\nname', json.loads(said['json'].stderr)['message'])
        self.assertRegex(said['text'].stderr, r'^goniod: cannot load the scene .*odd "\?name[^\n]*\n$')

    def test_doctor_names_what_is_wrong_with_the_options(self):
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / 'a.toml'
            config.write_text('listen = "0.0.0.0:0"\n')
            said = subprocess.run([GONIO, 'doctor', '--json', '--', '--config', config], capture_output=True, text=True)
        self.assertEqual(said.returncode, 1, said.stderr)
        rows = [json.loads(line) for line in said.stdout.splitlines()]
        self.assertIn('needs --token-file', rows[0]['found'])
        self.assertGreater(len(rows), 5, 'the machine is examined too')

    def test_doctor_tells_a_taken_port_and_its_mend(self):
        with socket.create_server(('127.0.0.1', 0)) as taken:
            at = f'127.0.0.1:{taken.getsockname()[1]}'
            taken.settimeout(0)
            said = subprocess.run([GONIO, 'doctor', '--json', '--', '--listen', at], capture_output=True, text=True)
        self.assertEqual(said.returncode, 1, said.stderr)
        rows = {row['check']: row for row in map(json.loads, said.stdout.splitlines())}
        self.assertEqual(set(rows), {'options', 'egl', 'gpu', 'encoder', 'pictures', 'port', 'device', 'time', 'buffer', 'descriptors'})
        self.assertEqual(rows['port']['state'], 'fault')
        self.assertTrue(rows['port']['mend'])
        for row in rows.values():
            self.assertEqual(row['mend'] == '', row['state'] == 'ok', row)

    def test_doctor_knows_a_goniod_that_runs(self):
        with subprocess.Popen([GONIOD, '--listen', '127.0.0.1:0', '--renderer', 'null'], text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL) as process:
            at = process.stdout.readline().removeprefix('READY http://').strip()
            said = subprocess.run([GONIOD, '--doctor', '--listen', at], capture_output=True, text=True)
            process.terminate()
        self.assertEqual(said.returncode, 0, said.stdout)
        self.assertIn('a goniod listens there already', said.stdout)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
