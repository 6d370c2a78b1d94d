"""A TMCM-6110 as PyTrinamic's own class for it drives it, over both lines."""

import time

import pytest
from pytrinamic.modules import TMCM6110

from conftest import FAST
from server import wait_until

START, STOP, STATUS = 0, 1, 2

# With these divisors a speed v is v * 244.140625 / 2^3 microsteps a second, and 1000 is reached after
# 256 * 1000 / 100 ramp ticks of 2^7 / 500000 s.
PULSE_DIVISOR, RAMP_DIVISOR, ACCELERATION, VELOCITY = 3, 7, 100, 1000
MICROSTEPS_PER_SECOND = VELOCITY * 244.140625 / 2**PULSE_DIVISOR
RAMP_SECONDS = 256 * VELOCITY / ACCELERATION * 2**RAMP_DIVISOR / 500_000


def tuned(connection):
    """The module with ramps that one can follow; the divisors come before speed and acceleration."""
    module = TMCM6110(connection)
    for motor in module.motors:
        motor.set_axis_parameter(motor.AP.PulseDivisor, PULSE_DIVISOR)
        motor.set_axis_parameter(motor.AP.RampDivisor, RAMP_DIVISOR)
        motor.linear_ramp.max_velocity = VELOCITY
        motor.linear_ramp.max_acceleration = ACCELERATION
    return module


@pytest.fixture
def module(serve, line):
    """A fresh module in real time."""
    with serve(what="tmcm-6110").connect(line) as connection:
        yield tuned(connection)


@pytest.fixture
def fast_module(serve, line):
    """A fresh module that runs `FAST` times as fast."""
    with serve("--speed", FAST, what="tmcm-6110").connect(line) as connection:
        yield tuned(connection)


def test_the_module_says_who_it_is(module):
    assert "6110" in module.connection.get_version_string()
    assert module.connection.get_version_string() == "6110V131"


def test_the_settings_of_a_drive_read_back(fast_module):
    motor = fast_module.motors[4]
    motor.drive_settings.max_current = 100
    motor.drive_settings.standby_current = 16
    motor.drive_settings.boost_current = 0
    motor.drive_settings.microstep_resolution = motor.ENUM.microstep_resolution_16_microsteps
    assert motor.drive_settings.max_current == 100
    assert motor.drive_settings.standby_current == 16
    assert motor.drive_settings.microstep_resolution == 4
    assert motor.linear_ramp.max_velocity == VELOCITY
    assert motor.linear_ramp.max_acceleration == ACCELERATION
    motor.stallguard2.set_threshold(-3)
    assert motor.stallguard2.get_threshold() == -3
    motor.coolstep.set_threshold_speed(200)
    assert motor.coolstep.get_threshold_speed() == 200


def test_rotate_reaches_its_speed_within_the_time_of_the_ramp(module):
    motor = module.motors[0]
    start = time.monotonic()
    module.rotate(0, VELOCITY)
    wait_until(lambda: motor.actual_velocity == VELOCITY, 3, "full speed")
    assert RAMP_SECONDS * 0.98 < time.monotonic() - start < RAMP_SECONDS + 0.2
    module.stop(0)
    wait_until(lambda: motor.actual_velocity == 0, 3, "standstill")
    position = motor.actual_position
    assert position > MICROSTEPS_PER_SECOND * RAMP_SECONDS * 0.95
    time.sleep(0.05)
    assert motor.actual_position == position


def test_a_move_takes_its_time_and_ends_on_the_target(module):
    motor = module.motors[3]
    start = time.monotonic()
    module.move_to(3, 50_000)
    assert motor.get_position_reached() == 0
    wait_until(motor.get_position_reached, 5, "the target is reached")
    seconds = 50_000 / MICROSTEPS_PER_SECOND + RAMP_SECONDS
    assert time.monotonic() - start == pytest.approx(seconds, abs=0.1)
    assert motor.actual_position == 50_000


def test_six_axes_move_at_once(fast_module):
    for axis in range(6):
        fast_module.move_to(axis, 10_000 * (axis - 3))
    for axis, motor in enumerate(fast_module.motors):
        wait_until(motor.get_position_reached, 3, f"axis {axis} has arrived")
        assert motor.actual_position == 10_000 * (axis - 3)


def test_a_move_by_a_distance_counts_from_where_the_axis_is(fast_module):
    motor = fast_module.motors[1]
    fast_module.rotate(1, VELOCITY)
    time.sleep(0.1)
    fast_module.stop(1)
    wait_until(lambda: motor.actual_velocity == 0, 2, "standstill")
    position = motor.actual_position
    assert position != 0
    fast_module.move_by(1, -500)
    wait_until(motor.get_position_reached, 2, "arrival")
    assert motor.actual_position == position - 500


def test_settings_survive_the_power_if_they_are_stored(serve, tmp_path):
    eeprom = tmp_path / "6110.eeprom"
    server = serve("--eeprom", eeprom, what="tmcm-6110")
    with server.connect() as connection:
        motor = TMCM6110(connection).motors[2]
        motor.linear_ramp.max_velocity = 321
        connection.store_axis_parameter(motor.AP.MaxVelocity, 2)
        motor.linear_ramp.max_acceleration = 123
    assert server.stop() == 0
    with serve("--eeprom", eeprom, what="tmcm-6110").connect() as connection:
        motor = TMCM6110(connection).motors[2]
        assert motor.linear_ramp.max_velocity == 321
        assert motor.linear_ramp.max_acceleration != 123


def test_a_reference_search_finds_the_edge_of_the_left_switch(bench):
    stand = bench("tmcm-6110.toml")
    module = tuned(stand.connection)
    motor = module.motors[0]
    for parameter, value in ((193, 1), (194, VELOCITY), (195, 100)):
        motor.set_axis_parameter(parameter, value)
    search = stand.connection.reference_search
    search(START, 0)
    assert search(STATUS, 0) != 0
    wait_until(lambda: motor.actual_velocity == -VELOCITY, 2, "the way to the switch")
    stand.world.do("press left axis 0")
    wait_until(lambda: motor.actual_velocity == 100, 2, "the way from the switch")
    stand.world.do("release left axis 0")
    wait_until(lambda: motor.actual_velocity == -100, 2, "the way back to it")
    stand.world.do("press left axis 0")
    wait_until(lambda: search(STATUS, 0) == 0, 2, "the end of the search")
    assert (motor.actual_position, motor.get_position_reached()) == (0, 1)
    assert motor.get_axis_parameter(197, signed=True) < -10_000


@pytest.fixture
def stage(bench):
    """A carriage, with ramps of 19 mm/s: 800 * 244.14 microsteps a second."""
    stand = bench("tmcm-6110-stage.toml", 50)
    stand.motor = TMCM6110(stand.connection).motors[0]
    for parameter, value in ((154, 0), (153, 4), (4, 800), (5, 64), (6, 255), (194, 800), (195, 80)):
        stand.motor.set_axis_parameter(parameter, value)
    return stand


# Where the origin comes to lie: the left switch from one side, the home switch in its middle.
@pytest.mark.parametrize(("mode", "millimetres"), [(1, 0), (65, 60), (5, 30), (6, 30), (8, 30)])
def test_homing_finds_the_place_of_the_switch(stage, mode, millimetres):
    search = stage.connection.reference_search
    stage.motor.set_axis_parameter(193, mode)
    search(START, 0)
    wait_until(lambda: search(STATUS, 0) == 0, 5, "the end of the search")
    assert (stage.motor.actual_position, stage.motor.get_position_reached()) == (0, 1)
    assert stage.world.axis(0)["position"] == pytest.approx(millimetres, abs=0.02)


def test_a_stall_at_the_end_of_the_way_stops_the_axis(stage):
    motor = stage.motor
    motor.set_axis_parameter(181, 100)
    motor.set_axis_parameter(174, 0)
    motor.rotate(800)
    wait_until(lambda: motor.actual_velocity > 700, 1, "full speed")
    assert motor.get_axis_parameter(206) > 0
    # 45 mm of way, and half of an electrical period behind the hard stop.
    wait_until(lambda: motor.actual_velocity == 0, 2, "the stop")
    assert motor.get_axis_parameter(207) == 1
    assert stage.world.axis(0)["position"] == pytest.approx(65, abs=0.1)


def test_without_it_the_motor_loses_its_steps(stage):
    motor = stage.motor
    motor.move_to(100 * 10240)
    wait_until(motor.get_position_reached, 3, "the counter has arrived")
    state = stage.world.axis(0)
    assert motor.actual_position == 100 * 10240
    # The counter went from 0 at 20 mm to 100 mm further; the carriage stands at the end of its way.
    assert state["position"] == pytest.approx(65, abs=0.1)
    assert state["lost_steps"] > 0


def test_what_only_later_firmware_has_is_refused(fast_module):
    connection = fast_module.connection
    with pytest.raises(Exception, match="(?i)type"):
        connection.get_axis_parameter(150, 0)
