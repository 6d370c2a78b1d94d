"""The model of a brushless motor beside that of motulator, a simulator of drives by others.

Both get the same voltages and the same load: those of open-loop runs that start at standstill, accelerate, bear a
step of the load, and brake. In an open loop the rotor swings, so that every mistake shows.
"""

import subprocess
from types import SimpleNamespace

import numpy as np
import pytest
from motulator.common.utils import complex2abc
from motulator.drive.model import (
    Drive, Simulation, StiffMechanicalSystem, SynchronousMachine, VoltageSourceConverter)

from server import program

# Of the largest value in a run. Required are 2 %; both models are good enough for less.
TOLERANCE = 0.01

PERIOD = 50e-6
SECONDS = 0.3
SUPPLY = 24.0
FULL_DUTY = 65535

# QBL4208-61-04-013 by its data sheet: 0.72 ohm and 1.2 mH between two terminals, of which a phase of the star has
# half; 0.036 Nm/A with current through two phases, which is the peak of the EMF between two terminals too, and that
# is sqrt(3) times the peak of a phase; 480 g cm^2. A switch has 4 mohm, bearings have 10 uNm per rad/s.
POLE_PAIRS = 4
RESISTANCE = 0.72 / 2 + 0.004
INDUCTANCE = 1.2e-3 / 2
FLUX = 0.036 / (np.sqrt(3) * POLE_PAIRS)
INERTIA = 480e-7
VISCOUS = 1e-5

CURRENT = 6.0
LOAD = 0.06


class Run:
    """Duties and load of each control period of a run to a speed in rad/s."""

    def __init__(self, motor, rotor_inertia, load_inertia, speed):
        self.motor, self.speed = motor, speed
        self.rotor_inertia, self.load_inertia = rotor_inertia, load_inertia
        times = np.arange(round(SECONDS / PERIOD)) * PERIOD
        wanted = speed * np.interp(times, [0, 0.1, 0.2, 0.28], [0, 1, 1, 0.2])
        angle = POLE_PAIRS * np.cumsum(wanted) * PERIOD
        # What drives the current along this angle, if the rotor is half a radian behind.
        emf = 1j * POLE_PAIRS * wanted * FLUX * np.exp(-0.5j * np.sign(speed))
        drop = (RESISTANCE + 1j * POLE_PAIRS * wanted * INDUCTANCE) * CURRENT
        phases = complex2abc((drop + emf) * np.exp(1j * angle)).T
        self.duties = np.round((phases / SUPPLY + 0.5) * FULL_DUTY).astype(int)
        # Against the motion.
        self.loads = np.where((times >= 0.12) & (times < 0.22), -LOAD * np.sign(speed), 0.0)


class Trace:
    """What a machine does at the end of each period: phase currents, torque, speed."""

    def __init__(self, currents, torque, speed):
        self.currents, self.torque, self.speed = currents, torque, speed


def ours(run):
    """The run with our model."""
    trace = program().parent / "examples" / "servo_trace"
    lines = "".join(f"{a},{b},{c},{load}\n" for (a, b, c), load in zip(run.duties, run.loads))
    command = [trace, run.motor, str(run.load_inertia), str(SUPPLY)]
    result = subprocess.run(command, input=lines, check=True, capture_output=True, text=True)
    rows = np.array([line.split(",") for line in result.stdout.splitlines()], dtype=float)
    return Trace(rows[:, :3], rows[:, 3], rows[:, 4])


class Playback:
    """A control system for motulator that plays a run, and notes what has come of it so far."""

    def __init__(self, run):
        self.steps = iter(zip(run.duties / FULL_DUTY, run.loads))
        self.load = 0.0
        self.currents, self.torque, self.speed = [], [], []

    def __call__(self, drive):
        self.note(drive)
        duties, self.load = next(self.steps)
        return PERIOD, duties

    def note(self, drive):
        self.currents.append(drive.machine.meas_currents())
        self.torque.append(drive.machine.tau_M)
        self.speed.append(drive.mechanics.meas_speed())

    def post_process(self):
        """Nothing is left to be done."""


def theirs(run):
    """The run with motulator, whose machine starts aligned with phase A as ours does."""
    control = Playback(run)
    drive = Drive(
        VoltageSourceConverter(u_dc=SUPPLY),
        SynchronousMachine(SimpleNamespace(
            n_p=POLE_PAIRS, R_s=RESISTANCE, L_d=INDUCTANCE, L_q=INDUCTANCE, psi_f=FLUX)),
        StiffMechanicalSystem(
            J=run.rotor_inertia + run.load_inertia, B_L=VISCOUS,
            tau_L=lambda time: 0 * time - control.load))
    # Ours gets the duties of a period at its beginning; motulator would wait for another one.
    drive.delay = lambda duties: duties
    Simulation(drive, control).simulate(t_stop=(len(run.duties) - 0.5) * PERIOD)
    control.note(drive)
    # What is noted first is the state before the run.
    return Trace(*(np.array(column[1:]) for column in
                   (control.currents, control.torque, control.speed)))


# Of the second motor it is said that it has a tenth of the inertia, and all else the same.
@pytest.mark.parametrize("run", [
    pytest.param(Run("qbl4208-61-04-013", INERTIA, 52e-6, 100), id="1000 rpm"),
    pytest.param(Run("qbl4208-61-04-013-light", INERTIA / 10, 5.2e-6, -300), id="-3000 rpm"),
])
def test_a_motor_does_what_motulator_says(run):
    our, their = ours(run), theirs(run)
    # It is a run in which the rotor follows, not one in which it only trembles.
    assert their.speed[2400] == pytest.approx(run.speed, rel=0.2)
    assert their.speed[-1] == pytest.approx(0.2 * run.speed, rel=0.2)
    deviations = {
        name: abs(getattr(our, name) - getattr(their, name)).max() / abs(getattr(their, name)).max()
        for name in ("currents", "torque", "speed")
    }
    print(", ".join(f"{name}: {100 * deviation:.4f} %" for name, deviation in deviations.items()))
    assert max(deviations.values()) <= TOLERANCE, deviations
