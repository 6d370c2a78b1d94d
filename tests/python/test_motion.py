"""Motion as a host program commands and watches it."""

import time

import pytest
from pytrinamic.modules import TMCM6214

from conftest import FAST
from server import wait_until

# Factory defaults of the ramp, in microsteps and seconds.
VMAX = 51200
AMAX = 51107

# 512000 from rest: 1 s with A1 up to V1, 0.5 s with AMAX up to VMAX, 8.75 s at VMAX, and down again.
LONG_MOVE = 512000
LONG_MOVE_SECONDS = 11.75


def test_rotate_reaches_its_speed_within_the_time_of_the_ramp(module):
    motor = module.motors[0]
    start = time.monotonic()
    module.rotate(0, VMAX)
    wait_until(lambda: motor.actual_velocity == VMAX, 3, "actual speed is the target speed")
    ramp = VMAX / AMAX
    assert ramp * 0.98 < time.monotonic() - start < ramp + 0.2
    assert motor.actual_position > VMAX * ramp / 2 * 0.95


def test_rotate_left_turns_backwards(fast_module):
    motor = fast_module.motors[2]
    fast_module.rotate(2, -VMAX)
    wait_until(lambda: motor.actual_velocity == -VMAX, 1, "full speed backwards")
    assert motor.actual_position < 0


def test_stop_brings_the_motor_to_standstill(fast_module):
    motor = fast_module.motors[0]
    fast_module.rotate(0, VMAX)
    wait_until(lambda: motor.actual_velocity == VMAX, 1, "full speed")
    fast_module.stop(0)
    wait_until(lambda: motor.actual_velocity == 0, 1, "standstill")
    position = motor.actual_position
    time.sleep(0.05)
    assert motor.actual_position == position != 0


@pytest.mark.parametrize("line", ["pty"], indirect=True)
def test_a_long_move_takes_its_time_and_ends_on_the_target(module):
    motor = module.motors[0]
    start = time.monotonic()
    module.move_to(0, LONG_MOVE)
    assert motor.get_position_reached() == 0
    positions = []
    while not motor.get_position_reached():
        positions.append(motor.actual_position)
        assert time.monotonic() - start < LONG_MOVE_SECONDS + 2, "the target is never reached"
        time.sleep(0.002)
    assert time.monotonic() - start == pytest.approx(LONG_MOVE_SECONDS, rel=0.01)
    assert motor.actual_position == LONG_MOVE
    assert motor.actual_velocity == 0
    assert positions == sorted(positions)
    assert len(set(positions)) > 1000


def test_a_faster_clock_shortens_the_move(serve):
    speed = 10
    with serve("--speed", speed).connect() as connection:
        motor = TMCM6214(connection).motors[0]
        start = time.monotonic()
        motor.move_to(LONG_MOVE)
        wait_until(motor.get_position_reached, 5, "target reached")
        assert time.monotonic() - start == pytest.approx(LONG_MOVE_SECONDS / speed, rel=0.05)
        assert motor.actual_position == LONG_MOVE


def test_move_by_is_relative_and_answers_with_the_new_target(fast_connection):
    motor = TMCM6214(fast_connection).motors[1]
    assert fast_connection.move_to(1, 10000) == 10000
    wait_until(motor.get_position_reached, 2, "first target reached")
    assert fast_connection.move_by(1, 25000) == 35000
    assert motor.target_position == 35000
    wait_until(motor.get_position_reached, 2, "second target reached")
    motor.move_by(-5000)
    wait_until(motor.get_position_reached, 2, "third target reached")
    assert motor.actual_position == 30000


def test_a_move_may_be_given_its_own_speed(fast_module):
    motor = fast_module.motors[0]
    fast_module.move_to(0, 30000, velocity=20000)
    assert motor.linear_ramp.max_velocity == 20000
    speeds = []
    while not motor.get_position_reached():
        speeds.append(motor.actual_velocity)
    assert max(speeds) == 20000
    assert motor.actual_position == 30000


def test_six_axes_move_at_once(fast_module):
    targets = [40000, -40000, 51200, -1, 12345, 100000]
    for motor, target in zip(fast_module.motors, targets):
        motor.move_to(target)
    moving = [motor.actual_velocity for motor in fast_module.motors]
    assert sum(speed != 0 for speed in moving) >= 4
    seconds = 2 * 100000 / VMAX / FAST + 2
    for motor in fast_module.motors:
        wait_until(motor.get_position_reached, seconds, "target reached")
    assert [motor.actual_position for motor in fast_module.motors] == targets


def test_a_new_target_on_the_fly_turns_the_motor_round(fast_module):
    motor = fast_module.motors[0]
    motor.move_to(1000000)
    wait_until(lambda: motor.actual_velocity == VMAX, 1, "full speed")
    motor.move_to(-20000)
    wait_until(lambda: motor.actual_velocity < 0, 1, "motion backwards")
    wait_until(motor.get_position_reached, 5, "target reached")
    assert motor.actual_position == -20000
