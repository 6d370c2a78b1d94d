"""Reference searches as a host program starts and follows them, on stages with real switches."""

import pytest

from server import wait_until

START, STOP, STATUS = 0, 1, 2

MICROSTEPS_PER_MM = 10240
SEARCH_SPEED = 20 * MICROSTEPS_PER_MM
SWITCH_SPEED = 2 * MICROSTEPS_PER_MM

# 70 mm of way at 20 mm/s there and back, and some millimetres at 2 mm/s, are less than 20 s.
SPEED = 50
SECONDS = 20 / SPEED + 2

# Between the rotor and where its field stands, there is a hundredth of a turn at most; the friction of
# this stage is far from that. Searches with the index wait for a pulse of a thousandth of a turn.
TOLERANCE_MM = 0.01


@pytest.fixture
def homing(bench):
    stand = bench("homing.toml", SPEED)
    for axis in (0, 1, 3):
        # The full current of the module, and steep ramps.
        stand.set(axis, {6: 255, 4: SEARCH_SPEED, 5: 2_000_000, 15: 2_000_000, 17: 2_000_000})
        stand.set(axis, {18: 2_000_000, 194: SEARCH_SPEED, 195: SWITCH_SPEED})
    return stand


def search(stand, axis, mode):
    """A search from its beginning to its end."""
    motor = stand.module.motors[axis]
    motor.set_axis_parameter(193, mode)
    assert motor.get_axis_parameter(193) == mode
    stand.connection.reference_search(START, axis)
    assert stand.connection.reference_search(STATUS, axis) != 0
    wait_until(
        lambda: stand.connection.reference_search(STATUS, axis) == 0, SECONDS, "the search has ended"
    )


# Where the origin comes to lie, and the distance of both switches (parameter 196), in millimetres. The
# left switch is actuated from -2 to 0, the right one from 60 to 62, the home switch from 29 to 31.
MODES = [
    # A limit switch alone is found where the stage comes upon it.
    (0, 1, 0, None),
    (0, 2, 0, 60),
    # The middle of the left switch; the right one is found where the stage comes upon it.
    (0, 3, -1, 61),
    (0, 4, -1, None),
    # The middle of the home switch from either side.
    (0, 5, 30, None),
    (0, 6, 30, None),
    (0, 7, 30, None),
    (0, 8, 30, None),
    # Left and right change places.
    (0, 64 + 1, 60, None),
    (0, 64 + 2, 60, 60),
    (0, 64 + 3, 61, 61),
    (0, 64 + 4, 61, None),
    # An inverted home switch.
    (1, 128 + 5, 30, None),
    (1, 128 + 6, 30, None),
    (1, 128 + 8, 30, None),
    # The index before and behind 20 mm.
    (3, 9, 21, None),
    (3, 10, 16, None),
]


@pytest.mark.parametrize(("axis", "mode", "origin", "distance"), MODES)
def test_a_search_finds_its_origin(homing, axis, mode, origin, distance):
    if mode == 7:
        # This mode goes in negative direction and ignores the left limit switch.
        homing.world.do("set position axis 0 45 mm")
    if axis == 3:
        # The resolution of the encoder, and an index that is high.
        homing.set(axis, {210: 4000, 201: 4})
    # A stage that is moved by hand has left its field, which counts as lost steps.
    lost_before = homing.world.axis(axis)["lost_steps"]
    search(homing, axis, mode)
    motor = homing.module.motors[axis]
    assert motor.actual_position == 0
    assert motor.actual_velocity == 0
    assert homing.world.axis(axis)["position"] == pytest.approx(origin, abs=TOLERANCE_MM)
    assert homing.world.axis(axis)["lost_steps"] == lost_before
    if distance is not None:
        assert motor.get_axis_parameter(196) == pytest.approx(
            distance * MICROSTEPS_PER_MM, abs=TOLERANCE_MM * MICROSTEPS_PER_MM
        )
    # Ten millimetres from the origin are ten millimetres.
    motor.move_to(10 * MICROSTEPS_PER_MM)
    wait_until(motor.get_position_reached, 2, "ten millimetres from the origin")
    if origin <= 50:
        assert homing.world.axis(axis)["position"] == pytest.approx(origin + 10, abs=TOLERANCE_MM)


def test_mode_135_finds_an_inverted_home_switch_in_negative_direction(homing):
    homing.world.do("set position axis 1 45 mm")
    search(homing, 1, 128 + 7)
    assert homing.world.axis(1)["position"] == pytest.approx(30, abs=TOLERANCE_MM)


@pytest.mark.parametrize("mode", [0, 11, 64 + 5, 128 + 1, 128 + 9])
def test_a_mode_that_does_not_exist_is_refused(homing, mode):
    motor = homing.module.motors[0]
    with pytest.raises(Exception, match="(?i)value"):
        motor.set_axis_parameter(193, mode)
    assert motor.get_axis_parameter(193) == 1


def test_a_search_can_be_stopped(homing):
    homing.connection.reference_search(START, 0)
    assert homing.connection.reference_search(STATUS, 0) != 0
    homing.connection.reference_search(STOP, 0)
    assert homing.connection.reference_search(STATUS, 0) == 0
    motor = homing.module.motors[0]
    wait_until(lambda: motor.actual_velocity == 0, 1, "standstill")
    # It had 20 mm to go.
    assert homing.world.axis(0)["position"] > 1


def test_a_switch_that_never_opens_keeps_the_search_going_until_it_is_stopped(homing):
    # Pressed by hand, the switch follows no stage: the axis never leaves it.
    homing.world.do("press left axis 0")
    homing.connection.reference_search(START, 0)
    wait_until(
        lambda: homing.world.axis(0)["lost_steps"] > 0, SECONDS, "the stage is at its hard stop"
    )
    assert homing.connection.reference_search(STATUS, 0) != 0
    assert homing.world.axis(0)["position"] == pytest.approx(65, abs=0.5)
    homing.connection.reference_search(STOP, 0)
    assert homing.connection.reference_search(STATUS, 0) == 0


def test_a_limit_switch_stops_only_while_it_is_enabled(homing):
    motor = homing.module.motors[0]
    homing.set(0, {13: 0})
    homing.connection.rotate(0, -SEARCH_SPEED)
    wait_until(lambda: motor.get_axis_parameter(11) == 1, 2, "the left switch is actuated")
    wait_until(lambda: motor.actual_velocity == 0, 1, "standstill")
    # The switch is actuated at 0, and a stop by a switch is at once.
    assert homing.world.axis(0)["position"] == pytest.approx(0, abs=0.1)
    homing.connection.rotate(0, SEARCH_SPEED)
    wait_until(lambda: homing.world.axis(0)["position"] > 10, 2, "the way back is free")
    assert motor.get_axis_parameter(11) == 0
    # Parameter 12 is 1 from the factory: the right switch stops nothing, but can be read.
    wait_until(lambda: motor.get_axis_parameter(10) == 1, 2, "the right switch is actuated")
    wait_until(lambda: homing.world.axis(0)["position"] > 63, 2, "the stage is behind the switch")
