"""A TMCM-1613, for which PyTrinamic has no class, over both lines. The TMCM-1640 has the same parameter numbers, so that
its class drives this module as far as it has them; the values are those of the vendor's examples for it.
"""

import time

import pytest
from pytrinamic.modules import TMCM1640
from pytrinamic.tmcl import TMCLCommand, TMCLReplyStatusError

from conftest import FAST
from server import wait_until

POLES = 8
COUNTS = 3 * POLES

# What both modules have, by the names of the TMCM-1640.
MAX_VELOCITY, ACCELERATION, MAX_CURRENT = 4, 11, 6
REACHED_VELOCITY, HALTED_VELOCITY, REACHED_DISTANCE = 7, 9, 10
RAMP, POLE_NUMBER, HALL_INVERT = 146, 253, 254
TARGET_CURRENT, ACTUAL_CURRENT, FLAGS = 155, 150, 156
SETTINGS = {
    MAX_CURRENT: 2000,
    MAX_VELOCITY: 2048,
    ACCELERATION: 2000,
    REACHED_VELOCITY: 500,
    HALTED_VELOCITY: 5,
    REACHED_DISTANCE: 5,
    RAMP: 1,
    POLE_NUMBER: POLES,
    HALL_INVERT: 0,
    172: 600,
    173: 600,
    234: 800,
    235: 500,
    230: 300,
}

POSITION_END, VELOCITY_MODE, TORQUE_MODE = 1 << 14, 1 << 9, 1 << 11


@pytest.fixture
def connection(serve, line):
    """A connection to a fresh module that runs `FAST` times as fast, set up as in the examples."""
    with serve("--speed", FAST, what="tmcm-1613").connect(line) as connection:
        for number, value in SETTINGS.items():
            connection.set_axis_parameter(number, 0, value)
        yield connection


@pytest.fixture
def motor(connection):
    return TMCM1640(connection).motors[0]


def test_the_module_says_who_it_is(connection):
    assert connection.get_version_string() == "1613V100"
    assert connection.send(TMCLCommand.GET_FIRMWARE_VERSION, 1, 0, 0).value == 1613 << 16 | 1 << 8


def test_numbers_of_the_relative_are_those_of_this_module(motor):
    assert (motor.AP.MaxVelocity, motor.AP.MaxAcceleration, motor.AP.MaxCurrent) == (4, 11, 6)
    assert motor.get_axis_parameter(POLE_NUMBER) == POLES
    for number, value in SETTINGS.items():
        assert motor.get_axis_parameter(number) == value


def test_velocity_mode(motor):
    motor.rotate(1000)
    wait_until(lambda: motor.actual_velocity > 980, 1, "full speed")
    time.sleep(0.1)
    assert motor.actual_velocity == pytest.approx(1000, abs=20)
    assert motor.get_axis_parameter(FLAGS) & VELOCITY_MODE
    motor.rotate(-500)
    wait_until(lambda: motor.actual_velocity < -480, 1, "turning left")
    motor.stop()
    wait_until(lambda: abs(motor.actual_velocity) < 100, 1, "standstill")


def test_hall_position_mode_fifty_turns(motor):
    motor.actual_position = 0
    for target in (50 * COUNTS, 0):
        motor.move_to(target)
        assert not motor.get_axis_parameter(FLAGS) & POSITION_END
        wait_until(lambda: motor.get_axis_parameter(FLAGS) & POSITION_END, 2, "arrival")
        time.sleep(0.1)
        assert motor.actual_position == pytest.approx(target, abs=2)


def test_current_mode(motor):
    motor.set_axis_parameter(TARGET_CURRENT, -500)
    wait_until(lambda: motor.actual_velocity < -200, 1, "the motor turns left")
    assert motor.get_axis_parameter(FLAGS) & TORQUE_MODE
    assert motor.get_axis_parameter(ACTUAL_CURRENT, signed=True) < -300
    motor.set_axis_parameter(TARGET_CURRENT, 0)


def test_what_can_only_be_read_is_not_written(motor):
    with pytest.raises(TMCLReplyStatusError):
        motor.set_axis_parameter(FLAGS, 0)
    with pytest.raises(TMCLReplyStatusError):
        motor.set_axis_parameter(MAX_CURRENT, 30_001)


def test_a_module_without_replies_obeys(motor, connection):
    connection.send(TMCLCommand.SGP, 255, 0, 1, no_reply=True)
    connection.send(TMCLCommand.ROR, 0, 0, 700, no_reply=True)
    connection.set_global_parameter(255, 0, 0)
    wait_until(lambda: motor.actual_velocity > 680, 1, "full speed")


def test_mixed_mode_obeys_and_is_silent(motor, connection):
    connection.send(TMCLCommand.SGP, 78, 0, 3, no_reply=True)
    connection.send(TMCLCommand.SIO, 0, 2, 1, no_reply=True)
    connection.set_global_parameter(78, 0, 0)
    assert connection.get_digital_output(0) == 1
