"""The world around a module, as a program without any library of ours uses it."""

import json
import os
import socket
import stat

import pytest

from server import wait_until

SPEED = 20


@pytest.fixture
def stand(bench):
    return bench("homing.toml", SPEED)


def raw(stand):
    """A second client of the socket."""
    second = socket.socket(socket.AF_UNIX)
    second.settimeout(5)
    second.connect(stand.world.socket.getpeername())
    return second


def test_the_state_has_what_the_scenario_describes(stand):
    state = stand.world.state()
    assert state["model"] == "tmcm-6214"
    assert state["powered"] is True
    assert sorted(state["axes"]) == ["0", "1", "2", "3", "4", "5"]
    assert [number for number, axis in sorted(state["axes"].items()) if axis["machine"]] == ["0", "1", "3"]
    axis = state["axes"]["0"]
    assert (axis["position"], axis["unit"], axis["moving"]) == (20, "mm", False)
    assert axis["switches"] == {"left": False, "right": False, "home": False}


def test_a_switch_pressed_by_hand_is_read_by_the_module(stand):
    assert stand.get(11, 0) == 0
    stand.world.do("press left axis 0")
    assert stand.get(11, 0) == 1
    axis = stand.world.axis(0)
    assert axis["switches"]["left"] is True
    assert axis["held"]["left"] == "pressed"
    stand.world.do("free left axis 0")
    assert stand.get(11, 0) == 0
    assert stand.world.axis(0)["held"]["left"] == "stage"


def test_a_watcher_is_told_what_others_do(stand):
    stand.world.do("watch changes")
    with raw(stand) as other:
        other.sendall(b"press home axis 0\ninput 3 high\nsupply 18 V\n")
        replies = other.makefile("rb")
        assert [json.loads(replies.readline()) for _ in range(3)] == [{"ok": True}] * 3
    seen = {}
    while set(seen) < {"axes", "inputs", "supply"}:
        (module,) = stand.world.receive()["changes"]["modules"].values()
        seen.update(module)
    assert seen["axes"]["0"]["switches"] == {"home": True}
    assert seen["inputs"] == {"3": True}
    assert seen["supply"] == 18
    # The module sees it, too: inputs by GIO, the supply in 0.1 V.
    assert stand.connection.get_digital_input(3) == 1
    assert stand.connection.get_analog_input(8) == 180


def test_a_watcher_sees_an_axis_move(stand):
    stand.world.do("watch 50")
    stand.module.motors[0].move_to(10240)
    positions = []
    while not positions or positions[-1] < 20.999:
        change = stand.world.receive()["changes"]["modules"]
        (module,) = change.values()
        position = module.get("axes", {}).get("0", {}).get("position")
        if position is not None:
            positions.append(position)
    assert len(positions) > 2
    assert positions == sorted(positions)


def test_what_is_wrong_is_told_and_changes_nothing(stand):
    before = stand.world.state()
    for line in ("jump", "press left axis 9", "load axis 0 3 kg", "supply", "press", "", "\u00e4" * 100):
        answer = stand.world.ask(line)
        assert answer["ok"] is False, line
        assert answer["error"], line
    assert stand.world.state() == before


def test_a_client_that_vanishes_harms_nobody(stand):
    second = raw(stand)
    second.sendall(b"watch 50\nload axis 0 0.1")
    second.close()
    stand.module.motors[0].move_to(10240)
    wait_until(stand.module.motors[0].get_position_reached, 3, "target reached")
    assert stand.world.axis(0)["push"] == 0


def test_bytes_that_are_no_text_are_refused(stand):
    with raw(stand) as second:
        second.sendall(b"\xff\xfe\n")
        answer = json.loads(second.makefile("rb").readline())
        assert answer["ok"] is False
    assert stand.world.ask("state")["ok"] is True


def test_power_comes_back_with_the_machine_where_it_was(stand):
    motor = stand.module.motors[0]
    motor.move_to(51200)
    wait_until(motor.get_position_reached, 3, "target reached")
    stand.world.do("power cycle")
    assert motor.actual_position == 0
    assert stand.world.axis(0)["position"] == pytest.approx(25, abs=0.02)


def test_the_socket_is_private_to_its_user(stand):
    assert stat.S_IMODE(os.stat(stand.world.socket.getpeername()).st_mode) == 0o600
