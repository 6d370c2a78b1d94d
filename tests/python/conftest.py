import contextlib
from pathlib import Path

import pytest
from pytrinamic.modules import TMCM6214

from server import Server
from world import World

# How much faster than real time a module runs in tests that are not about time.
FAST = 20


@pytest.fixture
def serve():
    """Starts servers that end with the test; each must end cleanly."""
    servers = []

    def start(*options, **what):
        servers.append(Server(*options, **what))
        return servers[-1]

    yield start
    assert [server.stop() for server in servers] == [0] * len(servers)


class Bench:
    """A module with machines, and the world around it."""

    def __init__(self, connection, world):
        self.connection = connection
        self.module = TMCM6214(connection)
        self.world = world

    def get(self, parameter, axis):
        return self.connection.get_axis_parameter(parameter, axis, signed=True)

    def set(self, axis, parameters):
        """Sets several axis parameters, by their numbers."""
        for number, value in parameters.items():
            self.connection.set_axis_parameter(number, axis, value)


@pytest.fixture
def bench(serve):
    """Starts a scenario of this folder, and connects to its first module and its world."""
    with contextlib.ExitStack() as stack:

        def start(scenario, speed=FAST):
            server = serve("--speed", speed, what=Path(__file__).with_name(scenario))
            connection = stack.enter_context(server.connect("tcp"))
            return Bench(connection, stack.enter_context(World(server.world)))

        yield start


@pytest.fixture(params=["pty", "tcp"])
def line(request):
    """The two lines on which a served module listens."""
    return request.param


@pytest.fixture
def connection(serve, line):
    """A connection to a fresh module in real time."""
    with serve().connect(line) as connection:
        yield connection


@pytest.fixture
def module(connection):
    """A fresh module in real time."""
    return TMCM6214(connection)


@pytest.fixture
def fast_connection(serve, line):
    """A connection to a fresh module that runs `FAST` times as fast."""
    with serve("--speed", FAST).connect(line) as connection:
        yield connection


@pytest.fixture
def fast_module(fast_connection):
    """A fresh module that runs `FAST` times as fast."""
    return TMCM6214(fast_connection)
