"""What uvicorn itself lets through, over real sockets."""

import asyncio
import contextlib
import select
import socket
import threading
import time
from dataclasses import dataclass
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from drivers.clock import MonotonicClock
from vla_deploy.dashboard.access import UserRole, connections
from vla_deploy.dashboard.access.connections import Connections
from vla_deploy.dashboard.access.identity import Peer, peer_at
from vla_deploy.dashboard.access.session_expiry import CHECK_NS
from vla_deploy.dashboard.serving import HttpSocket, serve

FAR = peer_at("192.168.1.7")
HEAD_WITHIN_S = 0.3
FAR_TOO_MUCH = 40 * 2**20  # what the kernel keeps for both ends is less


class Idle:
    """A node with nothing to do."""

    period_s = 0.02

    def start(self):
        pass

    def step(self):
        pass

    def stop(self):
        pass


@dataclass
class Robot:
    """An application behind the dashboard's own server."""

    port: int
    bounds: Connections
    world: Any

    def call(self):
        called = socket.create_connection(("127.0.0.1", self.port), timeout=10)
        return contextlib.closing(called)

    def answer(self, sent):
        """Return what comes back until the other end hangs up."""
        with self.call() as called:
            called.sendall(sent)
            return until_closed(called)

    def until_held(self, count):
        for _ in range(500):
            if self.bounds.held == count:
                return
            time.sleep(0.01)  # another thread's event loop has to see it
        raise AssertionError(f"{self.bounds.held} connections, expected {count}")


def until_closed(called):
    data = b""
    with contextlib.suppress(ConnectionResetError):
        while more := called.recv(65536):
            data += more
    return data


@pytest.fixture
def robot(world):
    made = world(trust_loopback=True)
    listener = socket.create_server(("127.0.0.1", 0))
    bounds = Connections(3, 2, HEAD_WITHIN_S)
    ended = threading.Event()
    sockets = [HttpSocket(listener)]
    serving = serve(made.app, sockets, Idle(), MonotonicClock(), ended.is_set, bounds)
    thread = threading.Thread(target=asyncio.run, args=(serving,))
    thread.start()
    yield Robot(listener.getsockname()[1], bounds, made)
    ended.set()
    thread.join()
    listener.close()


@pytest.fixture
def from_afar(monkeypatch):
    """Every connection counts as one from another computer."""
    monkeypatch.setattr(connections, "peer_of", lambda scope: FAR)


def test_who_sends_a_head_byte_by_byte_is_hung_up_on(robot):
    with robot.call() as called:
        began_s = time.monotonic()
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            for byte in b"GET /api/v1/state HTTP/1.1\r\nX-Slow: " + 200 * b"a":
                called.sendall(bytes([byte]))
                time.sleep(0.05)  # the slowness is what the test is about
        assert time.monotonic() - began_s < 8


def test_who_sends_nothing_is_hung_up_on(robot):
    with robot.call() as called:
        assert until_closed(called) == b""


def test_who_asked_before_has_no_longer_for_the_next_head(robot):
    request = b"GET /api/v1/session HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with robot.call() as called:
        called.sendall(request + b"GET /api/v1/se")
        assert until_closed(called).count(b"HTTP/1.1 200") == 1


def test_a_head_without_end_is_refused(robot):
    answer = robot.answer(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + 70_000 * b"a")
    assert b"200" not in answer.split(b"\r\n")[0]


@pytest.mark.parametrize(
    "sent",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(200),
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET /api/v1/state HTTP/1.1\r\n\r\n",
        b"GET /api/v1/state HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
        b"GET /\xff\xfe HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"POST /api/v1/commands HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -1\r\n\r\n",
        b"POST /api/v1/commands HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-A: b\rSet-Cookie: vla_session=x\r\n\r\n",
        b"OPTIONS * HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"CONNECT evil.example:443 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET http://evil.example/api/v1/state HTTP/1.1\r\nHost: evil.example\r\n\r\n",
    ],
)
def test_what_is_no_request_of_ours_is_refused_and_nothing_breaks(robot, sent):
    status = robot.answer(sent.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n", 1))
    assert status.startswith(b"HTTP/1.1 4")
    assert b"Set-Cookie" not in status
    assert b"Traceback" not in status


def test_a_second_request_hidden_in_the_first_ones_body_is_not_served(robot):
    hidden = b"POST /api/v1/profile HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    sent = (
        b"POST /api/v1/commands HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n"
        b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(hidden)
    )
    assert robot.answer(sent + hidden).count(b"HTTP/1.1") == 1
    assert [told["act"] for told in robot.world.audit()] == ["POST (no route)"]


def test_a_body_that_never_comes_is_not_waited_for(robot, monkeypatch):
    monkeypatch.setattr("vla_deploy.dashboard.access.body.WITHIN_S", 0.2)
    answer = robot.answer(
        b"POST /api/v1/commands HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n{"
    )
    assert answer.startswith(b"HTTP/1.1 408")


def test_a_stop_whose_body_never_comes_is_pressed_at_once(robot):
    with robot.call() as called:
        called.sendall(
            b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n{"
        )
        assert called.recv(65536).startswith(b"HTTP/1.1 200")


def test_one_computer_takes_so_many_places_and_no_more(robot, from_afar):
    with robot.call(), robot.call():
        robot.until_held(2)
        assert robot.answer(b"GET /api/v1/session HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n") == b""
    robot.until_held(0)
    assert b"200 OK" in robot.answer(b"GET /api/v1/session HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")


def test_a_websocket_keeps_its_place_until_it_is_closed(robot, from_afar):
    with connect(f"ws://127.0.0.1:{robot.port}/api/v1/echo") as echo:
        echo.send("here")
        assert echo.recv() == "here"
        assert robot.bounds.held == 1
    robot.until_held(0)


def test_a_page_of_another_site_gets_no_websocket(robot):
    url = f"ws://127.0.0.1:{robot.port}/api/v1/live"
    with pytest.raises(InvalidStatus) as refused, connect(url, origin="http://evil.example"):
        pass
    assert refused.value.response.status_code == 403


def test_a_websocket_ends_with_the_token_that_opened_it(robot):
    token = robot.world.add_token("eyes", UserRole.VIEWER)
    url = f"ws://127.0.0.1:{robot.port}/api/v1/echo"
    with connect(url, additional_headers={"Authorization": f"Bearer {token}"}) as echo:
        echo.send("one")
        assert echo.recv() == "one"
        robot.world.access.accounts.change(lambda held: (held.without_token("eyes"), None))
        robot.world.clock.pass_s(CHECK_NS / 1e9)
        with pytest.raises(ConnectionClosed) as closed:
            echo.send("two")
            echo.recv()
    assert closed.value.rcvd.code == 1008


def test_this_computer_is_let_in_however_many_there_are():
    bounds = Connections(3, 2)
    by_socket = Peer(address="socket", is_loopback=False, is_socket=True)
    for number in range(5):
        bounds.enter(peer_at(f"10.0.0.{number}"))
    assert not bounds.enter(peer_at("10.0.0.9"))
    assert all(bounds.enter(peer) for peer in (peer_at("127.0.0.1"), peer_at("::1"), by_socket))


def test_addresses_of_one_home_count_together():
    bounds = Connections(10, 2)
    assert [bounds.enter(peer_at(f"2001:db8::{number}")) for number in (1, 2, 3)] == [
        True, True, False
    ]  # fmt: skip
    assert bounds.enter(peer_at("2001:db8:0:1::1"))


def test_a_client_that_pings_without_end_and_reads_nothing_is_not_heard_without_end(robot):
    ping = b"\x89\xfd" + bytes(4) + b"x" * 125
    with robot.call() as called:
        called.sendall(
            b"GET /api/v1/echo HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\n"
            b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
            b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        )
        assert called.recv(65536).startswith(b"HTTP/1.1 101")
        taken = 0
        while select.select([], [called], [], 0.5)[1] and taken < FAR_TOO_MUCH:
            taken += called.send(500 * ping)
        assert taken < FAR_TOO_MUCH
