"""Programs that are downloaded, verified, and run while the host watches."""

import time

from pytrinamic.modules import TMCM6214
from pytrinamic.tmcl import TMCLCommand as Op
from pytrinamic.tmcl import TMCLStatus

from server import wait_until

VARIABLES = 2
TIMERS = 3
ABS = 0
ADD = 0
WAIT_POS = 1
ALL_INTERRUPTS = 255
TIMER_MILLISECONDS = 50

# Moves axis 0 to and fro and counts the moves in variable 0, by a subroutine; meanwhile timer 0
# counts in variable 1. Each line is command number, type, motor or bank, value.
COUNT_MOVE = 11
COUNT_TICK = 15
SHUTTLE = [
    (Op.VECT, 0, 0, COUNT_TICK),
    (Op.SGP, 0, TIMERS, TIMER_MILLISECONDS),
    (Op.EI, 0, 0, 0),
    (Op.EI, ALL_INTERRUPTS, 0, 0),
    (Op.MVP, ABS, 0, 20000),
    (Op.WAIT, WAIT_POS, 0, 0),
    (Op.CSUB, 0, 0, COUNT_MOVE),
    (Op.MVP, ABS, 0, -20000),
    (Op.WAIT, WAIT_POS, 0, 0),
    (Op.CSUB, 0, 0, COUNT_MOVE),
    (Op.JA, 0, 0, 4),
    (Op.GGP, 0, VARIABLES, 0),
    (Op.CALC, ADD, 0, 1),
    (Op.AGP, 0, VARIABLES, 0),
    (Op.RSUB, 0, 0, 0),
    (Op.GGP, 1, VARIABLES, 0),
    (Op.CALC, ADD, 0, 1),
    (Op.AGP, 1, VARIABLES, 0),
    (Op.RETI, 0, 0, 0),
]


def download(connection, program):
    connection.send(Op.START_DOWNLOAD_MODE, 0, 0, 0)
    for command in program + [(0, 0, 0, 0)]:
        reply = connection.send(*command)
        assert reply.status == TMCLStatus.COMMAND_LOADED
        assert reply.command == command[0]
    connection.send(Op.QUIT_DOWNLOAD_MODE, 0, 0, 0)


def read_back(connection):
    """The program in the module's memory, up to the end mark."""
    program = []
    while True:
        reply = connection.send(Op.READ_TMCL_MEMORY, 0, 0, len(program))
        # This reply alone has the command where others have module address, status and command.
        command = (reply.module_address, reply.status, reply.command, signed(reply.value))
        if command[0] == 0:
            return program
        program.append(command)


def signed(value):
    return value - 2**32 if value >= 2**31 else value


def run(connection):
    connection.send(Op.RESET_APPLICATION, 0, 0, 0)
    connection.send(Op.RUN_APPLICATION, 0, 0, 0)


def test_a_downloaded_program_reads_back_as_sent(connection):
    download(connection, SHUTTLE)
    assert read_back(connection) == SHUTTLE


def test_a_program_with_wait_timer_and_subroutine_runs_while_the_host_polls(serve, line):
    speed = 10
    with serve("--speed", speed).connect(line) as connection:
        module = TMCM6214(connection)
        motor = module.motors[0]
        download(connection, SHUTTLE)
        run(connection)
        start = time.monotonic()
        positions = set()
        while time.monotonic() - start < 2:
            positions.add(motor.actual_position)
        ticks = module.get_global_parameter(1, VARIABLES)
        elapsed = time.monotonic() - start
        moves = module.get_global_parameter(0, VARIABLES)

        # The shortest time in which 40000 microsteps can be done is that at full speed.
        assert 2 <= moves <= elapsed * speed / (40000 / 51200)
        expected_ticks = elapsed * speed * 1000 / TIMER_MILLISECONDS
        assert abs(ticks - expected_ticks) < 0.1 * expected_ticks
        assert len(positions) > 100
        assert max(positions) == 20000
        assert min(positions) == -20000


def test_a_stopped_program_stands_and_goes_on_where_it_was(serve, line):
    with serve("--speed", 10).connect(line) as connection:
        module = TMCM6214(connection)
        download(connection, SHUTTLE)
        run(connection)
        wait_until(lambda: module.get_global_parameter(1, VARIABLES) > 5, 2, "timer interrupts")
        assert module.get_global_parameter(module.GP0.ApplicationStatus, 0) == 1

        connection.send(Op.STOP_APPLICATION, 0, 0, 0)
        assert module.get_global_parameter(module.GP0.ApplicationStatus, 0) == 0
        ticks = module.get_global_parameter(1, VARIABLES)
        time.sleep(0.1)
        assert module.get_global_parameter(1, VARIABLES) == ticks

        connection.send(Op.RUN_APPLICATION, 0, 0, 0)
        wait_until(lambda: module.get_global_parameter(1, VARIABLES) > ticks, 2, "more interrupts")


def test_a_program_can_be_stepped(connection):
    module = TMCM6214(connection)
    download(connection, [(Op.CALC, 9, 0, 7), (Op.AGP, 8, VARIABLES, 0), (Op.STOP, 0, 0, 0)])
    connection.send(Op.RESET_APPLICATION, 0, 0, 0)
    connection.send(Op.STEP_APPLICATION, 0, 0, 0)
    wait_until(lambda: module.get_global_parameter(130, 0) == 1, 1, "one command done")
    assert module.get_global_parameter(8, VARIABLES) == 0
    connection.send(Op.STEP_APPLICATION, 0, 0, 0)
    wait_until(lambda: module.get_global_parameter(8, VARIABLES) == 7, 1, "two commands done")
