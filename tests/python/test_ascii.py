"""The text interface of the TMCM-6110, typed by hand in a terminal on its serial port."""

import os
import selectors
import termios
import time
import tty

import pyte
import pytest
from pytrinamic.modules import TMCM6110

COLUMNS, LINES = 60, 12
QUIET_SECONDS = 0.05
REPLY_SECONDS = 2

ENTER_TEXT = bytes([1, 139, 0, 0, 0, 0, 0, 0, 140])
GET_SPEED_LIMIT = bytes([1, 6, 4, 0, 0, 0, 0, 0, 11])


class Terminal:
    """A terminal program: keys go to the port as they are pressed, the screen shows what comes back."""

    def __init__(self, path):
        self.port = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.port)
        termios.tcflush(self.port, termios.TCIOFLUSH)
        self.screen = pyte.Screen(COLUMNS, LINES)
        # A carriage return begins a new line, as people set their terminals for such modules.
        self.screen.set_mode(pyte.modes.LNM)
        self.stream = pyte.ByteStream(self.screen)
        self.selector = selectors.DefaultSelector()
        self.selector.register(self.port, selectors.EVENT_READ)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.selector.close()
        os.close(self.port)

    def read(self):
        """What comes until it is quiet."""
        received = b""
        deadline = time.monotonic() + REPLY_SECONDS
        while self.selector.select(QUIET_SECONDS if received else REPLY_SECONDS):
            received += os.read(self.port, 1000)
            assert time.monotonic() < deadline, "it does not stop to send"
        return received

    def press(self, keys):
        """Presses keys one by one and shows what comes back on the screen."""
        for key in keys.encode():
            os.write(self.port, bytes([key]))
            time.sleep(0.001)
        self.stream.feed(self.read().replace(b"\r", b"\r\n"))

    def line(self, text):
        """Types a line and returns what stands on the screen then, without the lines before."""
        self.screen.reset()
        self.press(text + "\r")
        return [line.rstrip() for line in self.screen.display if line.strip()]

    def exchange(self, frame):
        """A frame and what is answered."""
        os.write(self.port, frame)
        return self.read()


@pytest.fixture
def terminal(serve):
    """A terminal on a module that has just been told to take text."""
    with Terminal(serve(what="tmcm-6110").pty) as terminal:
        assert terminal.exchange(ENTER_TEXT)[2:4] == bytes([100, 139])
        yield terminal


def test_a_line_is_echoed_and_answered_with_status_and_value(terminal):
    assert terminal.line("AGAP 4, 0") == ["AGAP 4, 0", "BA 100 1000"]
    assert terminal.line("A SAP 4, 0, 500") == ["A SAP 4, 0, 500", "BA 100 500"]
    assert terminal.line("agap 4,0") == ["agap 4,0", "BA 100 500"]
    assert terminal.line("AMVP ABS, 1, -5000") == ["AMVP ABS, 1, -5000", "BA 100 -5000"]


def test_backspace_takes_back_what_was_typed_on_the_screen_as_well(terminal):
    assert terminal.line("ASAP 4, 0, 12\b\b77") == ["ASAP 4, 0, 77", "BA 100 77"]
    assert terminal.line("AGAP 9\x7f4, 0") == ["AGAP 4, 0", "BA 100 77"]


@pytest.mark.parametrize(
    ("line", "status"),
    [("A FOO 1", 2), ("A", 2), ("AGAP", 4), ("AGAP 4, 9", 4), ("ASAP 4, 0, 9999", 4), ("AGAP 99, 0", 3),
     ("AJA 0", 2), ("A" + "X" * 50, 2)],
)
def test_what_means_nothing_is_answered_with_a_status_and_never_with_silence(terminal, line, status):
    echo, answer = terminal.line(line)
    assert (echo, answer.split()[:2]) == (line, ["BA", str(status)])


def test_a_line_for_another_module_is_not_for_this_one(terminal):
    os.write(terminal.port, b"CGAP 4, 0\r")
    assert terminal.line("AGAP 4, 0") == ["AGAP 4, 0", "BA 100 1000"]


def test_a_program_runs_and_stops_by_text(serve):
    server = serve(what="tmcm-6110")
    with server.connect() as connection:
        # SGP 10, 2, 7 in a loop.
        for command in [(132, 0, 0, 0), (9, 10, 2, 7), (22, 0, 0, 0), (133, 0, 0, 0)]:
            connection.send(*command)
    with Terminal(server.pty) as terminal:
        terminal.exchange(ENTER_TEXT)
        assert terminal.line("ARUN")[1] == "BA 100 0"
        assert terminal.line("AGGP 10, 2")[1] == "BA 100 7"
        assert terminal.line("AGGP 128, 0")[1] == "BA 100 1"
        assert terminal.line("ASTOP")[1] == "BA 100 0"
        assert terminal.line("AGGP 128, 0")[1] == "BA 100 0"


def test_bin_brings_back_frames(terminal):
    terminal.line("ASAP 4, 0, 77")
    assert terminal.line("ABIN") == ["ABIN", "BA 100 0"]
    assert terminal.exchange(GET_SPEED_LIMIT) == bytes([2, 1, 100, 6, 0, 0, 0, 77, 186])


@pytest.mark.parametrize(
    ("mode", "expected"),
    [(0x01, ["AGAP 4, 0", "BA 100 1000"]), (0x11, ["AGAP 4, 0", "BA 100 1000"]), (0x21, ["BA 100 1000"])],
)
def test_global_parameter_67_chooses_the_start_and_the_echo(serve, mode, expected):
    server = serve(what="tmcm-6110")
    with server.connect() as connection:
        module = TMCM6110(connection)
        module.set_global_parameter(67, 0, mode)
        # A software reset: the module starts again, now with text.
        connection.send(255, 0, 0, 1234)
    with Terminal(server.pty) as terminal:
        assert terminal.line("AGAP 4, 0") == expected
        if mode == 0x11:
            # The whole line at once: nothing comes before its end.
            os.write(terminal.port, b"AGAP")
            assert not terminal.selector.select(0.2)
