import pytest
from pytrinamic.modules import TMCM6214

from server import Server

# How much faster than real time a module runs in tests that are not about time.
FAST = 20


@pytest.fixture
def serve():
    """Starts servers that end with the test; each must end cleanly."""
    servers = []

    def start(*options):
        servers.append(Server(*options))
        return servers[-1]

    yield start
    assert [server.stop() for server in servers] == [0] * len(servers)


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
