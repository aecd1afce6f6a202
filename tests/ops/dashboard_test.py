#!/usr/bin/python3
"""Every query of the Grafana dashboard asks for metrics that goniod has, and Prometheus answers it.

    dashboard_test.py GONIOD GONIO [PROMETHEUS]

Without PROMETHEUS only names and labels are compared.
"""
import json
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

GONIOD, GONIO = sys.argv[1:3]
PROMETHEUS = sys.argv[3] if len(sys.argv) > 3 else None
ROOT = pathlib.Path(__file__).parents[2]
PANELS = json.loads((ROOT / 'packaging/grafana-dashboard.json').read_text())['panels']
QUERIES = [target['expr'].replace('$instance', '.*') for panel in PANELS for target in panel['targets']]
LEGENDS = [target['legendFormat'] for panel in PANELS for target in panel['targets']]
# No row until somebody is refused, which no call of this test brings about; of followers alone.
RARE = {'gonio_ws_rejected_total', 'gonio_leader_connected', 'gonio_leader_losses_total'}
OF_PROMETHEUS = {'up'}


def names_in(query):
    """The metrics of a query, histograms without their suffix."""
    bare = re.sub(r'\{[^}]*\}|\[[^]]*\]|by \([^)]*\)', '', query)
    return {re.sub(r'_bucket$', '', name) for name in re.findall(r'\b(?:gonio|process)_\w+|\bup\b', bare)}


class Dashboard(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.goniod = subprocess.Popen([GONIOD, '--listen', '127.0.0.1:0', '--size', '64x64', '--renderer', 'null'], text=True,
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        cls.addClassCleanup(cls.goniod.wait)
        cls.addClassCleanup(cls.goniod.terminate)
        cls.url = cls.goniod.stdout.readline().removeprefix('READY ').strip()
        subprocess.run([GONIO, '--server', cls.url, 'set', 'exposure', '5'], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([GONIO, '--server', cls.url, 'watch', '--frames', '1'], check=True, stdout=subprocess.DEVNULL, timeout=60)
        for _ in range(2):  # the first request is counted by the second
            with urllib.request.urlopen(cls.url + '/metrics') as answer:
                cls.metrics = answer.read().decode()

    def test_its_names_are_those_of_goniod_and_of_the_documentation(self):
        had = set(re.findall(r'^# TYPE (\w+) ', self.metrics, re.M))
        documented = (ROOT / 'docs/operations.md').read_text()
        for query in QUERIES:
            for name in names_in(query) - OF_PROMETHEUS:
                self.assertIn(name, had | RARE, query)
                self.assertIn(f'`{name}', documented, query)

    def test_its_labels_are_those_of_the_metric(self):
        for query in QUERIES:
            by = re.search(r'by \(instance(?:, (\w+))?\)', query)
            (name,) = names_in(query) if by else (None,)
            if by and by[1] not in (None, 'le') and name not in RARE:
                self.assertTrue(re.search(rf'(?m)^{name}\{{[^}}]*\b{by[1]}="', self.metrics), query)

    def test_each_machine_has_its_own_lines(self):
        for query, legend in zip(QUERIES, LEGENDS, strict=True):
            self.assertNotRegex(query, r'by \((?!instance)', 'an aggregate keeps the machine')
            self.assertTrue(legend.startswith('{{instance}} '), legend)

    def test_prometheus_answers_each(self):
        if not PROMETHEUS:
            self.skipTest('no Prometheus was given')
        with tempfile.TemporaryDirectory() as folder, socket.socket() as free:
            free.bind(('127.0.0.1', 0))
            at = f'127.0.0.1:{free.getsockname()[1]}'
            free.close()
            config = pathlib.Path(folder) / 'prometheus.yml'
            config.write_text('global: {scrape_interval: 1s}\nscrape_configs:\n- job_name: gonio\n  static_configs:\n'
                              f'  - targets: ["{self.url.removeprefix("http://")}"]\n')
            with subprocess.Popen([PROMETHEUS, f'--config.file={config}', f'--storage.tsdb.path={folder}/data',
                                   f'--web.listen-address={at}'], stderr=subprocess.DEVNULL) as prometheus:
                try:
                    self.ask_all(f'http://{at}/api/v1/query?query=')
                finally:
                    prometheus.terminate()

    def ask_all(self, url):
        deadline = time.monotonic() + 60
        while True:  # until two scrapes are there, which a rate needs
            try:
                if self.ask(url, 'rate(process_cpu_seconds_total[1m])'):
                    break
            except urllib.error.URLError:
                pass
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.5)
        for query in QUERIES:
            rows = self.ask(url, query)  # HTTP 400 where it cannot be parsed
            if not names_in(query) & RARE and 'mjpeg' not in query and 'increase' not in query:
                self.assertTrue(rows, query)

    @staticmethod
    def ask(url, query):
        with urllib.request.urlopen(url + urllib.parse.quote(query)) as answer:
            return json.load(answer)['data']['result']


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
