"""A TMCM-1636 as PyTrinamic's own class for it drives it, over both lines: the vendor's examples for this module."""

import statistics
import time

import pytest
from pytrinamic.modules import TMCM1636
from pytrinamic.tmcl import TMCLCommand, TMCLReplyStatusError

from conftest import FAST
from server import wait_until

STEPS = 4096
TURNS = 50


def configured(connection, commutation):
    """The drive settings and gains of the examples; the commutation comes first, as there."""
    module = TMCM1636(connection)
    motor = module.motors[0]
    motor.drive_settings.motor_type = motor.ENUM.MOTOR_TYPE_THREE_PHASE_BLDC
    motor.drive_settings.pole_pairs = 4
    motor.drive_settings.max_current = 2000
    motor.drive_settings.commutation_mode = commutation
    motor.drive_settings.target_reached_distance = 5
    motor.drive_settings.target_reached_velocity = 500
    motor.drive_settings.open_loop_current = 1000
    motor.abn_encoder.resolution = STEPS
    motor.abn_encoder.direction = 1
    motor.digital_hall.direction = 0
    motor.digital_hall.polarity = 1
    motor.digital_hall.offset = 0
    motor.digital_hall.interpolation = 1
    motor.linear_ramp.max_velocity = 2000
    motor.linear_ramp.max_acceleration = 1000
    motor.linear_ramp.enabled = 1
    motor.pid.torque_p = 300
    motor.pid.torque_i = 600
    motor.pid.velocity_p = 100
    motor.pid.velocity_i = 100
    motor.pid.position_p = 300
    return module


def compensated(module):
    """The current offsets as the examples take them: the mean of 40 readings."""
    motor = module.motors[0]
    for raw, offset in (
        (motor.AP.AdcPhaseA, motor.AP.AdcOffsetPhaseA),
        (motor.AP.AdcPhaseB, motor.AP.AdcOffsetPhaseB),
    ):
        readings = [motor.get_axis_parameter(raw) for _ in range(40)]
        motor.set_axis_parameter(offset, round(statistics.mean(readings)))
        module.connection.store_axis_parameter(offset, 0)
    return [motor.get_axis_parameter(n) for n in (motor.AP.AdcOffsetPhaseA, motor.AP.AdcOffsetPhaseB)]


def encoder_is_ready(motor):
    return motor.get_axis_parameter(motor.AP.EncoderInitState) == 0


@pytest.fixture
def bare(serve, line):
    """A fresh module that runs `FAST` times as fast."""
    with serve("--speed", FAST, what="tmcm-1636").connect(line) as connection:
        yield connection


def test_the_module_says_who_it_is(bare):
    assert bare.get_version_string() == "1636V109"
    assert bare.send(TMCLCommand.GET_FIRMWARE_VERSION, 1, 0, 0).value == 1636 << 16 | 1 << 8 | 9


def test_all_parameters_that_the_class_names_can_be_read(bare):
    motor = TMCM1636(bare).motors[0]
    names = {name: n for name, n in vars(motor.AP).items() if not name.startswith("_")}
    # Those have come with later firmware.
    later = {name for name in names if name.startswith("AbsoluteEncoder") and names[name] > 163}
    for name in names.keys() - later:
        motor.get_axis_parameter(names[name])
    for name in later:
        with pytest.raises(TMCLReplyStatusError):
            motor.get_axis_parameter(names[name])
    for name, number in vars(TMCM1636.GP).items():
        if not name.startswith("_"):
            bare.get_global_parameter(number, 0)


def test_the_feature_objects_read_and_print(bare):
    motor = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DIGITAL_HALL).motors[0]
    features = (motor.drive_settings, motor.abn_encoder, motor.digital_hall, motor.linear_ramp, motor.pid)
    for feature in (*features, motor.absolute_encoder):
        assert str(feature)
    assert motor.drive_settings.max_current == 2000
    assert motor.linear_ramp.max_acceleration == 1000
    assert motor.pid.velocity_p == 100


def test_encoder_velocity_mode(bare):
    module = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DISABLED)
    motor = module.motors[0]
    # 33000 without current.
    assert compensated(module) == [33_000, 33_000]
    motor.abn_encoder.init_mode = motor.ENUM.ENCODER_INIT_MODE_2
    motor.drive_settings.commutation_mode = motor.ENUM.COMM_MODE_ABN_ENCODER
    motor.rotate(2000)
    wait_until(lambda: motor.actual_velocity > 1950, 1, "full speed")
    assert encoder_is_ready(motor)
    time.sleep(0.1)
    assert motor.actual_velocity == pytest.approx(2000, abs=40)
    motor.stop()
    wait_until(lambda: abs(motor.actual_velocity) < 20, 1, "standstill")
    motor.drive_settings.commutation_mode = motor.ENUM.COMM_MODE_DISABLED
    assert motor.get_axis_parameter(motor.AP.StatusFlags) & 0x8300 == 0x100


def test_encoder_position_mode(bare):
    module = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_ABN_ENCODER)
    motor = module.motors[0]
    motor.abn_encoder.init_mode = motor.ENUM.ENCODER_INIT_MODE_0
    motor.set_axis_parameter(motor.AP.PositionScaler, STEPS)
    wait_until(lambda: encoder_is_ready(motor), 1, "the encoder knows the angle")
    motor.actual_position = 0
    for target in (TURNS * STEPS, 0):
        motor.move_to(target)
        assert motor.get_position_reached() == 0
        assert motor.target_position == target
        wait_until(motor.get_position_reached, 2, f"the target {target} is reached")
        assert motor.get_axis_parameter(motor.AP.StatusFlags) & motor.ENUM.FLAG_POSITION_END
        time.sleep(0.1)
        assert motor.actual_position == pytest.approx(target, abs=20)


def test_a_move_takes_the_time_of_its_ramp(serve, line):
    """50 turns with 1000 rpm/s are two times sqrt(50 * 60 / 1000) s."""
    with serve(what="tmcm-1636").connect(line) as connection:
        module = configured(connection, TMCM1636._MotorTypeA.ENUM.COMM_MODE_ABN_ENCODER)
        motor = module.motors[0]
        motor.set_axis_parameter(motor.AP.PositionScaler, STEPS)
        wait_until(lambda: encoder_is_ready(motor), 3, "the encoder knows the angle")
        motor.actual_position = 0
        motor.move_to(TURNS * STEPS)
        seconds = wait_until(motor.get_position_reached, 6, "the target is reached")
        assert seconds == pytest.approx(3.46, abs=0.5)


def test_hall_position_mode(bare):
    module = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DIGITAL_HALL)
    motor = module.motors[0]
    motor.set_axis_parameter(motor.AP.PositionScaler, 6 * motor.drive_settings.pole_pairs)
    motor.actual_position = 0
    motor.move_to(0)
    for target in (4000, 0):
        motor.move_to(target)
        wait_until(motor.get_position_reached, 3, f"the target {target} is reached")
        time.sleep(0.1)
        assert motor.actual_position == pytest.approx(target, abs=5)


def test_torque_turns_the_motor(bare):
    module = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DIGITAL_HALL)
    motor = module.motors[0]
    motor.set_axis_parameter(motor.AP.TargetTorque, -500)
    wait_until(lambda: motor.actual_velocity < -200, 1, "the motor turns left")
    assert motor.get_axis_parameter(motor.AP.StatusFlags) & 0xF00 == 0x800


def test_a_move_with_a_speed_of_its_own(bare):
    """`move_to` with a velocity writes the maximum first, also while the motor turns."""
    module = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DIGITAL_HALL)
    motor = module.motors[0]
    motor.rotate(500)
    time.sleep(0.1)
    module.move_to(0, 1_000_000_000, 800)
    wait_until(lambda: motor.actual_velocity > 760, 1, "the new speed")
    time.sleep(0.1)
    assert motor.actual_velocity < 840
    module.stop(0)


def test_a_program_is_loaded_command_by_command(bare):
    """As the example `tmcl_script_load` does; its first command starts the encoder."""
    motor = configured(bare, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DISABLED).motors[0]
    bare.send(TMCLCommand.START_DOWNLOAD_MODE, 0, 0, 0)
    bare.send(TMCLCommand.SAP, motor.AP.CommutationMode, 0, 3)
    bare.send(TMCLCommand.ROR, 0, 0, 500)
    bare.send(TMCLCommand.WAIT, 0, 0, 100)
    bare.send(TMCLCommand.ROR, 0, 0, -500)
    bare.send(TMCLCommand.WAIT, 0, 0, 100)
    bare.send(TMCLCommand.JA, 0, 0, 1)
    bare.send(TMCLCommand.QUIT_DOWNLOAD_MODE, 0, 0, 0)
    bare.send(TMCLCommand.RESET_APPLICATION, 0, 0, 0)
    bare.send(TMCLCommand.RUN_APPLICATION, 0, 0, 0)
    for what, turns in (("right", lambda v: v > 400), ("left", lambda v: v < -400)):
        wait_until(lambda: turns(motor.actual_velocity), 1, f"turning {what}")
    bare.send(TMCLCommand.STOP_APPLICATION, 0, 0, 0)
    motor.stop()
    wait_until(lambda: abs(motor.actual_velocity) < 20, 1, "standstill")


def test_writing_what_can_only_be_read_is_no_error_and_does_nothing(bare):
    motor = TMCM1636(bare).motors[0]
    motor.set_axis_parameter(motor.AP.ActualVelocity, 100)
    assert motor.actual_velocity == 0
    with pytest.raises(TMCLReplyStatusError):
        motor.set_axis_parameter(motor.AP.CommutationMode, 5)


def test_digital_inputs_reverse_and_stop_the_motor(bench):
    """The example `hall_digital_input`: push buttons to ground."""
    stand = bench("tmcm-1636.toml")
    module = configured(stand.connection, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DIGITAL_HALL)
    motor = module.motors[0]
    motor.rotate(500)
    wait_until(lambda: motor.actual_velocity > 450, 1, "turning right")
    assert stand.connection.get_digital_input(module.IO.GPI_0) == 1
    stand.world.do("input 0 low")
    assert stand.connection.get_digital_input(module.IO.GPI_0) == 0
    motor.rotate(-500)
    wait_until(lambda: motor.actual_velocity < -450, 1, "turning left")
    assert stand.connection.get_digital_input(module.IO.GPI_1) == 1
    stand.world.do("input 1 low")
    assert stand.connection.get_digital_input(module.IO.GPI_1) == 0
    motor.rotate(0)
    wait_until(lambda: abs(motor.actual_velocity) < 50, 1, "standstill")


def test_settings_survive_the_power_if_they_are_stored(serve, tmp_path):
    eeprom = tmp_path / "1636.eeprom"
    server = serve("--eeprom", eeprom, what="tmcm-1636")
    with server.connect() as connection:
        motor = TMCM1636(connection).motors[0]
        motor.drive_settings.max_current = 1234
        connection.store_axis_parameter(motor.AP.MaxCurrent, 0)
        motor.linear_ramp.max_velocity = 777
    assert server.stop() == 0
    with serve("--eeprom", eeprom, what="tmcm-1636").connect() as connection:
        motor = TMCM1636(connection).motors[0]
        assert motor.drive_settings.max_current == 1234
        assert motor.linear_ramp.max_velocity == 4000


def test_end_switches_stop_the_motor(bench):
    """The example `hall_endstop`."""
    stand = bench("tmcm-1636.toml")
    motor = configured(stand.connection, TMCM1636._MotorTypeA.ENUM.COMM_MODE_DIGITAL_HALL).motors[0]
    motor.set_axis_parameter(motor.AP.ReferenceSwitchEnable, 3)
    motor.set_axis_parameter(motor.AP.ReferenceSwitchPolarity, 0)
    for speed, side, switch in (
        (500, "right", motor.AP.RightStopSwitch),
        (-500, "left", motor.AP.LeftStopSwitch),
    ):
        motor.rotate(speed)
        wait_until(lambda: abs(motor.actual_velocity - speed) < 50, 1, f"turning {side}")
        assert motor.get_axis_parameter(switch) == 0
        stand.world.do(f"press {side} axis 0")
        assert motor.get_axis_parameter(switch) == 1
        wait_until(lambda: abs(motor.actual_velocity) < 50, 1, "the switch stops it")
    motor.rotate(0)
