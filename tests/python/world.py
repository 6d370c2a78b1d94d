"""The world around served modules, spoken to with nothing but a socket and JSON."""

import json
import socket

REPLY_SECONDS = 5


class World:
    """A client of the socket that `tmcl serve` announces."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(REPLY_SECONDS)
        self.socket.connect(path)
        self.lines = self.socket.makefile("rb")
        self.changes = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.lines.close()
        self.socket.close()

    def receive(self):
        """The next line."""
        line = self.lines.readline()
        if not line:
            raise EOFError("the server has closed the connection")
        return json.loads(line)

    def ask(self, line):
        """Sends a line and returns its answer; changes that come before it are kept."""
        self.socket.sendall(line.encode() + b"\n")
        while True:
            answer = self.receive()
            if "ok" in answer:
                return answer
            self.changes.append(answer)

    def do(self, *actions):
        """Does something, which must succeed."""
        for action in actions:
            answer = self.ask(action)
            assert answer == {"ok": True}, f"{action}: {answer}"

    def state(self):
        """All there is to see of the only module."""
        (module,) = self.ask("state")["state"]["modules"].values()
        return module

    def axis(self, number):
        """All there is to see of an axis of the only module."""
        return self.state()["axes"][str(number)]
