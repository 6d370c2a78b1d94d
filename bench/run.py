"""Measures, prints a table and writes target/bench/summary.json: `make bench`.

Each row is measured beside its reference in the same run, so that a slow or a busy machine does not
matter. What needs no other process is measured by the Rust program in bench/src.
"""

import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "python"))

from pytrinamic.connections import ConnectionManager  # noqa: E402
from server import Server  # noqa: E402

OUTPUT = ROOT / "target" / "bench"
BENCH = ROOT / os.environ.get("BENCH", "target/release/opentmcl-bench")


class NotMeasured(Exception):
    """Why a row has no value."""


class Row:
    """One row of the table.

    `measure` returns a value or a pair of value and note. The budget is a limit of the value, or,
    with a reference, of the ratio of the value to that of the reference.
    """

    def __init__(self, name, unit, measure, reference=None, at_least=None, at_most=None):
        self.name = name
        self.unit = unit
        self.measure = measure
        self.reference = reference
        self.at_least = at_least
        self.at_most = at_most

    def run(self):
        try:
            value, reference_value, note = self.measure()
        except NotMeasured as reason:
            value, reference_value, note = None, None, f"not measured: {reason}"
        ratio = value / reference_value if value is not None and reference_value else None
        return {
            "name": self.name,
            "value": value,
            "unit": self.unit,
            "reference": self.reference,
            "reference_value": reference_value,
            "ratio": ratio,
            "budget": self.budget(),
            "ok": self.judge(ratio if self.reference else value),
            "note": note,
        }

    def budget(self):
        of = "ratio" if self.reference else "value"
        if self.at_least is not None:
            return f"{of} >= {self.at_least:g}"
        if self.at_most is not None:
            return f"{of} <= {self.at_most:g}"
        return None

    def judge(self, number):
        """Whether the budget is met; None where there is none or nothing was measured."""
        if number is None or (self.at_least is None and self.at_most is None):
            return None
        return number >= self.at_least if self.at_least is not None else number <= self.at_most


def rust(name):
    """A measurement of the Rust program."""

    def measure():
        result = subprocess.run([BENCH, name], check=True, capture_output=True, text=True)
        line = json.loads(result.stdout)
        return line["value"], None, line["note"]

    return measure


# --- GAP over a pseudo-terminal ---------------------------------------------------------------

PTY_SLICES = 41
PTY_SLICE_REQUESTS = 400


def responder():
    """The C program of bench/reference, compiled and started; its process and its port."""
    compiler = os.environ.get("CC", "cc")
    if not shutil.which(compiler):
        raise NotMeasured("no C compiler")
    binary = OUTPUT / "pty_responder"
    source = ROOT / "bench" / "reference" / "pty_responder.c"
    subprocess.run([compiler, "-O2", "-o", binary, source], check=True)
    process = subprocess.Popen([binary], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
    return process, process.stdout.readline().decode().strip()


def pin(process, core):
    """Keeps all threads of a process on one core."""
    for thread in os.listdir(f"/proc/{process}/task"):
        os.sched_setaffinity(int(thread), {core})


def requests_per_second(connection):
    start = time.perf_counter()
    for _ in range(PTY_SLICE_REQUESTS):
        connection.get_axis_parameter(1, 0)
    return PTY_SLICE_REQUESTS / (time.perf_counter() - start)


def gap_over_pty():
    """The same client takes turns with both servers, so that both see the same noise."""
    cores = os.sched_getaffinity(0)
    if len(cores) < 2:
        raise NotMeasured("needs two cores")
    client_core, server_core = sorted(cores)[:2]
    reference, port = responder()
    server = Server()
    try:
        pin(reference.pid, server_core)
        pin(server.process.pid, server_core)
        os.sched_setaffinity(0, {client_core})
        connect = ConnectionManager(f"--interface serial_tmcl --port {port}").connect
        with server.connect("pty") as ours, connect() as theirs:
            for connection in (ours, theirs):
                requests_per_second(connection)
            pairs = [
                (requests_per_second(ours), requests_per_second(theirs))
                for _ in range(PTY_SLICES)
            ]
    finally:
        os.sched_setaffinity(0, cores)
        server.stop()
        reference.kill()
        reference.wait()
        reference.stdout.close()
    value, reference_value = (statistics.median(column) for column in zip(*pairs))
    ratios = sorted(ours / theirs for ours, theirs in pairs)
    note = f"ratio of turns: median {statistics.median(ratios):.3f}, all {ratios[0]:.3f}"
    return value, reference_value, f"{note}..{ratios[-1]:.3f}"


# --- The interpreter beside Lua ---------------------------------------------------------------

LUA_ITERATIONS = 20_000_000
LUA_ROUNDS = 7
LUA_GLOBALS = "v={0} a=0 local t=os.clock() while v>0 do a=a+3; v=v-1 end print(os.clock()-t)"
LUA_LOCALS = "local v,a={0},0 local t=os.clock() while v>0 do a=a+3; v=v-1 end print(os.clock()-t)"


def lua():
    """Lua 5.4, installed if that is possible without asking."""
    for name in ("lua5.4", "lua54", "lua"):
        if shutil.which(name):
            version = subprocess.run([name, "-v"], capture_output=True, text=True).stdout
            if version.startswith("Lua 5.4"):
                return name
    if os.geteuid() == 0 and shutil.which("apt-get"):
        quiet = {"stdin": subprocess.DEVNULL, "capture_output": True}
        for command in (["update"], ["install", "-y", "--no-install-recommends", "lua5.4"]):
            subprocess.run(["apt-get", *command], **quiet)
        if shutil.which("lua5.4"):
            return "lua5.4"
    raise NotMeasured("no Lua 5.4; on Debian and Ubuntu: sudo apt-get install lua5.4")


def interpreter_beside_lua(script):
    def measure():
        program = lua()
        ours, theirs = [], []
        for _ in range(LUA_ROUNDS):
            seconds = subprocess.run(
                [program, "-e", script.format(LUA_ITERATIONS // LUA_ROUNDS)],
                check=True, capture_output=True, text=True,
            ).stdout
            theirs.append(LUA_ITERATIONS // LUA_ROUNDS / float(seconds))
        for _ in range(3):
            ours.append(rust("interpreter")()[0])
        return statistics.median(ours), statistics.median(theirs), ""

    return measure


# --- The assembler beside GNU as --------------------------------------------------------------

AS_LINES = 100_000
AS_ROUNDS = 5


def as_piece(number):
    """What bench/src/assembler.rs assembles, as near as x86 comes to it."""
    return f"""\
.set speed{number}, {number} * 10 + 100
.set count{number}, 42 # a variable
# approach and wait
loop{number}:
\tmovl $speed{number}, 16(%rdi)
\tmovl $50000, 20(%rdi) # pps2
\tmovl $-512000, %eax
\tcall wait
\tmovl count{number}(%rdi), %eax
\taddl $1, %eax
\tmovl %eax, count{number}(%rdi) # one more
\tcmpl $100, %eax
\tjge done{number}
\ttestl $3, (%rsi)
\tjz loop{number} # until the switch closes
\timull $-1, %eax
\tmovl %eax, 16(%rdi)
\tmovl %eax, %ebx
\tjmp loop{number}
done{number}: # both ways lead here
\tcall loop{number}
"""


def assembler_beside_gnu_as():
    value, _, note = rust("assembler")()
    if os.uname().machine != "x86_64" or not shutil.which("as"):
        return value, None, f"{note}; no GNU as for x86-64 to compare with"
    text = "wait:\n" + "".join(as_piece(number) for number in range(AS_LINES // 21))
    source, output = OUTPUT / "lines.s", OUTPUT / "lines.o"
    source.write_text(text)
    seconds = []
    for _ in range(AS_ROUNDS):
        start = time.perf_counter()
        subprocess.run(["as", "-o", output, source], check=True)
        seconds.append(time.perf_counter() - start)
    theirs = text.count("\n") / statistics.median(seconds)
    return value, None, f"{note}; GNU as on similar lines: {theirs:.3g}/s, ratio {value / theirs:.1f}"


# --- A servo beside other simulators -----------------------------------------------------------

SIMULATORS = ("motulator", "gym-electric-motor")
SERVO_ROUNDS = 3


def servo_beside_simulators():
    """The best of some turns of each, by the time of the processor."""
    program = ROOT / "bench" / "reference" / "servo_simulators.py"
    best = {name: 0 for name in SIMULATORS}
    ours = []
    for _ in range(SERVO_ROUNDS):
        ours.append(rust("field-oriented")())
        for name in SIMULATORS:
            result = subprocess.run(
                [sys.executable, program, name], check=True, capture_output=True, text=True)
            best[name] = max(best[name], float(result.stdout))
    value, _, note = max(ours)
    others = "; ".join(
        f"{name}: {theirs:.2g}, ratio {value / theirs:.0f}" for name, theirs in best.items())
    return value, None, f"{note}; {others}"


# --- A served module that stands still --------------------------------------------------------

REST_SECONDS = 3


def context_switches(process):
    """How often the threads of a process have gone to sleep by themselves."""
    total = 0
    for thread in os.listdir(f"/proc/{process}/task"):
        status = Path(f"/proc/{process}/task/{thread}/status").read_text()
        total += int(re.search(r"^voluntary_ctxt_switches:\s+(\d+)", status, re.M)[1])
    return total


def wakeups_at_rest():
    server = Server()
    try:
        with server.connect("pty") as connection:
            connection.get_axis_parameter(1, 0)
        time.sleep(0.5)
        before = context_switches(server.process.pid)
        time.sleep(REST_SECONDS)
        count = context_switches(server.process.pid) - before
    finally:
        server.stop()
    return count / REST_SECONDS, None, f"{count} in {REST_SECONDS} s"


# --- The table --------------------------------------------------------------------------------

ROWS = [
    Row(
        "GAP over a pty with PyTrinamic", "requests/s", gap_over_pty,
        reference="the same client and a bare responder in C", at_least=0.95,
    ),
    Row("own work per request", "us", rust("own-work-per-request"), at_most=5),
    Row("GAP in process, Rust", "requests/s", rust("gap-in-process"), at_least=5e6),
    Row(
        "interpreter, CALC ADD and DJNZ", "iterations/s", interpreter_beside_lua(LUA_GLOBALS),
        reference="Lua 5.4, while v>0 do a=a+3; v=v-1 end", at_least=1,
    ),
    Row(
        "interpreter beside Lua's local variables", "iterations/s",
        interpreter_beside_lua(LUA_LOCALS),
        reference="the same loop on local variables of Lua",
    ),
    Row("assembler, text to bytes", "lines/s", assembler_beside_gnu_as, at_least=5e6),
    Row("assembler, a program of 2048 commands", "ms", rust("assembler-full-memory"), at_most=0.5),
    Row("one hour of program and motion on six axes", "x real time", rust("six-axis-hour"),
        at_least=1e6),
    Row("the same with six loaded axes, switches and encoders", "x real time", rust("loaded-hour"),
        at_least=1e5),
    Row("FOC servo at 20 kHz with motor model", "x real time", servo_beside_simulators,
        at_least=500),
    Row("the same with block commutation", "x real time", rust("block-commutation"), at_least=500),
    Row("memory of a module", "bytes", rust("module-memory"), at_most=64 * 1024),
    Row("10000 modules polled every 10 ms", "% of 2 cores", rust("fleet"), at_most=100),
    Row("wake-ups of a served module at rest", "1/s", wakeups_at_rest, at_most=0),
    Row("garbage through the decoder in step", "bytes", rust("garbage"), at_least=1e9),
]


def shown(number):
    if number is None:
        return "-"
    if number != 0 and (abs(number) >= 1e5 or abs(number) < 0.01):
        return f"{number:.3g}"
    return f"{number:.2f}".rstrip("0").rstrip(".")


def print_row(row):
    verdict = {True: "ok", False: "MISSED", None: ""}[row["ok"]]
    cells = (row["name"], shown(row["value"]), row["unit"], shown(row["reference_value"]),
             shown(row["ratio"]), row["budget"] or "", verdict)
    print("{:<43} {:>9} {:<13} {:>9} {:>7}  {:<17} {}".format(*cells), flush=True)
    for key in ("reference", "note"):
        if row[key]:
            print(f"    {key}: {row[key]}", flush=True)


def main():
    OUTPUT.mkdir(parents=True, exist_ok=True)
    print("{:<43} {:>9} {:<13} {:>9} {:>7}  {}".format(
        "what", "value", "unit", "reference", "ratio", "budget"))
    rows = []
    for row in ROWS:
        rows.append(row.run())
        print_row(rows[-1])
    (OUTPUT / "summary.json").write_text(json.dumps(rows, indent=2) + "\n")
    missed = [row["name"] for row in rows if row["ok"] is False]
    print(f"\n{len(missed)} budgets missed" + "".join(f"\n  {name}" for name in missed))


if __name__ == "__main__":
    main()
