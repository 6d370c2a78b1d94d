"""Parameters, coordinates and ports."""

import subprocess

import pytest
from pytrinamic.modules import TMCM6214
from pytrinamic.tmcl import TMCLCommand, TMCLReplyStatusError, TMCLStatus

from server import program, wait_until

AP = TMCM6214(None).motors[0].AP
USER_VARIABLES = 2
OUTPUTS = 2
# The driver chip has 32 steps for currents of 0..255.
CURRENT_STEP = 8


def status_of(send, *arguments):
    """Status of a command that must be refused."""
    with pytest.raises(TMCLReplyStatusError) as refused:
        send(*arguments)
    return refused.value.status_code


def test_axis_parameters_are_read_signed_and_unsigned(module):
    motor = module.motors[3]
    module.stop(3)
    motor.actual_position = -12345
    assert motor.get_axis_parameter(AP.ActualPosition, signed=True) == -12345
    assert motor.get_axis_parameter(AP.ActualPosition) == 2**32 - 12345
    assert motor.actual_velocity == 0


def test_global_parameters_are_read_signed_and_unsigned(module):
    module.set_global_parameter(17, USER_VARIABLES, -1)
    assert module.get_global_parameter(17, USER_VARIABLES, signed=True) == -1
    assert module.get_global_parameter(17, USER_VARIABLES) == 2**32 - 1


def test_each_axis_has_parameters_of_its_own(module):
    for axis, motor in enumerate(module.motors):
        motor.linear_ramp.max_velocity = 10000 + axis
        motor.drive_settings.max_current = 96 + CURRENT_STEP * axis
    for axis, motor in enumerate(module.motors):
        assert motor.linear_ramp.max_velocity == 10000 + axis
        assert motor.drive_settings.max_current == 96 + CURRENT_STEP * axis


def test_factory_defaults_are_those_of_the_manual(module):
    for motor in module.motors:
        assert motor.drive_settings.microstep_resolution == 8
        assert motor.linear_ramp.max_velocity == 51200
        assert motor.linear_ramp.max_acceleration in (51106, 51107)


def test_what_cannot_be_done_is_refused_with_a_reason(connection):
    send = connection.send
    assert status_of(send, TMCLCommand.GAP, 1, 6, 0) == TMCLStatus.INVALID_VALUE
    assert status_of(send, TMCLCommand.ROR, 0, 6, 1000) == TMCLStatus.INVALID_VALUE
    assert status_of(send, TMCLCommand.GAP, 99, 0, 0) == TMCLStatus.WRONG_TYPE
    assert status_of(send, TMCLCommand.GGP, 0, 7, 0) == TMCLStatus.WRONG_TYPE
    assert status_of(send, 99, 0, 0, 0) == TMCLStatus.INVALID_COMMAND
    assert status_of(send, 0, 0, 0, 0) == TMCLStatus.INVALID_COMMAND


def test_a_refused_value_changes_nothing(module):
    motor = module.motors[0]
    motor.set_axis_parameter(AP.MicrostepResolution, 5)
    refused = status_of(motor.set_axis_parameter, AP.MicrostepResolution, 9)
    assert refused == TMCLStatus.INVALID_VALUE
    assert motor.get_axis_parameter(AP.MicrostepResolution) == 5


def test_coordinates_are_stored_captured_and_moved_to(fast_connection):
    module = TMCM6214(fast_connection)
    motor = module.motors[0]
    fast_connection.send(TMCLCommand.SCO, 1, 0, 25600)
    assert fast_connection.send(TMCLCommand.GCO, 1, 0, 0).value == 25600
    fast_connection.move(2, 0, 1)
    wait_until(motor.get_position_reached, 2, "coordinate reached")
    assert motor.actual_position == 25600

    module.stop(0)
    motor.actual_position = -7
    fast_connection.send(TMCLCommand.CCO, 2, 0, 0)
    assert fast_connection.send(TMCLCommand.GCO, 2, 0, 0).value == 2**32 - 7


def test_digital_outputs_read_back_what_was_set(module):
    assert [module.get_digital_output(port) for port in range(8)] == [0] * 8
    module.set_digital_output(module.IO.OUT3)
    assert [module.get_digital_output(port) for port in range(8)] == [0, 0, 0, 1, 0, 0, 0, 0]
    module.clear_digital_output(module.IO.OUT3)
    assert module.get_digital_output(module.IO.OUT3) == 0


def test_all_digital_outputs_are_set_at_once(connection):
    module = TMCM6214(connection)
    connection.send(TMCLCommand.SIO, 255, OUTPUTS, 0b10100101)
    assert [module.get_digital_output(port) for port in range(8)] == [1, 0, 1, 0, 0, 1, 0, 1]


def test_the_version_reads_as_on_the_real_module(connection):
    assert connection.get_version_string() == "6214V116"
    assert connection.send(TMCLCommand.GET_FIRMWARE_VERSION, 1, 0, 0).value == 0x18460110


def test_stored_variables_outlive_the_process(serve, tmp_path):
    memory = tmp_path / "module.eeprom"
    first = serve("--eeprom", memory)
    with first.connect() as connection:
        module = TMCM6214(connection)
        for number in (5, 6):
            module.set_global_parameter(number, USER_VARIABLES, 4711)
        module.store_global_parameter(5, USER_VARIABLES)
    assert first.stop() == 0

    with serve("--eeprom", memory).connect() as connection:
        module = TMCM6214(connection)
        assert module.get_global_parameter(5, USER_VARIABLES) == 4711
        assert module.get_global_parameter(6, USER_VARIABLES) == 0


def test_a_memory_in_use_is_not_opened_twice(serve, tmp_path):
    memory = tmp_path / "module.eeprom"
    serve("--eeprom", memory)
    second = subprocess.run(
        [program(), "serve", "tmcm-6214", "--eeprom", memory],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=5,
    )
    assert second.returncode == 1
    assert str(memory) in second.stderr
