"""The lines themselves: clients that come, go, vanish and send nonsense."""

import os
import signal
import socket
import subprocess
import time

import pytest
import serial
from pytrinamic.tmcl import TMCLReply, TMCLRequest, TMCLStatus

from server import Server, program

GAP_POSITION = bytes(TMCLRequest(1, 6, 1, 0, 0).to_buffer())
BYTE_TIMEOUT_SECONDS = 0.005
USER_VARIABLES = 2


class RawLine:
    """Bytes in and out, without TMCL."""

    def __init__(self, server, line):
        self.port = (
            serial.Serial(server.pty, timeout=1)
            if line == "pty"
            else serial.serial_for_url("socket://{}:{}".format(*server.tcp), timeout=1)
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.port.close()

    def send(self, data):
        self.port.write(data)

    def reply(self):
        return self.port.read(9)


def pause():
    """A silence after which a receiver has forgotten a frame that had begun."""
    time.sleep(4 * BYTE_TIMEOUT_SECONDS)


def test_clients_come_one_after_the_other_and_find_the_same_module(serve):
    server = serve()
    for client, line in enumerate(["pty", "tcp", "pty", "pty", "tcp"]):
        with server.connect(line) as connection:
            assert connection.get_global_parameter(0, USER_VARIABLES) == 100 * client
            connection.set_global_parameter(0, USER_VARIABLES, 100 * (client + 1))


def test_both_lines_are_served_at_once(serve):
    server = serve()
    with server.connect("pty") as one, server.connect("tcp") as other:
        for value in range(50):
            one.set_global_parameter(0, USER_VARIABLES, value)
            assert other.get_global_parameter(0, USER_VARIABLES) == value


def test_a_client_that_leaves_half_a_frame_does_not_disturb_the_next(serve, line):
    server = serve()
    with RawLine(server, line) as client:
        client.send(GAP_POSITION[:4])
    pause()
    with server.connect(line) as connection:
        assert connection.get_axis_parameter(1, 0) == 0


def test_a_client_that_never_reads_does_not_disturb_the_next(serve, line):
    server = serve()
    with RawLine(server, line) as client:
        client.send(GAP_POSITION * 20)
    pause()
    with server.connect(line) as connection:
        connection.set_global_parameter(0, USER_VARIABLES, 4711)
        assert connection.get_global_parameter(0, USER_VARIABLES) == 4711


def test_frames_in_one_write_are_each_answered(serve, line):
    with RawLine(serve(), line) as client:
        client.send(GAP_POSITION * 3)
        assert [len(client.reply()) for _ in range(3)] == [9, 9, 9]


def test_a_frame_in_pieces_is_answered(serve, line):
    with RawLine(serve(), line) as client:
        client.send(GAP_POSITION[:4])
        client.send(GAP_POSITION[4:])
        assert TMCLReply.from_buffer(client.reply()).status == TMCLStatus.SUCCESS


def test_a_wrong_checksum_is_answered_with_status_one(serve, line):
    damaged = GAP_POSITION[:8] + bytes([GAP_POSITION[8] ^ 1])
    with RawLine(serve(), line) as client:
        client.send(damaged)
        reply = TMCLReply.from_buffer(client.reply())
        assert (reply.status, reply.command, reply.value) == (TMCLStatus.WRONG_CHECKSUM, 0, 0)
        assert reply.is_checksum_correct()
        client.send(GAP_POSITION)
        assert TMCLReply.from_buffer(client.reply()).status == TMCLStatus.SUCCESS


def test_a_lost_byte_costs_one_frame(serve, line):
    with RawLine(serve(), line) as client:
        client.send(GAP_POSITION[1:])
        pause()
        client.send(GAP_POSITION)
        assert TMCLReply.from_buffer(client.reply()).status == TMCLStatus.SUCCESS


def test_another_address_is_answered_on_usb(serve):
    with RawLine(serve(), "pty") as client:
        client.send(bytes(TMCLRequest(7, 6, 1, 0, 0).to_buffer()))
        reply = TMCLReply.from_buffer(client.reply())
        assert (reply.module_address, reply.status) == (1, TMCLStatus.SUCCESS)


def test_another_address_is_not_answered_on_tcp(serve):
    with socket.create_connection(serve().tcp, timeout=0.3) as client:
        client.sendall(TMCLRequest(7, 6, 1, 0, 0).to_buffer())
        with pytest.raises(TimeoutError):
            client.recv(9)
        client.sendall(GAP_POSITION)
        assert len(client.recv(9)) == 9


def test_a_path_for_the_port_leads_to_it_and_is_removed_at_the_end(serve, tmp_path):
    path = tmp_path / "module"
    server = serve("--pty", path)
    with serial.Serial(str(path), timeout=1) as port:
        port.write(GAP_POSITION)
        assert len(port.read(9)) == 9
    assert server.stop() == 0
    assert not os.path.lexists(path)


def test_a_file_in_the_place_of_the_port_is_left_alone(tmp_path):
    path = tmp_path / "notes"
    path.write_text("mine")
    refused = subprocess.run(
        [program(), "serve", "tmcm-6214", "--pty", path],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=5,
    )
    assert refused.returncode == 1
    assert str(path) in refused.stderr
    assert path.read_text() == "mine"


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_server_cleanly_while_a_client_is_connected(how):
    server = Server()
    with server.connect("pty"), server.connect("tcp"):
        assert server.stop(how) == 0
