#!/usr/bin/python3
"""The fields of the Kubernetes manifest, as the Job API has them, and what they say together.

    kubernetes_test.py

Debian's kubectl is older than Indexed Jobs, so the rules are here: kubernetes/website, concepts/workloads/controllers/job.md.
"""
import pathlib
import re
import unittest

import yaml

FILE = pathlib.Path(__file__).parents[2] / 'packaging/kubernetes-job.yaml'
# Of batch/v1 Job (API reference, 1.33): what may stand in each object that the manifest uses.
JOB = {'apiVersion', 'kind', 'metadata', 'spec'}
JOB_SPEC = {'activeDeadlineSeconds', 'backoffLimit', 'backoffLimitPerIndex', 'completionMode', 'completions', 'manualSelector',
            'maxFailedIndexes', 'parallelism', 'podFailurePolicy', 'podReplacementPolicy', 'selector', 'successPolicy', 'suspend',
            'template', 'ttlSecondsAfterFinished', 'managedBy'}
CONTAINER = {'args', 'command', 'env', 'envFrom', 'image', 'imagePullPolicy', 'name', 'ports', 'resources', 'securityContext',
             'volumeMounts', 'workingDir'}
AGAIN, NEVER = 75, [2, 78]  # goniod's exit codes: another attempt may do it; none will


class Manifest(unittest.TestCase):
    def setUp(self):
        self.job = yaml.safe_load(FILE.read_text())
        self.spec = self.job['spec']
        self.pod = self.spec['template']['spec']
        (self.container,) = self.pod['containers']

    def test_its_fields_are_those_of_the_api(self):
        self.assertEqual((self.job['apiVersion'], self.job['kind']), ('batch/v1', 'Job'))
        self.assertEqual(set(self.job) - JOB, set())
        self.assertEqual(set(self.spec) - JOB_SPEC, set())
        self.assertEqual(set(self.container) - CONTAINER, set())
        self.assertRegex(self.job['metadata']['name'], r'^[a-z0-9]([-a-z0-9]{0,61}[a-z0-9])?$')

    def test_each_index_is_a_shard_of_all(self):
        self.assertEqual(self.spec['completionMode'], 'Indexed')
        command = self.container['command']
        shard = command[command.index('--shard') + 1]
        variable, count = re.fullmatch(r'\$\((\w+)\)/(\d+)', shard).groups()
        self.assertEqual(int(count), self.spec['completions'])
        self.assertLessEqual(self.spec['parallelism'], self.spec['completions'])
        (index,) = (one for one in self.container['env'] if one['name'] == variable)
        self.assertEqual(index['valueFrom']['fieldRef']['fieldPath'],
                         "metadata.annotations['batch.kubernetes.io/job-completion-index']")

    def test_attempts_are_counted_an_index_and_what_cannot_be_done_ends_it(self):
        self.assertGreater(self.spec['backoffLimitPerIndex'], 0)
        self.assertEqual(self.pod['restartPolicy'], 'Never')  # backoffLimitPerIndex and podFailurePolicy ask for it
        ending = [rule for rule in self.spec['podFailurePolicy']['rules'] if rule['action'] == 'FailIndex']
        codes = ending[0]['onExitCodes']
        self.assertEqual((codes['operator'], codes['values']), ('In', NEVER))
        self.assertNotIn(AGAIN, codes['values'])
        self.assertEqual(codes['containerName'], self.container['name'])
        for rule in self.spec['podFailurePolicy']['rules']:
            self.assertIn(rule['action'], ('FailJob', 'FailIndex', 'Ignore', 'Count'))
            self.assertEqual(len(set(rule) & {'onExitCodes', 'onPodConditions'}), 1)

    def test_what_is_mounted_is_there(self):
        volumes = {volume['name'] for volume in self.pod['volumes']}
        paths = {mount['mountPath']: mount['name'] for mount in self.container['volumeMounts']}
        self.assertEqual(set(paths.values()), volumes)
        command = self.container['command']
        self.assertIn(str(pathlib.Path(command[command.index('--oneshot') + 1]).parent), paths)
        self.assertIn(command[command.index('--out') + 1], paths)


if __name__ == '__main__':
    unittest.main()
