#!/usr/bin/env python3
"""Runs what the documentation shows, and compares what comes out with what it shows.

Checked are README.md, CONTRIBUTING.md and docs/**/*.md:

- ```console blocks. A line `$ COMMAND` is run, and what follows it up to the next one is its output,
  standard error included. COMMAND begins with `tmcl`, or is `make run`, which stands for
  `tmcl serve tmcm-6214`. A `\\` at its end continues it on the next line. An output with a line
  `error: …` or `error[…` belongs to a command that fails, any other to one that succeeds.
- `tmcl serve` goes on running for the commands and the Python that follow in the same document: until
  the next `tmcl serve` that does not fail, or the end of the document; then Ctrl-C must end it well.
  What it prints before it serves is compared.
- ```python blocks after a line `<!-- run -->`. They run with the Python of the option --python, on the
  module that the document serves, or else on a new one. A ```text block right behind is the output.
- Any block after a line `<!-- file: NAME -->` is written to that file first.

Each document has a folder of its own, in which everything runs; transcripts are in `conformance`.

What differs from run to run:

- `/dev/pts/N` and `127.0.0.1:N` stand for the port of the served module, whatever N the document shows.
- `/home/me/lab` stands for the folder.
- `…` stands for any text within a line, a line `...` for any number of lines.
"""

import argparse
import contextlib
import difflib
import itertools
import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SHORTHAND = {"make run": "tmcl serve tmcm-6214"}
DEFAULT_SERVER = ["tmcl", "serve", "tmcm-6214"]
FOLDER = "/home/me/lab"
SERIAL = re.compile(r"/dev/pts/\d+")
SOCKET = re.compile(r"127\.0\.0\.1:\d+")
# How the last line begins that a server prints before it serves, in words and as JSON.
ANNOUNCED = ("ConnectionManager is", "{")
SECONDS = 30
DIFFERENCE_LINES = 60


class Mismatch(Exception):
    """Something is not as the document says."""


class Block:
    """A fenced block: its language, its lines, the line where they begin, and its mark."""

    def __init__(self, language, number, mark):
        self.language = language
        self.number = number
        self.mark = mark
        self.lines = []

    @property
    def text(self):
        return "\n".join(self.lines)


def blocks(text):
    """The fenced blocks of a document; a comment in the line before a fence is the block's mark."""
    found = []
    block = None
    mark = None
    for number, line in enumerate(text.splitlines(), 1):
        if block is not None:
            if line.strip() == "```":
                found.append(block)
                block = None
            else:
                block.lines.append(line)
        elif line.startswith("```"):
            block = Block(line[3:].strip(), number + 1, mark)
            mark = None
        elif line.strip():
            comment = re.fullmatch(r"<!-- (.*) -->", line.strip())
            mark = comment[1] if comment else None
            # Prose ends the reach of a run block's output.
            if comment is None:
                found.append(Block("prose", number, None))
    return found


def exchanges(block):
    """The commands of a console block, each with its line and its expected output."""
    found = []
    lines = iter(enumerate(block.lines, block.number))
    for number, line in lines:
        if line.startswith("$ "):
            command = line[2:]
            while command.endswith("\\"):
                command = command[:-1] + next(lines)[1].lstrip()
            found.append((number, command, []))
        elif found:
            found[-1][2].append(line)
        else:
            raise Mismatch("a console block begins with a command: `$ tmcl …`")
    return found


def pattern(expected):
    """What the lines of a document match, as a regular expression."""
    parts = []
    for line in expected:
        if line.strip() == "...":
            parts.append(r"(?:[^\n]*\n)*?")
        else:
            text = ".*?".join(re.escape(part) for part in line.rstrip().split("…"))
            parts.append(text + r"[ ]*\n")
    return "".join(parts)


def normal(text, folder):
    """Output without what differs from run to run."""
    text = text.replace(str(folder), FOLDER)
    return SOCKET.sub("127.0.0.1:4016", SERIAL.sub("/dev/pts/3", text))


def compare(expected, got, folder):
    while expected and not expected[-1].strip():
        expected = expected[:-1]
    shown = normal("\n".join(expected), folder).splitlines()
    got = normal(got, folder)
    if not re.fullmatch(pattern(shown), got):
        difference = difflib.unified_diff(shown, got.splitlines(), "document", "run", lineterm="")
        raise Mismatch("\n".join(itertools.islice(difference, DIFFERENCE_LINES)))


class Server:
    """`tmcl serve` while the document needs it."""

    def __init__(self, command, env, folder):
        # The port may be in use; the document's number stands for whichever is free.
        command = [SOCKET.sub("127.0.0.1:0", word) for word in command]
        self.process = subprocess.Popen(
            command, env=env, cwd=folder, text=True, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )
        self.output = ""

    def read_announcement(self):
        """Reads up to the line with which the announcement ends, or all that comes."""
        watchdog = threading.Timer(SECONDS, self.process.kill)
        watchdog.start()
        for line in self.process.stdout:
            self.output += line
            if line.startswith(ANNOUNCED):
                break
        watchdog.cancel()

    def substitute(self, text):
        """The same text with the ports of this server."""
        for port in (SERIAL, SOCKET):
            if real := port.search(self.output):
                text = port.sub(real[0], text)
        return text

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        try:
            self.process.communicate(timeout=SECONDS)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise Mismatch("tmcl serve does not end after Ctrl-C") from None
        if self.process.returncode != 0:
            raise Mismatch(f"tmcl serve ended with status {self.process.returncode}")

    def must_have_failed(self):
        try:
            status = self.process.wait(SECONDS)
        except subprocess.TimeoutExpired:
            self.process.kill()
            status = 0
        if status == 0:
            raise Mismatch("tmcl serve shall fail, and does not")


class Document:
    """A document on its way through."""

    def __init__(self, path, env, python, folder):
        self.path = path
        self.env = env
        self.python = python
        self.folder = Path(folder).resolve()
        (self.folder / "conformance").symlink_to(ROOT / "conformance")
        self.server = None
        self.counts = {"commands": 0, "Python examples": 0}
        self.problems = []

    def check(self):
        found = blocks(self.path.read_text(encoding="utf-8"))
        for block, following in zip(found, found[1:] + [None]):
            if block.mark and block.mark.startswith("file: "):
                (self.folder / block.mark[6:]).write_text(block.text + "\n", encoding="utf-8")
            if block.language == "console":
                with self.problem_at(block.number):
                    for number, command, expected in exchanges(block):
                        with self.problem_at(number):
                            self.run(command, expected)
            elif block.language == "python" and block.mark == "run":
                is_output = following is not None and following.language == "text"
                with self.problem_at(block.number):
                    self.run_python(block.text, following.lines if is_output else [])
        with self.problem_at("end"):
            self.stop_server()

    @contextlib.contextmanager
    def problem_at(self, number):
        try:
            yield
        except (Mismatch, OSError, ValueError) as problem:
            self.problems.append(f"{self.path.relative_to(ROOT)}:{number}: {problem}")
        except subprocess.TimeoutExpired as problem:
            self.problems.append(f"{self.path.relative_to(ROOT)}:{number}: {problem}")

    def run(self, command, expected):
        words = shlex.split(SHORTHAND.get(command, command))
        if words[:1] != ["tmcl"]:
            raise Mismatch(f"`{command}` is not run; put it into a block of another language")
        self.counts["commands"] += 1
        if words[1:2] == ["serve"] and "--help" not in words:
            self.serve(words, expected)
            return
        if self.server:
            words = [self.server.substitute(word) for word in words]
        done = subprocess.run(
            words, env=self.env, cwd=self.folder, text=True, timeout=SECONDS,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )
        compare(expected, done.stdout, self.folder)
        shall_fail = any(line.startswith(("error:", "error[")) for line in expected)
        if shall_fail != (done.returncode != 0):
            raise Mismatch(f"`{command}` ended with status {done.returncode}")

    def serve(self, words, expected):
        shall_fail = any(line.startswith("error:") for line in expected or [])
        if not shall_fail:
            self.stop_server()
        server = Server(words, self.env, self.folder)
        server.read_announcement()
        if shall_fail:
            server.must_have_failed()
        else:
            self.server = server
        if expected is not None:
            compare(expected, server.output, self.folder)

    def stop_server(self):
        if self.server:
            server, self.server = self.server, None
            server.stop()

    def run_python(self, text, expected):
        self.counts["Python examples"] += 1
        own = self.server is None
        if own:
            self.serve(DEFAULT_SERVER, None)
        done = subprocess.run(
            [self.python, "-c", self.server.substitute(text)], env=self.env, cwd=self.folder,
            text=True, timeout=SECONDS, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )
        if own:
            self.stop_server()
        if done.returncode != 0:
            raise Mismatch(f"the example fails:\n{done.stdout}")
        compare(expected, done.stdout, self.folder)


def main():
    parser = argparse.ArgumentParser(description="Runs what the documentation shows.")
    parser.add_argument("documents", nargs="*", type=Path, help="[default: all]")
    parser.add_argument(
        "--python", default=ROOT / ".venv/bin/python", type=Path,
        help="a Python that has PyTrinamic [default: .venv/bin/python]",
    )
    arguments = parser.parse_args()
    # Where the environment says, as for the client tests; otherwise the development build.
    tmcl = (ROOT / os.environ.get("TMCL", "target/debug/tmcl")).absolute()
    for needed, how in [(tmcl, "make program"), (arguments.python, "make venv")]:
        if not needed.exists():
            sys.exit(f"there is no {needed}; `{how}` makes it")
    env = os.environ | {"PATH": f"{tmcl.parent}{os.pathsep}{os.environ['PATH']}"}

    paths = [path.resolve() for path in arguments.documents] or [
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        *sorted((ROOT / "docs").rglob("*.md")),
    ]
    problems = []
    counts = {}
    for path in paths:
        with tempfile.TemporaryDirectory(prefix="tmcl-docs-") as folder:
            document = Document(path, env, arguments.python.absolute(), folder)
            document.check()
            problems += document.problems
            for what, count in document.counts.items():
                counts[what] = counts.get(what, 0) + count
    print(", ".join(f"{count} {what}" for what, count in counts.items()), "run")
    if not arguments.documents and not all(counts.values()):
        problems.append("nothing was checked")
    sys.exit("\n".join(problems) if problems else 0)


if __name__ == "__main__":
    main()
