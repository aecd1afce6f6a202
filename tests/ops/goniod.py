"""goniod as tests of other programs need it: at a port of its own, killed and started again, with a light that moves."""
import math
import signal
import socket
import struct
import subprocess
import threading
import time


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as free:
        free.bind(('127.0.0.1', 0))
        return free.getsockname()[1]


class Goniod:
    def __init__(self, program, *options):
        self.command = [program, '--listen', f'127.0.0.1:{free_port()}', *options]
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.url = self.process.stdout.readline().removeprefix('READY ').strip()
        assert self.url, 'goniod does not start'

    def reload(self):
        self.process.send_signal(signal.SIGHUP)

    def stop(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait()
        self.process.stdout.close()


class Mover:
    """Sets the level of a light by OSC: rides it 40 times a second, or steps between dark and bright every 0.9 s."""

    def __init__(self, port, steps=False, light='luminaire'):
        name = f'/light/{light}/level'.encode()
        self.message = name + b'\0' * (4 - len(name) % 4) + b',f\0\0'
        self.to = '127.0.0.1', port
        self.stepped = []  # when it became bright, s since 1970
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.step if steps else self.ride)
        self.thread.start()

    def set(self, level):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(self.message + struct.pack('>f', level), self.to)

    def ride(self):
        turn = 0
        while not self.over.wait(1 / 40):
            turn += 1
            self.set(0.6 + 0.4 * math.sin(turn / 20))

    def step(self):
        while not self.over.wait(0.9):
            self.set(0.02)
            if self.over.wait(0.9):
                break
            self.stepped.append(time.time())
            self.set(1)

    def stop(self):
        self.over.set()
        self.thread.join()
