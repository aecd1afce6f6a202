#!/usr/bin/python3
"""The recipes of docs/relay.md, with the programs they name: ffmpeg, GStreamer's RTSP server, Janus and Chromium.

    relay_media_test.py GONIOD GONIO [TEST…]

All is on 127.0.0.1, and what is started is ended. Figures are printed and judged by nobody.
"""
import http.server
import json
import os
import pathlib
import re
import select
import shutil
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from goniod import Goniod, Mover, free_port  # noqa: E402

GONIOD, GONIO = (str(pathlib.Path(program).resolve()) for program in sys.argv[1:3])
HERE = pathlib.Path(__file__).parent
PAGE = (HERE.parents[1] / 'docs/relay.md').read_text()
CHROMIUM = shutil.which('chromium')
SIZE = 640, 480
STAP_A = 24  # parameter sets in RTP: a key frame begins
SECONDS = 10  # that receivers watch


def section(heading):
    """The code blocks under a heading of the page."""
    (text,) = re.findall(rf'^### {re.escape(heading)}\n(.*?)(?=^##)', PAGE, re.M | re.S)
    return [block for _, block in re.findall(r'^```(\w*)\n(.*?)^```$', text, re.M | re.S)]


def shift_of_ports():
    """What is added to the page's ports so that all are free; those that follow one another still do."""
    ports = {int(port) + more for port in re.findall(r'\b18\d{3}\b', PAGE) for more in (0, 1)}
    for shift in range(0, 5000, 100):
        try:
            for port in ports:
                for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
                    with socket.socket(socket.AF_INET, kind) as free:
                        free.bind(('127.0.0.1', port + shift))
            return shift
        except OSError:
            continue
    raise AssertionError('no free ports')


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(len(values) * share))] if values else float('nan')


class LossyLine:
    """Passes RTP and RTCP on, RTCP both ways, and loses five packets in a row every two seconds."""

    def __init__(self, port, to):
        self.keys, self.losses = [], []  # when the first packet of a key frame came, when packets were lost
        self.over = threading.Event()
        self.sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(4)]
        for i, (near, far) in enumerate(zip(self.sockets[:2], self.sockets[2:])):
            near.bind(('127.0.0.1', port + i))
            far.bind(('127.0.0.1', 0))
        self.to = to
        self.thread = threading.Thread(target=self.carry)
        self.thread.start()

    def carry(self):
        rtp, rtcp, to_rtp, to_rtcp = self.sockets
        sender, losing = None, 0
        while not self.over.is_set():
            for one in select.select(self.sockets, [], [], 0.1)[0]:
                datagram, origin = one.recvfrom(2000)
                if one is rtcp:
                    sender = origin
                    to_rtcp.sendto(datagram, ('127.0.0.1', self.to + 1))
                elif one is to_rtcp and sender:
                    rtcp.sendto(datagram, sender)
                elif one is rtp:
                    if datagram[12] & 31 == STAP_A:
                        self.keys.append(time.monotonic())
                    elif not losing and self.keys and time.monotonic() - max(self.keys + self.losses) > 2:
                        self.losses.append(time.monotonic())
                        losing = 5
                    if losing:
                        losing -= 1
                    else:
                        to_rtp.sendto(datagram, ('127.0.0.1', self.to))

    def stop(self):
        self.over.set()
        self.thread.join()
        for one in self.sockets:
            one.close()


class Recipes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        osc = cls.osc = free_port(socket.SOCK_DGRAM)
        cls.goniod = Goniod(GONIOD, '--scene', 'cornell', '--size', '{}x{}'.format(*SIZE), '--target-fps', '30', '--osc', f'127.0.0.1:{osc}')
        cls.addClassCleanup(cls.goniod.stop)
        cls.mover = Mover(osc)
        cls.addClassCleanup(lambda: cls.mover.stop())
        cls.shift = shift_of_ports()

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def here(self, text):
        return re.sub(r'\b18\d{3}\b', lambda port: str(int(port[0]) + self.shift), text)

    def run_block(self, text, **given):
        """In a session of its own, all of which ends with the test; result: the shell."""
        log = open(self.folder / 'log', 'a')
        self.addCleanup(log.close)
        shell = subprocess.Popen(['bash', '-c', self.here(text)], cwd=self.folder, stdout=log, stderr=log, start_new_session=True,
                                 env={**os.environ, 'GONIO_SERVER': self.goniod.url, 'PATH': f'{pathlib.Path(GONIO).parent}:/usr/bin:/bin:/usr/sbin'})
        self.addCleanup(self.end, shell)
        return shell

    @staticmethod
    def end(shell):
        for how in (signal.SIGINT, signal.SIGKILL):
            try:
                os.killpg(shell.pid, how)
            except ProcessLookupError:
                break
            time.sleep(0.5)
        shell.wait()

    def until(self, true, seconds, what):
        end = time.monotonic() + seconds
        while not true():
            if time.monotonic() > end:
                self.fail(f'not within {seconds} s: {what}\n{self.log()}')
            time.sleep(0.05)

    def log(self):
        return (self.folder / 'log').read_text()[-4000:]

    def decoded(self, *source, seconds=6):
        """Decodes what comes for some seconds. Result: frames, and s to the first."""
        began = time.monotonic()
        decoder = subprocess.Popen(['ffmpeg', '-hide_banner', '-nostdin', '-v', 'error', *source, '-t', str(seconds), '-f', 'framecrc', '-'],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: decoder.poll() is None and decoder.kill())
        first = None
        lines = []
        for line in decoder.stdout:
            if line.startswith('#'):
                lines.append(line)
                continue
            first = first or time.monotonic() - began
            lines.append(line)
        faults = decoder.stderr.read()
        decoder.communicate(timeout=60)
        self.assertIn('#dimensions 0: {}x{}\n'.format(*SIZE), lines, faults + self.log())
        return sum(not line.startswith('#') for line in lines), first, faults

    def checked(self, name, got, fewest):
        frames, first, faults = got
        print(f'{name}: {frames} frames decoded, the first after {first:.1f} s', flush=True)
        self.assertGreaterEqual(frames, fewest, self.log())
        self.assertEqual(faults, '')

    def probe(self, *source):
        got = subprocess.run(['ffprobe', '-v', 'error', '-show_entries', 'stream=codec_name,profile,width,height', '-of', 'json', *source],
                             cwd=self.folder, capture_output=True, text=True, timeout=60)
        self.assertEqual(json.loads(got.stdout)['streams'],
                         [{'codec_name': 'h264', 'profile': 'Constrained Baseline', 'width': SIZE[0], 'height': SIZE[1]}], got.stderr)

    def test_ffmpeg_opens_the_sdp(self):
        self.run_block(section('ffmpeg: the SDP, HLS, SRT, RTSP')[0])
        self.until((self.folder / 'gonio.sdp').exists, 20, 'an SDP')
        self.checked('RTP by its SDP', self.decoded('-protocol_whitelist', 'file,rtp,udp', '-i', 'gonio.sdp'), 30)
        self.probe('-protocol_whitelist', 'file,rtp,udp', 'gonio.sdp')

    def test_hls(self):
        self.run_block(section('ffmpeg: the SDP, HLS, SRT, RTSP')[1])
        playlist = self.folder / 'hls/gonio.m3u8'
        self.until(lambda: playlist.exists() and playlist.read_text().count('.ts') >= 2, 60, 'two segments')
        self.checked('HLS', self.decoded('-i', 'hls/gonio.m3u8'), 30)
        self.probe('hls/gonio.m3u8')

    def test_srt(self):
        self.run_block(section('ffmpeg: the SDP, HLS, SRT, RTSP')[2])
        time.sleep(3)
        self.checked('SRT', self.decoded('-i', self.here('srt://127.0.0.1:18034')), 30)

    def test_a_push_by_rtsp(self):
        server = subprocess.Popen(['ffmpeg', '-v', 'error', '-nostdin', '-rtsp_flags', 'listen', '-i', self.here('rtsp://127.0.0.1:18044/gonio'),
                                   '-c', 'copy', '-t', '5', 'pushed.mkv'], cwd=self.folder)
        self.addCleanup(lambda: server.poll() is None and server.kill())
        time.sleep(1)
        self.run_block(section('ffmpeg: the SDP, HLS, SRT, RTSP')[3])
        self.assertEqual(server.wait(60), 0)
        self.checked('pushed by RTSP', self.decoded('-i', 'pushed.mkv'), 30)

    def test_gstreamer_serves_rtsp(self):
        program, commands = section('GStreamer: RTSP')
        (self.folder / 'rtsp_server.py').write_text(self.here(program))
        self.run_block(commands.replace('python3 ', '/usr/bin/python3 '))
        self.until((self.folder / 'rtsp.sdp').exists, 20, 'an SDP')
        url = self.here('rtsp://127.0.0.1:18554/gonio')

        def listens():
            with socket.socket() as client:
                return client.connect_ex(('127.0.0.1', int(self.here('18554')))) == 0
        self.until(listens, 30, 'an RTSP server')
        for transport in ('tcp', 'udp'):
            began = time.monotonic()
            self.probe('-rtsp_transport', transport, url)
            print(f'RTSP of GStreamer, {transport}: ffprobe knows it after {time.monotonic() - began:.1f} s', flush=True)
        self.checked('RTSP of GStreamer', self.decoded('-rtsp_transport', 'tcp', '-i', url), 30)

    def test_a_server_that_hangs_is_left_and_found_again(self):
        self.run_block('gonio relay --rtp 127.0.0.1:18064 --sdp hung.sdp')
        self.until((self.folder / 'hung.sdp').exists, 20, 'an SDP')
        self.addCleanup(self.goniod.process.send_signal, signal.SIGCONT)
        time.sleep(1)
        self.goniod.process.send_signal(signal.SIGSTOP)
        self.until(lambda: 'makes no key frame' in self.log(), 30, 'it is left')
        self.goniod.process.send_signal(signal.SIGCONT)
        self.until(lambda: 'connected again' in self.log(), 30, 'it is found again')

    # -------------------------------------------------------------------------------------------------------- Janus
    def stats(self):
        got = subprocess.run([GONIO, '--server', self.goniod.url, '--json', 'stats'], capture_output=True, text=True, check=True, timeout=30)
        return json.loads(got.stdout)

    def browse(self, receivers, more=''):
        """Chromium with so many receivers. Result: what each saw."""
        page = (HERE / 'relay/page.html').read_bytes()
        done = threading.Event()
        answer = []

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                found = self.path.startswith('/?')
                self.send_response(200 if found else 404)
                self.send_header('Content-Type', 'text/html')
                self.end_headers()
                self.wfile.write(page if found else b'')

            def do_POST(self):
                answer.append(json.loads(self.rfile.read(int(self.headers['Content-Length']))))
                self.send_response(204)
                self.end_headers()
                done.set()

            def log_message(self, *_):
                pass

        server = http.server.ThreadingHTTPServer(('127.0.0.1', 0), Handler)
        threading.Thread(target=server.serve_forever).start()
        query = f'janus={self.here("18088")}&receivers={receivers}&seconds={SECONDS}{more}'
        browser = subprocess.Popen(
            [CHROMIUM, '--headless=new', '--no-sandbox', '--disable-gpu', f'--user-data-dir={self.folder}/profile{receivers}{more}',
             '--allow-loopback-in-peer-connection', '--disable-features=WebRtcHideLocalIpsWithMdns', '--autoplay-policy=no-user-gesture-required',
             f'http://127.0.0.1:{server.server_address[1]}/?{query}'],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            self.assertTrue(done.wait(SECONDS + 60), 'the page says nothing\n' + self.log())
        finally:
            self.end(browser)
            server.shutdown()
            server.server_close()
        self.assertIsInstance(answer[0], list, answer[0])
        return answer[0]

    def to_the_canvas(self):
        """From the OSC message that makes the light bright to the picture on the page that shows it."""
        self.mover.stop()
        type(self).mover = Mover(self.osc, steps=True)
        try:
            seen = self.browse(1, '&bright')[0]['bright']
        finally:
            steps = self.mover
            steps.stop()
            type(self).mover = Mover(self.osc)
        seen = [one for one in seen if one[1] > 0]  # an empty canvas is black
        middle = (min(value for _, value in seen) + max(value for _, value in seen)) / 2
        brightened = [after[0] for before, after in zip(seen, seen[1:]) if before[1] < middle <= after[1]]
        took = [min(ms - 1e3 * at for ms in brightened if ms > 1e3 * at) for at in steps.stepped if 1e3 * at < brightened[-1]]
        took = [ms for ms in took if ms < 900]  # before the page was there the first is late
        print(f'from a command to the canvas: {len(took)} times, p50 {quantile(took, 0.5):.0f}, p95 {quantile(took, 0.95):.0f} ms', flush=True)
        self.assertGreaterEqual(len(took), 3, (steps.stepped, seen))

    def start_janus(self, relay=None):
        """With the page's relay, or another. Result: the shell of both."""
        *files, commands = section('Janus: WebRTC for browsers')
        for text in files:
            (self.folder / text.split()[1]).write_text(self.here(text))
        shell = self.run_block(commands if relay is None else commands.splitlines()[0] + '\n' + relay)
        self.until((self.folder / 'janus.sdp').exists, 30, 'an SDP')
        info = self.here('http://127.0.0.1:18088/janus/info')

        def answers():
            try:
                return urllib.request.urlopen(info, timeout=5).status == 200
            except OSError:
                return False
        self.until(answers, 30, 'Janus')
        return shell

    def test_what_is_lost_is_mended_by_pli(self):
        line = LossyLine(int(self.here('18074')), int(self.here('18004')))
        self.addCleanup(line.stop)
        shell = self.start_janus('gonio relay --rtp 127.0.0.1:18074 --key-every 60 --sdp janus.sdp')
        (seen,) = self.browse(1)
        self.end(shell)
        mended = [1e3 * (min(key for key in line.keys if key > at) - at) for at in line.losses if at < line.keys[-1]]
        print(f'{len(line.losses)} losses of 5 packets: a key frame after p50 {quantile(mended, 0.5):.0f}, p95 {quantile(mended, 0.95):.0f} ms; '
              f'{seen.get("pliCount")} PLI of the browser', flush=True)
        self.assertGreaterEqual(len(mended), 2, self.log())
        self.assertGreaterEqual(seen['pliCount'], 2)
        self.assertGreaterEqual(seen['keyFramesDecoded'], 2)

    def test_janus_serves_browsers(self):
        shell = self.start_janus()
        ratios = {}
        for receivers in (1, 10):
            before = self.stats()
            began = time.monotonic()
            seen = self.browse(receivers)
            took = time.monotonic() - began
            after = self.stats()
            frames, packets = (after[name] - before[name] for name in ('frames_encoded', 'packets_sent'))
            ratios[receivers] = packets / frames
            late = [ms for one in seen for ms in one['late_ms']]
            received, lost = (sum(one.get(name, 0) for one in seen) for name in ('packetsReceived', 'packetsLost'))
            after_connected = [one['first_ms'] - one['connected_ms'] for one in seen]
            first = [one['first_ms'] for one in seen if one['first_ms'] is not None]
            buffered = [1e3 * one['jitterBufferDelay'] / one['jitterBufferEmittedCount'] for one in seen if one.get('jitterBufferEmittedCount')]
            print(f'Janus, {receivers} receivers of {SIZE[0]}x{SIZE[1]}: first picture {min(first, default=-1):.0f} to {max(first, default=-1):.0f} ms '
                  f'after watch ({min(after_connected):.0f} to {max(after_connected):.0f} after connecting); receipt to presentation p50 {quantile(late, 0.5):.0f}, '
                  f'p95 {quantile(late, 0.95):.0f} ms; jitter buffer {statistics.mean(buffered):.0f} ms; {received} packets, {lost} lost; '
                  f'{sum(one["frames"] for one in seen) / receivers:.0f} frames each, {sum(one.get("freezeCount", 0) for one in seen)} freezes, '
                  f'{sum(one.get("pliCount", 0) for one in seen)} PLI; goniod sent {packets / took:.1f} packets a second, '
                  f'{frames / took:.1f} frames encoded', flush=True)
            self.assertEqual(len(first), receivers, seen)
            for one in seen:
                self.assertGreater(one['framesDecoded'], SECONDS)
                self.assertEqual((one['frameWidth'], one['frameHeight']), SIZE)
            self.assertLessEqual(lost, received / 100)
            self.assertEqual(after['clients'], 2, 'to goniod all are one viewer; the other one asks for this')
        self.to_the_canvas()
        self.end(shell)
        (counts,) = re.findall(r'^gonio: (pictures .*)', self.log(), re.M)
        print(f'the relay: {counts}', flush=True)
        self.assertIn('packets_unsent 0', counts)
        self.assertNotIn('asked_by_receivers 0', counts, 'Janus asks when one joins')
        # A frame that was encoded is a packet to the relay, however many watch.
        self.assertAlmostEqual(ratios[10], ratios[1], delta=0.02)
        self.assertAlmostEqual(ratios[10], 1, delta=0.02)


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
