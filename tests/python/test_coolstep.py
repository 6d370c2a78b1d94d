"""CoolStep as a host program sets it up and watches it in parameter 180."""

import pytest

from server import wait_until
from test_stallguard import AXIS, put_load, stand  # noqa: F401

# Parameter 180 with the full current, and the lowest that 168 allows: half and a quarter of it, of
# 32 steps.
FULL = 31
HALF = 15
QUARTER = 7


def actual(stand):
    return stand.get(180, AXIS)


def current_on(stand, minimum=0):
    """Switches CoolStep on with quick steps, and with the thresholds around a moderate load."""
    cool = stand.module.motors[AXIS].coolstep
    cool.current_minimum = minimum
    cool.current_down_step = 3
    cool.current_up_step = 3
    cool.hysteresis = 0
    # Readings below 6 · 32 give more current, above 7 · 32 less.
    cool.hysteresis_start = 6


@pytest.mark.parametrize(("minimum", "lowest"), [(0, HALF), (1, QUARTER)])
def test_the_current_falls_without_load_and_rises_with_it(stand, minimum, lowest):  # noqa: F811
    assert actual(stand) == FULL
    current_on(stand, minimum)
    wait_until(lambda: actual(stand) == lowest, 2, "the lowest current")
    # A load that comes at once would pull the saving motor out; this one grows, and the current with it.
    for percent in range(0, 75, 5):
        put_load(stand, percent / 100)
    wait_until(lambda: actual(stand) > 25, 2, "much current again")
    put_load(stand, 0)
    wait_until(lambda: actual(stand) == lowest, 2, "the lowest current again")
    assert stand.world.axis(AXIS)["lost_steps"] == 0
    # What the coils really get: n + 1 of 32 parts of 2.8 A.
    amperes = pytest.approx(2.8 * (lowest + 1) / 32, rel=0.02)
    wait_until(lambda: stand.world.axis(AXIS)["current"] == amperes, 1, "the current that 180 tells")


def test_the_full_current_is_back_where_coolstep_is_switched_off(stand):  # noqa: F811
    current_on(stand)
    wait_until(lambda: actual(stand) == HALF, 2, "the lowest current")
    stand.module.motors[AXIS].coolstep.hysteresis_start = 0
    wait_until(lambda: actual(stand) == FULL, 2, "the full current")


def test_below_its_speed_coolstep_saves_nothing(stand):  # noqa: F811
    current_on(stand)
    wait_until(lambda: actual(stand) == HALF, 2, "the lowest current")
    # Parameter 182: CoolStep from three turns a second; the motor turns twice.
    stand.module.motors[AXIS].coolstep.threshold_speed = 3 * 51200
    wait_until(lambda: actual(stand) == FULL, 2, "the full current")
