"""A motor under field-oriented control in simulators by others: `servo_simulators.py motulator|gym-electric-motor`.

The motor is that of bench/src/servo.rs, a QBL4208-61-04-013 at 24 V; regulators run at 20 kHz. A second is simulated:
from standstill to 2000 rpm, on with that speed, and to 2000 rpm the other way round. Prints how many times faster
than real time that was, by the time of the processor.
"""

import math
import os
import sys
import time

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ[f"{library}_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402

PERIOD = 50e-6
SUPPLY = 24.0
# In star, with two switches of 4 mohm behind two terminals.
POLE_PAIRS = 4
RESISTANCE = 0.364
INDUCTANCE = 0.6e-3
FLUX = 0.036 / (np.sqrt(3) * POLE_PAIRS)
INERTIA = 48e-6
VISCOUS = 1e-5
DRY = 2.5e-3
# A load that must have some.
NO_INERTIA = 1e-12
LARGEST_CURRENT = 5.0

SPEED = 2000 / 60 * 2 * np.pi
TIMES, SPEEDS = [0, 0.25, 0.5, 1], [0, SPEED, SPEED, -SPEED]
CURRENT_BANDWIDTH = 2 * np.pi * 300
SPEED_BANDWIDTH = 2 * np.pi * 20


def motulator():
    """Its current vector control with sensors and its speed controller; its machine has no dry friction."""
    from motulator.drive import model
    from motulator.drive.control.sm import CurrentReferenceCfg, CurrentVectorControl
    from motulator.drive.control import SpeedController
    from motulator.drive.utils import Sequence, SynchronousMachinePars

    motor = SynchronousMachinePars(
        n_p=POLE_PAIRS, R_s=RESISTANCE, L_d=INDUCTANCE, L_q=INDUCTANCE, psi_f=FLUX)
    drive = model.Drive(
        model.VoltageSourceConverter(u_dc=SUPPLY),
        model.SynchronousMachine(motor),
        model.StiffMechanicalSystem(J=INERTIA, B_L=VISCOUS))
    reference = CurrentReferenceCfg(
        motor, max_i_s=LARGEST_CURRENT, nom_w_m=POLE_PAIRS * SPEED)
    control = CurrentVectorControl(
        motor, reference, T_s=PERIOD, J=INERTIA, alpha_c=CURRENT_BANDWIDTH, sensorless=False)
    control.speed_ctrl = SpeedController(INERTIA, SPEED_BANDWIDTH)
    control.ref.w_m = Sequence(np.array(TIMES), POLE_PAIRS * np.array(SPEEDS))
    simulation = model.Simulation(drive, control)
    start = time.process_time()
    simulation.simulate(t_stop=TIMES[-1])
    return time.process_time() - start, drive.mechanics.meas_speed()


class Regulator:
    """A PI regulator that stops to integrate at its limit."""

    def __init__(self, proportional, integral, limit):
        self.proportional, self.integral, self.limit = proportional, integral * PERIOD, limit
        self.sum = 0.0

    def __call__(self, error):
        output = self.proportional * error + self.sum
        if abs(output) < self.limit:
            self.sum += self.integral * error
        return min(max(output, -self.limit), self.limit)


def gym_electric_motor():
    """Its motor with continuous voltages and its usual solver, under the shortest control in plain Python: its own
    controllers do not run without a package that draws them.
    """
    import gym_electric_motor as gem
    from gym_electric_motor.physical_systems.mechanical_loads import PolynomialStaticLoad
    from gym_electric_motor.reference_generators import ConstReferenceGenerator

    limits = {"omega": 500.0, "i": 4 * LARGEST_CURRENT, "u": SUPPLY}
    plant = gem.make(
        "Cont-SC-PMSM-v0",
        tau=PERIOD,
        supply={"u_nominal": SUPPLY},
        motor={
            "motor_parameter": {"p": POLE_PAIRS, "r_s": RESISTANCE, "l_d": INDUCTANCE,
                                "l_q": INDUCTANCE, "psi_p": FLUX, "j_rotor": INERTIA},
            "limit_values": limits,
            "nominal_values": limits,
        },
        load=PolynomialStaticLoad({"a": DRY, "b": VISCOUS, "c": 0.0, "j_load": NO_INERTIA}),
        reference_generator=ConstReferenceGenerator("omega", 0.0),
        state_filter=["omega", "i_sd", "i_sq", "epsilon"],
        visualization=None,
        disable_env_checker=True,
    ).unwrapped
    full = plant.limits.tolist()
    constant = 1.5 * POLE_PAIRS * FLUX
    speed_regulator = Regulator(
        INERTIA * SPEED_BANDWIDTH / constant, INERTIA * SPEED_BANDWIDTH**2 / 4 / constant, LARGEST_CURRENT)
    gains = INDUCTANCE * CURRENT_BANDWIDTH, RESISTANCE * CURRENT_BANDWIDTH
    direct_regulator, torque_regulator = (Regulator(*gains, SUPPLY / 2) for _ in range(2))
    references = np.interp(np.arange(round(TIMES[-1] / PERIOD)) * PERIOD, TIMES, SPEEDS).tolist()
    root = math.sqrt(3) / 2
    (state, _), _ = plant.reset()
    start = time.process_time()
    for reference in references:
        speed, direct, torque, angle = (part * limit for part, limit in zip(state.tolist(), full))
        along = direct_regulator(-direct)
        across = torque_regulator(speed_regulator(reference - speed) - torque)
        sine, cosine = math.sin(angle), math.cos(angle)
        alpha = (along * cosine - across * sine) / (SUPPLY / 2)
        beta = (along * sine + across * cosine) / (SUPPLY / 2)
        phases = alpha, root * beta - alpha / 2, -root * beta - alpha / 2
        (state, _), _, ended, _, _ = plant.step(np.clip(phases, -1.0, 1.0))
        assert not ended, "beyond a limit"
    return time.process_time() - start, state[0] * full[0]


if __name__ == "__main__":
    simulators = {"motulator": motulator, "gym-electric-motor": gym_electric_motor}
    seconds, speed = simulators[sys.argv[1]]()
    assert abs(speed + SPEED) < SPEED / 20, f"{speed} rad/s"
    print(TIMES[-1] / seconds)
