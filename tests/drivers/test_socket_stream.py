"""A Unix stream carries bytes, and its loss is reported at once."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from drivers.errors import DeviceMissing, LinkLost
from drivers.socket_stream import SocketStream

CLOCK = MonotonicClock()


@pytest.fixture
def ends(tmp_path: Path) -> Iterator[tuple[SocketStream, socket.socket]]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as server:
        server.bind(str(tmp_path / "camera"))
        server.listen(1)
        stream = SocketStream(tmp_path / "camera", CLOCK)
        device, _ = server.accept()
        with device:
            yield stream, device
        stream.close()


def soon(seconds: float) -> int:
    return CLOCK.now_ns() + round(seconds * 1e9)


def test_bytes_pass_both_ways(ends: tuple[SocketStream, socket.socket]) -> None:
    stream, device = ends
    stream.write(b"frame?")
    assert device.recv(100) == b"frame?"
    device.sendall(b"frame!")
    assert stream.read(100, soon(1.0)) == b"frame!"
    assert stream.read(100, soon(0.01)) == b""


def test_discarded_input_is_gone(ends: tuple[SocketStream, socket.socket]) -> None:
    stream, device = ends
    device.sendall(b"stale" * 1000)
    stream.discard_input()
    assert stream.read(100, 0) == b""


def test_a_socket_without_a_server_is_missing(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match=r"camera.*start what serves it"):
        SocketStream(tmp_path / "camera", CLOCK)


def test_a_closed_other_end_is_a_lost_link(ends: tuple[SocketStream, socket.socket]) -> None:
    stream, device = ends
    device.close()
    with pytest.raises(LinkLost, match="reconnect"):
        stream.read(1, soon(5.0))
    with pytest.raises(LinkLost, match="reconnect"):
        stream.write(b"x")


def test_an_other_end_that_does_not_read_is_given_up(
    ends: tuple[SocketStream, socket.socket],
) -> None:
    stream, _ = ends
    with pytest.raises(LinkLost, match="reconnect"):
        stream.write(bytes(10_000_000))
