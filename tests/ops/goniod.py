"""goniod as tests of other programs need it: at a port of its own, killed and started again, with a light that moves."""
import math
import signal
import socket
import struct
import subprocess
import threading


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

    def stop(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait()
        self.process.stdout.close()


class Mover:
    """Rides the level of a light by OSC, 40 times a second."""

    def __init__(self, port, light='luminaire'):
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.ride, args=(port, light))
        self.thread.start()

    def ride(self, port, light):
        name = f'/light/{light}/level'.encode()
        name += b'\0' * (4 - len(name) % 4)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as to:
            turn = 0
            while not self.over.wait(1 / 40):
                turn += 1
                to.sendto(name + b',f\0\0' + struct.pack('>f', 0.6 + 0.4 * math.sin(turn / 20)), ('127.0.0.1', port))

    def stop(self):
        self.over.set()
        self.thread.join()
