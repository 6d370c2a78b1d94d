"""A virtual module in a process of its own, and PyTrinamic's connections to it."""

import json
import os
import selectors
import signal
import subprocess
import time
from pathlib import Path

from pytrinamic.connections import ConnectionManager

ROOT = Path(__file__).resolve().parents[2]
STARTUP_SECONDS = 10
SHUTDOWN_SECONDS = 5


def program():
    """The program `tmcl`: where the environment says, otherwise the development build."""
    return ROOT / os.environ.get("TMCL", "target/debug/tmcl")


class Server:
    """`tmcl serve` with further options: a bare TMCM-6214, or a scenario with its machines."""

    def __init__(self, *options, what="tmcm-6214"):
        command = [str(program()), "serve", str(what), "--json", *map(str, options)]
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE
        )
        self.endpoints = self._announced_endpoints()

    def _announced_endpoints(self):
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            if not selector.select(STARTUP_SECONDS):
                self.process.kill()
                raise TimeoutError(f"no endpoints printed within {STARTUP_SECONDS} s")
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"the server ended with status {self.process.wait()}")
        endpoints = json.loads(line)
        # A scenario has a list of modules; the tests talk to the first one.
        return {**endpoints, **endpoints.get("modules", [{}])[0]}

    @property
    def pty(self):
        """Path of the serial port."""
        return self.endpoints["pty"]

    @property
    def tcp(self):
        """Host and port."""
        host, port = self.endpoints["tcp"].rsplit(":", 1)
        return host, int(port)

    @property
    def world(self):
        """Path of the socket on which the world around the modules is served."""
        return self.endpoints["world"]

    def connect(self, line="pty"):
        """Connects as a user of PyTrinamic does."""
        if line == "pty":
            interface, port = "serial_tmcl", self.pty
        else:
            interface, port = "socket_serial_tmcl", "{}:{}".format(*self.tcp)
        return ConnectionManager(f"--interface {interface} --port {port}").connect()

    def stop(self, how=signal.SIGTERM):
        """Ends the server and returns its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(how)
        try:
            return self.process.wait(SHUTDOWN_SECONDS)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        finally:
            self.process.stdout.close()


def wait_until(condition, seconds, what):
    """Polls until the condition holds; returns how long that took in seconds."""
    start = time.monotonic()
    while not condition():
        if time.monotonic() - start > seconds:
            raise AssertionError(f"not within {seconds} s: {what}")
        time.sleep(0.001)
    return time.monotonic() - start
