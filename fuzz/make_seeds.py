"""Writes fuzz/seeds: for each target a few small inputs that lead it to interesting places.

Each target describes the form of its input at its beginning.
"""

import shutil
import struct
from pathlib import Path

SEEDS = Path(__file__).resolve().parent / "seeds"

ROR, MST, MVP, GAP, SGP, GGP, RFS = 1, 3, 4, 6, 9, 10, 13
CALC, COMP, JC, JA, CSUB, RSUB, EI, WAIT, STOP = 19, 20, 21, 22, 23, 24, 25, 27, 28
CALCX, AAP, AGP, CLE, VECT, RETI, ACO = 33, 34, 35, 36, 37, 38, 39
CALCVV, CALCVA, CALCAV, CALCVX, CALCXV, CALCV, MVPA, RST = 40, 41, 42, 43, 44, 45, 46, 48
DJNZ, ROLA, SIV, GIV, AIV = 49, 50, 55, 56, 57
STOP_PROGRAM, RUN, STEP, RESET, DOWNLOAD, DOWNLOAD_END, STATUS, VERSION = (
    128, 129, 130, 131, 132, 133, 135, 136)
POSITION = (GAP, 1, 0, 0)


def command(number, kind, motor, value):
    return struct.pack(">BBBi", number, kind, motor, value)


def write(target, **seeds):
    folder = SEEDS / target
    # Those of other targets may be written by hand.
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, data in seeds.items():
        (folder / name.replace("_", "-")).write_bytes(data)


# --- mnemonic: text ---------------------------------------------------------------------------

def mnemonics():
    write(
        "mnemonic",
        move=b"ROR 0, 51200",
        relative=b"MVP REL, 0, -10000",
        coordinate=b"MVP COORD, $47, 2",
        no_operand=b"CALC NOT",
        variables=b"CALCVV SUB, 65, 42",
        condition=b"JC GE, 10",
        wait=b"WAIT POS, 0, 0",
        comment=b"SAP 0x8C, %1, 8 // comment",
        number=b"129 1, 0, 5",
        bare=b"RSUB",
    )


# --- ascii: address, global parameter 67, keys ------------------------------------------------

CHARACTERS, LINE, OFF = 0x01, 0x11, 0x21


def ascii_keys():
    def terminal(echo, keys, address=1):
        return bytes([address, echo]) + keys

    write(
        "ascii",
        lines=terminal(CHARACTERS, b"AMVP ABS, 1, 50000\rA MST 1\r\na gap 1, 0\nABIN\r"),
        program=terminal(LINE, b"ZRUN 10\rZSTOP\rzrun\r", address=26),
        corrections=terminal(CHARACTERS, b"B\x08AMST 12\x7F\x7F\r A\x08\x08BMST 0\r"),
        others=terminal(OFF, b"BMST 0\r\r\n\xc1MST 0\rAMST\xe4 0\r"),
        mistakes=terminal(LINE, b"A\rAGO\rAMVP FAST, 0, 1\rAMST 256\rAWAIT 0, 0, 0\rA3 0, 0, 0\r"),
        surplus=terminal(OFF, b"AGCO 0, 255, 5\rARFS STATUS, $2 // comment\rAUF7\r"),
        too_long=terminal(LINE, b"AMST 1" + b" " * 75 + b"\rAMST 1" + b" " * 74 + b"\r"),
        no_letter=terminal(CHARACTERS, b"[MST 0\r{MST 0\r", address=27),
    )


# --- decoder: a good frame's content, then pairs of gap and byte ------------------------------

def frame(address, *fields):
    body = bytes([address]) + command(*fields)
    return body + bytes([sum(body) & 0xFF])


def stream(*runs):
    """Runs of bytes, each after a gap."""
    data = bytes([1]) + command(*POSITION)
    for gap, run in runs:
        for at, byte in enumerate(run):
            data += bytes([0 if at else gap, byte])
    return data


def decoder():
    good = frame(1, ROR, 0, 0, 51200)
    damaged = good[:8] + bytes([good[8] ^ 1])
    write(
        "decoder",
        two_frames=stream((0, good), (10, good)),
        damaged=stream((0, damaged), (0, good)),
        half_and_silence=stream((0, good[:4]), (126, good)),
        longest_gap=stream((0, good[:4]), (125, good[4:])),
        stray_byte=stream((0, b"\x55" + good), (200, good)),
    )


# --- interpreter: module, start, length, program, steps of the host ---------------------------

def program(commands, *steps):
    data = bytes([0, 0, len(commands)])
    data += b"".join(command(*fields) for fields in commands)
    return data + b"".join(bytes([wait]) + command(*fields) for wait, fields in steps)


def interpreter():
    write(
        "interpreter",
        loop=program(
            [(SGP, 0, 2, 20), (CALC, 0, 0, 3), (DJNZ, 0, 0, 1), (STOP, 0, 0, 0)],
            (50, POSITION), (200, (GGP, 0, 2, 0)),
        ),
        shuttle=program(
            [
                (VECT, 0, 0, 8), (SGP, 0, 3, 10), (EI, 0, 0, 0), (EI, 255, 0, 0),
                (MVP, 0, 0, 2000), (WAIT, 1, 0, 0), (CSUB, 0, 0, 12), (JA, 0, 0, 4),
                (GGP, 1, 2, 0), (CALC, 0, 0, 1), (AGP, 1, 2, 0), (RETI, 0, 0, 0),
                (GGP, 0, 2, 0), (CALC, 0, 0, 1), (AGP, 0, 2, 0), (RSUB, 0, 0, 0),
            ],
            *[(200, POSITION)] * 8,
        ),
        arithmetic=program(
            [
                (CALC, 9, 0, 7), (CALCX, 10, 0, 0), (CALC, 3, 0, 0), (CALC, 4, 0, 0),
                (CALCX, 2, 0, 0), (CALCVV, 0, 1, 2), (CALCVA, 1, 3, 0), (CALCAV, 2, 3, 0),
                (CALCVX, 3, 1, 0), (CALCXV, 4, 1, 0), (CALCV, 6, 1, 5), (COMP, 0, 0, 7),
                (JC, 2, 0, 0), (CLE, 0, 0, 0),
            ],
            (30, (STATUS, 2, 0, 0)), (30, (STATUS, 3, 0, 0)),
        ),
        accumulator=program(
            [
                (CALC, 9, 0, 1000), (MVPA, 0, 0, 0), (WAIT, 0, 0, 5), (AAP, 4, 0, 0),
                (ROLA, 0, 0, 0), (MST, 0, 0, 0), (SIV, 3, 0, 0), (GIV, 3, 0, 0), (AIV, 3, 0, 0),
                (ACO, 1, 0, 0), (RST, 0, 0, 0),
            ],
            *[(100, POSITION)] * 3,
        ),
        waits=program(
            [
                (MVP, 0, 0, 5000), (WAIT, 1, 0, 1), (CLE, 0, 0, 0), (WAIT, 0, 0, 2),
                (WAIT, 2, 0, 1), (WAIT, 3, 0, 1), (RFS, 0, 0, 0), (WAIT, 4, 0, 3),
            ],
            *[(200, POSITION)] * 3,
        ),
        jump_out_of_range=program(
            [(JA, 0, 0, 5000)], (20, (STATUS, 1, 0, 0)), (20, (RUN, 0, 0, -1))
        ),
        recursion=program([(CSUB, 0, 0, 0)], (100, POSITION)),
        stray_returns=program([(RSUB, 0, 0, 0), (RETI, 0, 0, 0)], (20, POSITION)),
        host_controls=program(
            [(JA, 0, 0, 0)],
            (5, (STOP_PROGRAM, 0, 0, 0)), (1, (STEP, 0, 0, 0)), (1, (RUN, 0, 0, 0)),
            (5, (RESET, 0, 0, 0)), (1, (DOWNLOAD, 0, 0, 0)), (1, (STOP, 0, 0, 0)),
            (1, (DOWNLOAD_END, 0, 0, 0)), (1, (VERSION, 1, 0, 0)),
        ),
    )


# --- parameters: module, then steps with a number of ACTIONS for the command ------------------

ACTIONS = "SAP SGP SIO SCO GIO STGP RSGP CCO ROR ROL MVP MST RFS POWER".split()


def steps(*lines):
    """Steps as milliseconds and `NAME type, motor, value`."""
    data = bytes([0])
    for milliseconds, line in lines:
        name, _, operands = line.partition(" ")
        kind, motor, value = (int(operand) for operand in operands.split(","))
        data += bytes([milliseconds]) + command(ACTIONS.index(name), kind, motor, value)
    return data


def parameters():
    write(
        "parameters",
        axis=steps(
            (0, "SAP 4, 0, 1000"), (0, "SAP 5, 0, 51200"), (0, "SAP 140, 0, 9"),
            (0, "SAP 1, 5, -1"), (0, "SAP 255, 0, 0"), (0, "SAP 99, 0, 1"), (0, "SAP 4, 6, 1"),
        ),
        ramp=steps(
            (0, "SAP 18, 0, 0"), (0, "SAP 20, 0, 0"), (0, "SAP 19, 0, 1000"),
            (0, "SAP 16, 0, 0"), (0, "MVP 0, 0, 2000"), (200, "SAP 4, 0, 100"),
            (200, "MST 0, 0, 0"),
        ),
        motion=steps(
            (0, "ROR 0, 0, 51200"), (100, "MVP 0, 0, -100"), (100, "ROL 0, 0, 51200"),
            (50, "MVP 1, 0, 2147483647"), (10, "MST 0, 0, 0"),
        ),
        globals=steps(
            (0, "SGP 66, 0, 7"), (0, "SGP 5, 2, 42"), (0, "STGP 5, 2, 0"), (0, "SGP 5, 2, 1"),
            (0, "RSGP 5, 2, 0"), (0, "SGP 133, 0, 1"), (0, "SGP 81, 0, 3"),
            (0, "SGP 0, 3, 1000"), (0, "POWER 0, 0, 0"),
        ),
        ports=steps(
            (0, "SIO 3, 2, 1"), (0, "SIO 255, 2, 165"), (0, "SIO 0, 0, 15"), (0, "GIO 0, 1, 0"),
            (0, "GIO 255, 0, 0"), (0, "SIO 8, 2, 1"),
        ),
        coordinates=steps(
            (0, "SGP 84, 0, 1"), (0, "SCO 1, 0, 25600"), (0, "MVP 2, 0, 1"),
            (100, "CCO 2, 0, 0"), (0, "SCO 255, 0, 5"), (0, "SCO 0, 255, 0"),
        ),
        search=steps(
            (0, "SAP 193, 0, 1"), (0, "RFS 0, 0, 0"), (50, "RFS 2, 0, 0"), (0, "RFS 1, 0, 0")
        ),
    )


# --- scenario: a scenario, `---`, lines to its modules -----------------------------------------

STAGE = """\
[[module]]
name = "xy"
model = "tmcm-6214"
supply = "24 V"
start = ["input 3 high", "analog 0 2 V"]
[[module.axis]]
axis = 3
motor = "qsh4218-51-10-049"
transmission = { screw = "5 mm", gear = 2 }
backlash = "0.02 mm"
load = { mass = "2.4 kg", friction = "3 N", viscous = "20 N s/m", gravity = "negative", \
springs = [{ rate = "2 N/mm", rest = "10 mm" }], along = [["0 mm", "0 N"], ["9 mm", "-5 N"]] }
stage = { from = "-10 mm", to = "210 mm", start = "50 mm" }
left = { at = "0 mm", hysteresis = "0.1 mm", bounce = "2 ms" }
right = { at = "200 mm", contact = "normally closed" }
home = { at = "100 mm", width = "4 mm" }
encoder = { counts = 4000, index = "1.2 mm", reversed = true, on = "stage" }
"""
TURNTABLE = """\
[module]
model = "tmcm-6214"
eeprom = "a.bin"
axis = [{ axis = 0, motor = { full_steps = 400, resistance = "2 ohm", inductance = "3 mH", \
holding_torque = "50 Ncm", rated_current = "1 A", inertia = "57 g cm²" }, \
transmission = { gear = 10 }, stage = { circular = true } }]
at = [{ time = "10 ms", do = "block axis 0" }, { time = "5 ms", do = ["power off", "power on"] }]
wave = [{ shape = "sine", low = "load axis 0 0 Nm", high = "load axis 0 0.1 Nm", period = "50 ms" }]
port = [{ pty = "/dev/xy", faults = "drop 1%" }, { tcp = "4016" }]
"""


def scenario():
    def lines(*actions):
        return ("---\n" + "\n".join(actions) + "\n").encode()

    write(
        "scenario",
        stage=STAGE.encode() + lines(
            "press left axis 3", "set position axis 3 12.5 mm", "load axis 3 5 N", "free home axis 0",
            "state", "disconnect coil B axis 4", "temperature driver 120 axis 1", "torque off input 1",
        ),
        turntable=TURNTABLE.encode() + lines(
            "supply 18 V", "unblock axis 0", "power cycle", "scenario", "help", "watch 20", "unwatch",
            "tmcm-6214: faults pty drop 2%", "analog 4 2048", "input 3 low", "schema",
        ),
        mistakes=b"[[module]]\nmodle = \"tmcm-6214\"\n[[module.axis]]\nmotor = 5\n",
        no_toml=b"[[module]\nmodel = \"tmcm\n",
    )


if __name__ == "__main__":
    mnemonics()
    ascii_keys()
    decoder()
    interpreter()
    parameters()
    scenario()
