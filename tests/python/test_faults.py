"""Stock clients over lines that lose, damage and delay frames."""

import time

import pytest
from pytrinamic.connections import ConnectionManager
from pytrinamic.tmcl import TMCLReplyChecksumError

USER_VARIABLES = 2
TIMEOUT_SECONDS = 0.1
BYTE_TIMEOUT_SECONDS = 0.005
REQUESTS = 500


class PatientClient:
    """Asks as a program in a laboratory does: when the line spoils a reply, it begins anew."""

    def __init__(self, server, line):
        if line == "pty":
            port = f"--interface serial_tmcl --port {server.pty}"
        else:
            port = "--interface socket_serial_tmcl --port {}:{}".format(*server.tcp)
        self.manager = ConnectionManager(f"{port} --timeout {TIMEOUT_SECONDS}")
        self.line = line
        self.connection = self.connect()
        self.problems = []

    def connect(self):
        connection = self.manager.connect()
        if self.line == "tcp":
            # PyTrinamic gives its socket no time limit, and would wait for a lost reply for ever.
            connection._socket.settimeout(TIMEOUT_SECONDS)
        return connection

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.close()

    def ask(self, value):
        """A setting that is made and read back; None when the line has spoilt a reply."""
        try:
            self.connection.set_global_parameter(0, USER_VARIABLES, value)
            return self.connection.get_global_parameter(0, USER_VARIABLES)
        except (RuntimeError, OSError, TMCLReplyChecksumError) as problem:
            self.problems.append(problem)
            self.connection.close()
            time.sleep(4 * BYTE_TIMEOUT_SECONDS)
            self.connection = self.connect()
            return None


def right_answers(client):
    """How many of the answers came; each of them must be right."""
    answers = [(value, client.ask(value)) for value in range(REQUESTS)]
    came = [(value, answer) for value, answer in answers if answer is not None]
    assert all(value == answer for value, answer in came)
    return len(came)


def test_a_client_goes_on_after_replies_that_were_lost(serve, line):
    # About 1000 replies, of which 20 are lost on average; the standard deviation is
    # sqrt(1000 · 0.02 · 0.98) = 4.4, and this is four of them to each side.
    server = serve("--faults", "drop=0.02,seed=7")
    with PatientClient(server, line) as client:
        came = right_answers(client)
        assert 2 <= len(client.problems) <= 38
        assert came == REQUESTS - len(client.problems)


def test_a_damaged_reply_is_never_taken_for_a_good_one(serve, line):
    # The checksum finds each change within one byte. About 1000 replies, of which 50 are damaged on
    # average, with a standard deviation of 6.9.
    server = serve("--faults", "corrupt=0.05,seed=3")
    with PatientClient(server, line) as client:
        right_answers(client)
        assert 20 <= len(client.problems) <= 80
        assert all(isinstance(problem, TMCLReplyChecksumError) for problem in client.problems)


def test_the_same_seed_spoils_the_same_replies(serve, line):
    def spoilt():
        with PatientClient(serve("--faults", "drop=0.05,seed=11"), line) as client:
            return [client.ask(value) is None for value in range(100)]

    first = spoilt()
    assert any(first)
    assert spoilt() == first


def test_a_delayed_reply_is_waited_for(serve, line):
    server = serve("--faults", "delay=30ms")
    with PatientClient(server, line) as client:
        start = time.monotonic()
        assert client.ask(4711) == 4711
        # Two replies.
        assert time.monotonic() - start >= 0.06
        assert client.problems == []


def test_a_command_whose_reply_is_lost_has_been_done(serve):
    server = serve("--faults", "pty:drop=1")
    with PatientClient(server, "pty") as deaf, PatientClient(server, "tcp") as other:
        with pytest.raises(RuntimeError):
            deaf.connection.set_global_parameter(0, USER_VARIABLES, 99)
        assert other.connection.get_global_parameter(0, USER_VARIABLES) == 99
