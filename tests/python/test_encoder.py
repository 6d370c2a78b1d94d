"""The encoder beside the counter, and what happens when they part."""

import time

import pytest

from server import wait_until

AXIS = 3
SPEED = 20
PPS = 51200

# 4000 counts for 51200 microsteps: the encoder tells 12.8 microsteps apart.
COUNT = 51200 / 4000


@pytest.fixture
def stand(bench):
    stand = bench("bench.toml", SPEED)
    stand.set(AXIS, {6: 255, 5: 500_000, 15: 500_000, 17: 500_000, 18: 500_000, 210: 4000})
    return stand


def test_the_encoder_shows_where_the_motor_is(stand):
    motor = stand.module.motors[AXIS]
    for target in (51200, 12800, -100_000, 0):
        motor.move_to(target)
        wait_until(motor.get_position_reached, 3, "target reached")
        assert stand.get(209, AXIS) == pytest.approx(motor.actual_position, abs=COUNT + 1)
    assert motor.get_axis_parameter(207) == 0


def test_the_origin_of_the_encoder_can_be_set(stand):
    stand.set(AXIS, {209: 4000})
    assert stand.get(209, AXIS) == pytest.approx(4000, abs=COUNT + 1)
    stand.module.motors[AXIS].move_to(12800)
    wait_until(stand.module.motors[AXIS].get_position_reached, 2, "target reached")
    assert stand.get(209, AXIS) == pytest.approx(4000 + 12800, abs=2 * COUNT)


def test_a_wrong_resolution_shows(stand):
    # A thousand counts too few for a turn: each turn reads as 4000 / 3000 of one.
    stand.set(AXIS, {210: 3000})
    motor = stand.module.motors[AXIS]
    motor.move_to(51200)
    wait_until(motor.get_position_reached, 2, "target reached")
    assert stand.get(209, AXIS) == pytest.approx(51200 * 4 / 3, abs=2 * COUNT)


def test_a_blocked_axis_is_stopped_by_its_encoder(stand):
    motor = stand.module.motors[AXIS]
    # A quarter of a turn.
    stand.set(AXIS, {212: 12800})
    stand.connection.rotate(AXIS, PPS)
    wait_until(lambda: motor.actual_velocity == PPS, 2, "full speed")
    assert motor.get_axis_parameter(207) == 0
    stand.world.do(f"block axis {AXIS}")
    wait_until(lambda: motor.actual_velocity == 0, 2, "stopped by the deviation")
    # Bit 1 is the stop by deviation.
    assert motor.get_axis_parameter(207) == 2
    apart = motor.actual_position - stand.get(209, AXIS)
    assert apart > 12800
    # Where the rotor really is, the encoder says.
    assert stand.world.axis(AXIS)["rotor"] == pytest.approx(stand.get(209, AXIS), abs=COUNT + 1)


def test_without_a_permitted_deviation_a_blocked_axis_goes_on_counting(stand):
    motor = stand.module.motors[AXIS]
    stand.connection.rotate(AXIS, PPS)
    wait_until(lambda: motor.actual_velocity == PPS, 2, "full speed")
    stand.world.do(f"block axis {AXIS}")
    encoder = stand.get(209, AXIS)
    time.sleep(0.1)
    assert motor.actual_velocity == PPS
    assert motor.actual_position - encoder > PPS * SPEED * 0.05
    assert motor.get_axis_parameter(207) == 0


def test_a_shaft_turned_by_hand_shows_in_the_encoder_alone(stand):
    motor = stand.module.motors[AXIS]
    # Free of current, and turned by a quarter.
    stand.set(AXIS, {167: 0})
    stand.world.do(f"set position axis {AXIS} 90 deg")
    assert motor.actual_position == 0
    assert stand.get(209, AXIS) == pytest.approx(12800, abs=COUNT + 1)


def test_axes_without_an_encoder_input_refuse_its_parameters(stand):
    with pytest.raises(Exception, match="(?i)type|value"):
        stand.get(209, 2)
