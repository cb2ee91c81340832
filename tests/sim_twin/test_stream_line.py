import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_twin.ports.stream_line import StreamLine


class Loudspeaker:
    def __init__(self) -> None:
        self.heard = b""
        self.to_say = b""

    def receive(self, data: bytes) -> None:
        self.heard += data

    def transmit(self) -> bytes:
        said, self.to_say = self.to_say, b""
        return said

    def step(self, now_ns: int) -> None: ...


@pytest.fixture
def device() -> Loudspeaker:
    return Loudspeaker()


@pytest.fixture
def hang_ups() -> list[str]:
    return []


@pytest.fixture
def line(tmp_path: Path, device: Loudspeaker, hang_ups: list[str]) -> Iterator[StreamLine]:
    line = StreamLine(device, tmp_path / "s", lambda: hang_ups.append("gone"))
    yield line
    line.close()


def connect(tmp_path: Path) -> socket.socket:
    client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    client.settimeout(5)
    client.connect(str(tmp_path / "s"))
    return client


def test_bytes_go_both_ways(line: StreamLine, device: Loudspeaker, tmp_path: Path) -> None:
    with connect(tmp_path) as client:
        client.sendall(b"start")
        device.to_say = b"frame"
        line.poll_once()
        assert device.heard == b"start"
        assert client.recv(100) == b"frame"


def test_what_is_ready_is_sent_to_the_client_that_is_there(
    line: StreamLine, device: Loudspeaker, tmp_path: Path, hang_ups: list[str]
) -> None:
    device.to_say = b"frame"
    line.send_once()
    assert device.to_say == b"frame"
    with connect(tmp_path) as client:
        line.poll_once()
        client.sendall(b"start")
        assert client.recv(100) == b"frame"
        device.to_say = b"next"
        line.send_once()
        assert client.recv(100) == b"next"
        assert device.heard == b""
    device.to_say = b"for nobody"
    line.send_once()
    assert hang_ups == ["gone"]


def test_a_slow_client_backs_the_line_up_and_gets_everything_in_order(
    line: StreamLine, device: Loudspeaker, tmp_path: Path
) -> None:
    frame = bytes(range(256)) * 4096
    with connect(tmp_path) as client:
        device.to_say = frame
        line.poll_once()
        assert line.is_backed_up
        assert line.output_filenos()
        got = b""
        while len(got) < len(frame):
            got += client.recv(65_536)
            line.poll_once()
        assert got == frame
        assert not line.is_backed_up


def test_the_device_is_notified_that_its_client_has_gone(
    line: StreamLine, device: Loudspeaker, tmp_path: Path, hang_ups: list[str]
) -> None:
    with connect(tmp_path):
        line.poll_once()
    device.to_say = b"for nobody"
    line.poll_once()
    assert hang_ups == ["gone"]
    with connect(tmp_path) as client:
        device.to_say = b"new"
        line.poll_once()
        assert client.recv(100) == b"new"


def test_a_new_client_takes_over(
    line: StreamLine, device: Loudspeaker, tmp_path: Path, hang_ups: list[str]
) -> None:
    with connect(tmp_path) as old, connect(tmp_path) as new:
        line.poll_once()
        line.poll_once()
        device.to_say = b"x"
        line.poll_once()
        assert new.recv(10) == b"x"
        assert old.recv(10) == b""
    assert hang_ups == ["gone"]
