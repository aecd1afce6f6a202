#!/usr/bin/python3
"""The Debian package in a bare Debian 12: installed, run, upgraded, removed, purged.

    package_test.py DEB FOLDER [DEB_OF_ANOTHER_BUILD_FOLDER]

needs root, mmdebstrap, lintian and Debian's archive. FOLDER keeps the bare system and what apt fetched.
"""
import gzip
import hashlib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

DEB, KEPT = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
OTHER = pathlib.Path(sys.argv[3]).resolve() if len(sys.argv) > 3 else None
CHROOT = shutil.which('chroot', path='/usr/sbin:/usr/bin')
COMPLETIONS = ('bash-completion/completions/{}', 'zsh/vendor-completions/_{}', 'fish/vendor_completions.d/{}.fish')
FILES = {'etc/goniod/goniod.toml', 'usr/lib/systemd/system/goniod.service', 'usr/lib/sysusers.d/gonio.conf',
         'usr/lib/udev/rules.d/70-gonio.rules', 'usr/share/doc/gonio/copyright', 'usr/share/doc/gonio/changelog.gz',
         'usr/share/doc/gonio/operations.md', 'usr/share/doc/gonio/grafana-dashboard.json',
         'usr/share/doc/gonio/slurm-array.sh', 'usr/share/doc/gonio/kubernetes-job.yaml', 'usr/share/man/man8/goniod.8.gz', 'usr/share/man/man1/gonio.1.gz',
         'usr/share/man/man1/gonio-bench.1.gz'}
FILES |= {f'usr/bin/{name}' for name in ('goniod', 'gonio', 'gonio-bench')}
FILES |= {'usr/share/' + form.format(name) for form in COMPLETIONS for name in ('goniod', 'gonio', 'gonio-bench')}


def run(*command, **more):
    return subprocess.run(command, check=True, capture_output=True, text=True, **more).stdout


def field(name):
    return run('dpkg-deb', '--field', DEB, name).strip()


class Package(unittest.TestCase):
    def test_lintian_finds_no_error_and_no_warning(self):
        said = subprocess.run(['lintian', '--fail-on', 'error,warning', '--allow-root', DEB], capture_output=True, text=True)
        self.assertEqual(said.returncode, 0, said.stdout + said.stderr)

    def test_it_holds_the_files(self):
        held = {line.split()[5][2:] for line in run('dpkg-deb', '--contents', DEB).splitlines()}
        self.assertEqual(FILES - held, set())

    def test_two_build_folders_give_the_same_bytes(self):
        if OTHER is None:
            self.skipTest('one package was given')
        self.assertEqual(*(hashlib.sha256(path.read_bytes()).hexdigest() for path in (DEB, OTHER)))


class Bare(unittest.TestCase):
    """One after the other, on one system."""

    @classmethod
    def setUpClass(cls):
        KEPT.mkdir(parents=True, exist_ok=True)
        tar, archives = KEPT / 'bookworm.tar', KEPT / 'archives'
        archives.mkdir(exist_ok=True)
        if not tar.exists():
            run('mmdebstrap', '--variant=minbase', '--include=init-system-helpers', 'bookworm', tar)
        cls.folder = tempfile.TemporaryDirectory(dir=KEPT)
        cls.addClassCleanup(cls.folder.cleanup)
        cls.root = pathlib.Path(cls.folder.name)
        run('tar', '-xf', tar, '-C', cls.root)
        shutil.copy('/etc/resolv.conf', cls.root / 'etc/resolv.conf')
        (cls.root / 'etc/apt/apt.conf.d/docker-clean').unlink(missing_ok=True)
        for source, at, options in (('proc', 'proc', ('-t', 'proc')), (archives, 'var/cache/apt/archives', ('--bind',))):
            run('mount', *options, source, cls.root / at)
            cls.addClassCleanup(run, 'umount', '--lazy', cls.root / at)
        shutil.copy(DEB, cls.root / 'tmp/gonio.deb')

    def inside(self, command, **more):
        """Result: what a shell in the system prints; a failure fails the test with all of it."""
        environment = {'PATH': '/usr/sbin:/usr/bin:/sbin:/bin', 'DEBIAN_FRONTEND': 'noninteractive', 'LC_ALL': 'C.UTF-8',
                       'HOME': '/root'}
        said = subprocess.run([CHROOT, self.root, 'sh', '-c', command], env=environment, text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, **more)
        self.assertEqual(said.returncode, 0, f'{command}\n{said.stdout}')
        return said.stdout

    def path(self, name):
        return self.root / name.lstrip('/')

    def test_1_installs(self):
        self.inside('apt-get update -qq')
        said = self.inside('apt-get install -y --no-install-recommends /tmp/gonio.deb')
        sizes = re.search(r'Need to get (?:\S+ \w?B/)?(\S+ \w?B) of archives', said)
        after = re.search(r'After this operation, (\S+ \w?B)', said)
        print(f'package {DEB.stat().st_size / 1e6:.1f} MB, {int(field("Installed-Size")) / 1e3:.1f} MB installed; '
              f'with what it needs {sizes and sizes[1]} to fetch, {after and after[1]} on the disk', file=sys.stderr)
        for name in FILES:
            self.assertTrue(self.path(name).exists(), name)
        self.assertRegex(self.inside('id gonio'), r'gid=\d+\(gonio\)')
        self.assertLessEqual({'gonio', 'render', 'video', 'audio'}, set(self.inside('id -Gn gonio').split()))
        self.assertTrue(self.path('/etc/systemd/system/multi-user.target.wants/goniod.service').is_symlink())
        token = self.path('/etc/goniod/token')
        self.assertEqual(token.stat().st_mode & 0o777, 0o600)
        self.assertRegex(token.read_text(), r'^[0-9a-f]{64}\n$')
        self.inside('goniod --config /etc/goniod/goniod.toml --check-config')

    def test_2_runs_and_shows_a_picture(self):
        environment = {'PATH': '/usr/sbin:/usr/bin:/sbin:/bin', 'HOME': '/tmp'}
        command = [CHROOT, self.root, 'goniod', '--scene', 'cornell', '--listen', '127.0.0.1:0', '--size', '128x128']
        with subprocess.Popen(command, env=environment, text=True, stdout=subprocess.PIPE) as process:
            try:
                begun = time.monotonic()
                url = process.stdout.readline().removeprefix('READY ').strip()
                print(f'READY after {time.monotonic() - begun:.1f} s', file=sys.stderr)
                with urllib.request.urlopen(url + '/v1/frame.png', timeout=60) as still:
                    self.assertEqual(still.read(8), b'\x89PNG\r\n\x1a\n')
                self.inside(f'gonio --server {url} capture /tmp/first.png && gonio --server {url} set exposure 5')
                self.assertEqual(self.path('/tmp/first.png').read_bytes()[:8], b'\x89PNG\r\n\x1a\n')
            finally:
                process.terminate()
        self.assertEqual(process.returncode, 0)
        self.assertIn('ok       egl', self.inside('gonio doctor -- --listen 127.0.0.1:0'))
        self.assertIn('usage: gonio', self.inside('gonio --help'))
        for page in ('man8/goniod.8.gz', 'man1/gonio.1.gz', 'man1/gonio-bench.1.gz'):
            self.assertIn('.SH SYNOPSIS', gzip.decompress(self.path('/usr/share/man/' + page).read_bytes()).decode())

    def test_3_the_users_of_unit_and_rules_agree(self):
        unit = self.path('/usr/lib/systemd/system/goniod.service').read_text()
        rules = self.path('/usr/lib/udev/rules.d/70-gonio.rules').read_text()
        user = re.search(r'^User=(\S+)$', unit, re.M)[1]
        self.assertEqual({self.inside(f'id -gn {user}').strip()}, set(re.findall(r'GROUP="(\w+)"', rules)))
        # As the service: its state is written, the token of root is not read.
        self.inside(f'install -d -o {user} -g {user} /var/lib/goniod')
        said = self.inside(f'setpriv --reuid {user} --regid {user} --init-groups env HOME=/tmp sh -c "! cat '
                           '/etc/goniod/token 2>/dev/null && goniod --config /etc/goniod/goniod.toml --listen 127.0.0.1:0 '
                           '--doctor"')
        self.assertIn('ok       port', said)

    def test_4_upgrades_and_keeps_what_was_changed(self):
        config, token = self.path('/etc/goniod/goniod.toml'), self.path('/etc/goniod/token').read_text()
        config.write_text(config.read_text() + 'max-clients = 7\n')
        newer = self.path('/tmp/newer')
        run('dpkg-deb', '--raw-extract', DEB, newer)
        control = newer / 'DEBIAN/control'
        control.write_text(re.sub(r'(?m)^Version: .*$', lambda found: found[0] + '+1', control.read_text()))
        run('dpkg-deb', '--root-owner-group', '-z1', '--build', newer, self.path('/tmp/newer.deb'))
        self.inside('apt-get install -y /tmp/newer.deb')
        self.assertTrue(self.inside("dpkg-query -W -f '${Version}' gonio").endswith('+1'))
        self.assertIn('max-clients = 7', config.read_text())
        self.assertEqual(self.path('/etc/goniod/token').read_text(), token)
        self.assertTrue(self.path('/etc/systemd/system/multi-user.target.wants/goniod.service').is_symlink())

    def test_5_is_removed_but_for_its_settings(self):
        self.inside('apt-get remove -y gonio')
        self.assertFalse(self.path('/usr/bin/goniod').exists())
        self.assertIn('max-clients = 7', self.path('/etc/goniod/goniod.toml').read_text())
        self.assertTrue(self.path('/etc/goniod/token').exists())
        self.assertTrue(self.path('/var/lib/goniod').exists())

    def test_6_purged_leaves_nothing(self):
        self.inside('apt-get purge -y gonio')
        for name in ('/etc/goniod', '/var/lib/goniod', '/usr/share/doc/gonio', '/etc/systemd/system/goniod.service',
                     '/etc/systemd/system/multi-user.target.wants/goniod.service'):
            path = self.path(name)
            self.assertFalse(path.exists() or path.is_symlink(), name)
        left = self.inside("find / -xdev \\( -path /proc -o -path /tmp -o -path /var/cache -o -path /var/log \\) -prune -o -iname '*gonio*' -print")
        self.assertEqual(left, '')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
