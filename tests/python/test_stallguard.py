"""StallGuard2 tuned as one does it at a bench: reading parameter 206 under a load."""

import builtins
import time

import pytest

from server import wait_until

AXIS = 2
SPEED = 20

# Two turns a second.
PPS = 2 * 51200

# The motor gives 1.01 Nm with both phases at 2.8 A RMS: 0.255 Nm for each ampere of amplitude. At the
# full current of the module, 2.8 A, it is pulled out by 0.71 Nm.
PULL_OUT_NM = 1.01 / (2**0.5 * 2.8) * 2.8


@pytest.fixture
def stand(bench):
    """The motor turns to the right without load."""
    stand = bench("bench.toml", SPEED)
    stand.set(AXIS, {6: 255, 5: 500_000})
    stand.connection.rotate(AXIS, PPS)
    motor = stand.module.motors[AXIS]
    wait_until(lambda: motor.actual_velocity == PPS, 2, "full speed")
    return stand


def put_load(stand, part):
    """Brakes with this part of the torque of pull-out; a positive torque would help."""
    stand.world.do(f"load axis {AXIS} {-part * PULL_OUT_NM:.6f} Nm")
    # A few full steps later a reading has the new load in it: 400 of them pass in a second.
    time.sleep(0.1 / SPEED + 0.02)


def reading(stand):
    return stand.module.motors[AXIS].stallguard2.load_value


def test_the_reading_falls_in_a_straight_line_with_the_load(stand):
    readings = {}
    for percent in (0, 25, 50, 75, 95):
        put_load(stand, percent / 100)
        readings[percent] = reading(stand)
    free = readings[0]
    assert free > 100
    for percent, value in readings.items():
        assert value == pytest.approx(free * (100 - percent) / 100, abs=0.05 * free)


def test_a_person_finds_the_threshold_at_which_an_overload_stops_the_motor(stand):
    motor = stand.module.motors[AXIS]
    # At 60 % of what the motor can do, it shall stop: with this load, lower the threshold until 206 is 0.
    put_load(stand, 0.6)
    threshold = 0
    while reading(stand) > 0:
        threshold -= 1
        assert threshold >= -64
        motor.stallguard2.threshold = threshold
        time.sleep(0.1 / SPEED + 0.02)
    assert threshold < 0
    # With less there is a reading, and the motor runs.
    put_load(stand, 0.4)
    assert reading(stand) > 0
    motor.stallguard2.stop_velocity = PPS // 2
    time.sleep(0.1)
    assert motor.actual_velocity == PPS
    assert motor.get_axis_parameter(207) == 0
    # With a little more than 60 % it stops, without having lost a step.
    put_load(stand, 0.65)
    wait_until(lambda: motor.actual_velocity == 0, 1, "stopped by a stall")
    # Bit 0 is the stop by stall; reading clears it.
    assert motor.get_axis_parameter(207) == 1
    assert motor.get_axis_parameter(207) == 0
    assert stand.world.axis(AXIS)["lost_steps"] == 0


def test_the_calibration_of_pytrinamic_finds_a_threshold(stand, monkeypatch):
    # It asks the user for a load at which the motor shall stop, and raises the threshold from 0 until
    # the reading is not 0. Below the load of pull-out that is so at 0.
    monkeypatch.setattr(builtins, "input", lambda prompt="": None)
    monkeypatch.setattr(time, "sleep", lambda seconds, sleep=time.sleep: sleep(seconds / SPEED))
    put_load(stand, 0.9)
    guard = stand.module.motors[AXIS].stallguard2
    guard.calibrate_zero(threshold=PPS // 2)
    assert guard.threshold == 0
    assert guard.load_value > 0
    assert guard.stop_velocity == pytest.approx(PPS // 2, abs=1)


def test_a_blocked_motor_stops_where_stop_on_stall_is_on(stand):
    motor = stand.module.motors[AXIS]
    motor.stallguard2.stop_velocity = PPS // 2
    stand.world.do(f"block axis {AXIS}")
    wait_until(lambda: motor.actual_velocity == 0, 1, "stopped by a stall")
    assert motor.get_axis_parameter(207) == 1
    # The counter stands where the stall was seen, at most some full steps ahead of the rotor.
    axis = stand.world.axis(AXIS)
    assert 0 <= axis["counter"] - axis["rotor"] <= 8 * 256


def test_a_blocked_motor_loses_its_steps_where_nothing_watches(stand):
    motor = stand.module.motors[AXIS]
    stand.world.do(f"block axis {AXIS}")
    wait_until(lambda: stand.world.axis(AXIS)["lost_steps"] != 0, 1, "steps are lost")
    assert motor.actual_velocity == PPS
    assert motor.get_axis_parameter(207) == 0
    # The field goes round and finds the rotor once in each period: the reading comes and goes.
    wait_until(lambda: reading(stand) == 0, 1, "a reading of a stall")
    rotor = stand.world.axis(AXIS)["rotor"]
    time.sleep(0.05)
    # Blocked it stays, while the counter goes on; what it has lost are whole periods of four full steps.
    motor.stop()
    wait_until(lambda: motor.actual_velocity == 0, 1, "standstill")
    stand.world.do(f"unblock axis {AXIS}")
    time.sleep(0.05)
    axis = stand.world.axis(AXIS)
    assert axis["rotor"] == pytest.approx(rotor, abs=2 * 256)
    assert axis["counter"] - axis["rotor"] == pytest.approx(axis["lost_steps"] * 256, abs=1)
    assert axis["lost_steps"] % 4 == 0


def test_a_broken_coil_and_heat_are_in_the_flags_of_the_driver(stand):
    flags = lambda: stand.get(208, AXIS)  # noqa: E731
    # Table of parameter 208: bit 1 overtemperature, 2 its warning, 5 and 6 open load of A and B.
    assert flags() & 0b0111_1110 == 0
    stand.world.do(f"temperature driver 130 axis {AXIS}")
    assert flags() & 0b110 == 0b100
    stand.world.do(f"temperature driver 25 axis {AXIS}", f"disconnect coil B axis {AXIS}")
    time.sleep(0.05)
    assert flags() & 0b0110_0000 == 0b0100_0000
