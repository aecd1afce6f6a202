#!/usr/bin/python3
"""gonio relay: what receivers get of it.

    relay_test.py GONIOD GONIO

Needs no package: the receiver of RTP is the test's own.
"""
import fcntl
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from goniod import Goniod  # noqa: E402

GONIOD, GONIO = (str(pathlib.Path(program).resolve()) for program in sys.argv[1:3])
IDR, SPS, STAP_A, FU_A = 5, 7, 24, 28


def until(true, seconds, what):
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            raise AssertionError(f'not within {seconds} s: {what}')
        time.sleep(0.02)


class Receiver:
    """Two sockets of this machine, RTP's at an even port; keeps the numbers of packets and the pictures."""

    def __init__(self):
        while True:
            self.rtp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.rtp.bind(('127.0.0.1', 0))
            self.port = self.rtp.getsockname()[1]
            self.rtcp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            try:
                self.rtcp.bind(('127.0.0.1', self.port + 1))
                break
            except (OSError, OverflowError):
                self.rtp.close()
                self.rtcp.close()
        self.sequence, self.lost, self.source = None, 0, None
        self.pictures = []  # (arrival s, RTP time, types of its NAL units)
        self.types = []

    def close(self):
        self.rtp.close()
        self.rtcp.close()

    def receive(self, seconds, enough=lambda: False):
        end = time.monotonic() + seconds
        while not enough() and (left := end - time.monotonic()) > 0:
            self.rtp.settimeout(left)
            try:
                packet = self.rtp.recv(2000)
            except TimeoutError:
                return
            first, kind, sequence, stamp, self.source = struct.unpack('>BBHII', packet[:12])
            assert first == 0x80 and kind & 127 == 96 and len(packet) <= 1200, packet[:12]
            if self.sequence is not None:
                self.lost += (sequence - self.sequence - 1) % 65536
            self.sequence = sequence
            nal = packet[12] & 31
            if nal == STAP_A:
                at = 13
                while at < len(packet):
                    self.types.append(packet[at + 2] & 31)
                    at += 2 + int.from_bytes(packet[at:at + 2], 'big')
            elif nal != FU_A:
                self.types.append(nal)
            elif packet[13] & 128:
                self.types.append(packet[13] & 31)
            if kind & 128:
                self.pictures.append((time.monotonic(), stamp, self.types))
                self.types = []

    def keys(self):
        return [picture for picture in self.pictures if IDR in picture[2]]


class Relaying(unittest.TestCase):
    goniod = None  # where a test has none of its own

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def relay(self, *options, url=None, before=(), **given):
        with open(self.folder / 'relay', 'w') as said:
            process = subprocess.Popen([GONIO, '--server', url or self.goniod.url, *before, 'relay', *options], stderr=said,
                                       **given)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return process

    def said(self):
        return (self.folder / 'relay').read_text()

    def receiver(self):
        receiver = Receiver()
        self.addCleanup(receiver.close)
        return receiver


class Relays(Relaying):
    @classmethod
    def setUpClass(cls):
        cls.goniod = Goniod(GONIOD, '--size', '320x240', '--renderer', 'null', '--key-interval', '0.1')
        cls.addClassCleanup(cls.goniod.stop)

    def test_rtp_has_key_frames_while_nothing_moves(self):
        receiver = self.receiver()
        sdp = self.folder / 'a.sdp'
        self.relay('--rtp', f'127.0.0.1:{receiver.port}', '--sdp', str(sdp), '--key-every', '0.5')
        receiver.receive(10, lambda: len(receiver.keys()) == 4)
        keys = receiver.keys()
        self.assertEqual(len(keys), 4, self.said())
        for arrival, before in zip(keys[1:], keys):
            self.assertLess(arrival[0] - before[0], 2)
        # RTP's clock goes as this one does; a busy machine may deliver the first or the last picture late.
        first, last = keys[0], keys[-1]
        self.assertAlmostEqual((last[1] - first[1]) % 2 ** 32 / 90000, last[0] - first[0], delta=1)
        for _, _, types in keys:
            self.assertEqual([kind for kind in types if kind in (7, 8)], [7, 8], 'parameter sets before each')
        self.assertIn(f'm=video {receiver.port} RTP/AVPF 96\r\n', sdp.read_bytes().decode())
        self.assertEqual(receiver.lost, 0)

    def test_a_pli_brings_a_key_frame(self):
        receiver = self.receiver()
        relay = self.relay('--rtp', f'127.0.0.1:{receiver.port}', '--key-every', '60', stdout=subprocess.DEVNULL)
        receiver.rtcp.settimeout(10)
        report, reporter = receiver.rtcp.recvfrom(1000)
        receiver.receive(0.7)
        self.assertEqual((report[1], struct.unpack('>I', report[4:8])[0]), (200, receiver.source))
        self.assertEqual(len(receiver.keys()), 1)
        receiver.rtcp.sendto(struct.pack('>BBHII', 0x81, 206, 2, 1, receiver.source), reporter)
        receiver.receive(3, lambda: len(receiver.keys()) == 2)
        self.assertEqual(len(receiver.keys()), 2)

        relay.terminate()
        self.assertEqual(relay.wait(5), 0)
        while report[-8:-6] != b'\x81\xcb':  # BYE
            report = receiver.rtcp.recv(1000)
        self.assertRegex(self.said(), r'asked_by_receivers 1, packets_sent \d+, packets_unsent 0, connections_lost 0')

    def test_annexb_is_a_byte_stream_that_begins_with_parameter_sets(self):
        relay = self.relay('--annexb', '--frames', '3', '--key-every', '0.5', stdout=subprocess.PIPE)
        stream, _ = relay.communicate(timeout=30)
        self.assertEqual(relay.returncode, 0, self.said())
        types = [part[0] & 31 for part in re.split(b'\0\0\0?\1', stream)[1:]]
        self.assertEqual(types[:2], [7, 8])
        self.assertGreaterEqual(sum(kind in (1, 5) for kind in types), 3)

    def test_it_goes_on_after_a_broken_connection(self):
        receiver = self.receiver()
        self.relay('--rtp', f'127.0.0.1:{receiver.port}', '--key-every', '0.5', stdout=subprocess.DEVNULL)
        receiver.receive(10, lambda: len(receiver.keys()) > 1)
        self.goniod.stop(signal.SIGKILL)
        until(lambda: 'the connection broke' in self.said(), 5, 'it says so')
        receiver.receive(0.2)
        away = len(receiver.keys())
        receiver.receive(3, lambda: len(receiver.keys()) == away + 1)
        self.assertEqual(len(receiver.keys()), away + 1, 'the last key frame is sent on')
        self.goniod.start()
        until(lambda: 'connected again' in self.said(), 10, 'it is there again')
        back = len(receiver.keys())
        receiver.receive(3, lambda: len(receiver.keys()) == back + 1)
        self.assertEqual(len(receiver.keys()), back + 1)
        stamps = [picture[1] for picture in receiver.pictures]
        for after, before in zip(stamps[1:], stamps):
            self.assertLess((after - before) % 2 ** 32, 90000 * 2, 'times rise by what passed')
        self.assertEqual(receiver.lost, 0)

    def test_the_sdp_follows_the_parameters(self):
        receiver, sdp = self.receiver(), self.folder / 'size.sdp'
        self.relay('--rtp', f'127.0.0.1:{receiver.port}', '--key-every', '0.5', '--sdp', str(sdp), stdout=subprocess.DEVNULL)
        until(lambda: sdp.exists() and 'sprop-parameter-sets' in sdp.read_text(), 10, 'it is written')
        before = sdp.read_text()
        subprocess.run([GONIO, '--server', self.goniod.url, 'set', 'size', '640x360'], check=True, stdout=subprocess.DEVNULL)
        try:
            until(lambda: sdp.read_text() != before, 10, 'it is written again')
        finally:
            subprocess.run([GONIO, '--server', self.goniod.url, 'set', 'size', '320x240'], check=True, stdout=subprocess.DEVNULL)

    def test_a_full_pipe_ends_with_the_signal(self):
        process = subprocess.Popen([GONIO, '--server', self.goniod.url, 'relay', '--annexb', '--key-every', '0.5'],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        fcntl.fcntl(process.stdout, fcntl.F_SETPIPE_SZ, 4096)
        until(lambda: fcntl.ioctl(process.stdout, termios.FIONREAD, b'1234') != b'\0\0\0\0', 10, 'it writes')
        time.sleep(3)  # the rest finds the pipe full
        process.terminate()
        self.assertEqual(process.wait(5), 0, process.stderr.read())
        process.stdout.close()
        process.stderr.close()

    def test_what_cannot_be_is_refused(self):
        for words, code, said in ((['--rtp', '127.0.0.1:1', '--annexb'], 2, 'One of'), ([], 2, 'One of'),
                                  (['--annexb', '--sdp', 'a'], 2, '--sdp'), (['--rtp', 'a'], 2, 'HOST:PORT'),
                                  (['--rtp', '127.0.0.1:5004', '--rtcp', '0'], 2, '1 to 65535'),
                                  (['--annexb', '--key-every', '0.1'], 2, '0.5 to 60'),
                                  (['--rtp', '127.0.0.1:5004', '--sdp', '/no/such/folder/a.sdp'], 2, 'cannot be written')):
            got = subprocess.run([GONIO, '--server', self.goniod.url, 'relay', *words], capture_output=True, text=True, timeout=30)
            self.assertEqual(got.returncode, code, got.stderr)
            self.assertIn(said, got.stderr)
        gone = subprocess.run([GONIO, '--server', '127.0.0.1:1', 'relay', '--annexb'], capture_output=True, timeout=30)
        self.assertEqual(gone.returncode, 3)
        with open('/dev/full', 'w') as full:
            got = subprocess.run([GONIO, '--server', self.goniod.url, 'relay', '--annexb'], stdout=full, stderr=subprocess.PIPE, timeout=30)
        self.assertEqual(got.returncode, 2)
        self.assertIn(b'Nobody reads', got.stderr)


class Tokens(Relaying):
    def test_a_new_token_is_read_and_a_wrong_one_seldom_shown(self):
        token = self.folder / 'token'
        token.write_text('0123456789abcdef')
        goniod = Goniod(GONIOD, '--renderer', 'null', '--size', '64x64', '--token-file', str(token))
        self.addCleanup(goniod.stop)
        self.relay('--annexb', stdout=subprocess.DEVNULL, before=['--token-file', str(token)], url=goniod.url)
        get = [GONIO, '--server', goniod.url, '--token-file', str(token), 'get', 'scene_rev']
        until(lambda: subprocess.run(get, capture_output=True).returncode == 0, 10, 'it serves')
        time.sleep(1)
        token.write_text('fedcba9876543210')
        goniod.reload()
        until(lambda: 'connected again' in self.said(), 10, 'it shows the new token')
        client = self.folder / 'client-token'  # of the relay and nobody else
        client.write_text('fedcba9876543210')
        self.relay('--annexb', stdout=subprocess.DEVNULL, before=['--token-file', str(client)], url=goniod.url)
        time.sleep(1)
        token.write_text('00112233445566778899')
        goniod.reload()
        until(lambda: 'the token is wrong' in self.said(), 10, 'it says why it is out')
        for _ in range(20):  # s, in which it tried every 8 s at the latest
            self.assertEqual(subprocess.run(get, capture_output=True).returncode, 0, 'its address is not shut out')
            time.sleep(1)


if __name__ == '__main__':
    # The token's test waits for twenty seconds: the others run meanwhile.
    classes = sys.argv[3:] or ['Tokens', 'Relays']
    beside = [subprocess.Popen([sys.executable, *sys.argv[:3], each]) for each in classes[:-1]]
    here = unittest.main(argv=[sys.argv[0], classes[-1]], exit=False).result.wasSuccessful()
    sys.exit(0 if all([process.wait() == 0 for process in beside]) and here else 1)
