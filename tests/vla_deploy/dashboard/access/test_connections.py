"""What uvicorn itself lets through, over real sockets."""

import asyncio
import contextlib
import errno
import queue
import select
import socket
import ssl
import threading
import time
from dataclasses import dataclass
from typing import Any

import pytest
from fastapi import FastAPI
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from drivers.clock import MonotonicClock
from vla_deploy.dashboard import accepting, door_probe
from vla_deploy.dashboard.access import UserRole
from vla_deploy.dashboard.access.connections import ConnectionLimits, Connections, PeerGroup
from vla_deploy.dashboard.access.identity import Peer, peer_at, unknown_user
from vla_deploy.dashboard.access.read_turns import ReadTurns
from vla_deploy.dashboard.access.session_expiry import CHECK_NS
from vla_deploy.dashboard.api import operate
from vla_deploy.dashboard.door_probe import DoorProbe
from vla_deploy.dashboard.errors import AccessDenied
from vla_deploy.dashboard.serving import HttpSocket, serve

FAR = peer_at("192.168.1.7")
HEAD_WITHIN_S = 0.3
SMALL = {PeerGroup.NETWORK: 3, PeerGroup.LOOPBACK: 2, PeerGroup.SOCKET: 1}
LIMITS = ConnectionLimits(most=SMALL, per_address=2)
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
        with contextlib.suppress(ConnectionError), self.call() as called:
            called.sendall(sent)
            return until_closed(called)
        return b""

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


@contextlib.contextmanager
def serving(app, listener, bounds, tls=None, press=lambda _: False):
    """Serve an application in a thread; give the port."""
    with listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        ended = threading.Event()
        sockets = [HttpSocket(listener, tls)]
        served = serve(app, sockets, Idle(), MonotonicClock(), ended.is_set, bounds, press=press)
        thread = threading.Thread(target=asyncio.run, args=(served,))
        thread.start()
        port = listener.getsockname()[1]
        try:
            yield port
        finally:
            ended.set()
            thread.join()


@pytest.fixture
def robot(world):
    made, bounds = world(trust_loopback=True), Connections(LIMITS, HEAD_WITHIN_S)
    with serving(made.app, socket.socket(), bounds) as port:
        yield Robot(port, bounds, made)


@pytest.fixture
def from_afar(monkeypatch):
    """Every connection counts as one from another computer."""
    monkeypatch.setattr(accepting, "peer_at", lambda address: FAR)


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


SESSION = b"GET /api/v1/session HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"


def test_who_holds_every_place_and_says_nothing_keeps_nobody_out(robot):
    with robot.call() as oldest, robot.call() as other:
        robot.until_held(2)
        assert b"200 OK" in robot.answer(SESSION)
        assert until_closed(oldest) == b""
        assert other.fileno() >= 0
    assert robot.bounds.crowded_out == 1


def test_one_address_takes_so_many_places_that_it_uses_and_no_more(robot, from_afar):
    url = f"ws://127.0.0.1:{robot.port}/api/v1/echo"
    with connect(url) as one, connect(url) as other:
        assert robot.answer(SESSION) == b""
        one.send("here")
        assert one.recv() == "here"
        other.close()
    robot.until_held(0)
    assert b"200 OK" in robot.answer(SESSION)


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


def entered(bounds, *peers):
    """Return for each peer whether there was room; each uses its place."""
    found = []
    for peer in peers:
        slot = bounds.enter(peer, lambda: None)
        found.append(slot is not None)
        if slot is not None:
            slot.is_waiting = False
    return found


def test_neither_network_nor_loopback_nor_socket_takes_the_places_of_another():
    bounds, by_socket = Connections(LIMITS), Peer(address="", is_loopback=False, is_socket=True)
    far = [peer_at(f"10.0.0.{number}") for number in range(4)]
    assert entered(bounds, *far) == [True] * 3 + [False]
    assert entered(bounds, *[peer_at("127.0.0.1")] * 3) == [True, True, False]
    assert entered(bounds, by_socket, by_socket) == [True, False]


def test_addresses_of_one_home_count_together():
    bounds = Connections(LIMITS)
    homes = [peer_at(f"2001:db8::{number}") for number in (1, 2, 3)]
    assert entered(bounds, *homes, peer_at("2001:db8:0:1::1")) == [True, True, False, True]


def test_who_floods_gives_way_first():
    bounds, dropped = Connections(LIMITS), []
    for name in ("10.0.0.1", "10.0.0.2", "10.0.0.2", "10.0.0.3"):
        assert bounds.enter(peer_at(name), lambda name=name: dropped.append(name)) is not None
    assert dropped == ["10.0.0.2"]


def test_with_few_files_to_open_there_are_fewer_places():
    usual, few = ConnectionLimits.within(10_000), ConnectionLimits.within(144)
    assert [usual.most[group] for group in PeerGroup] == [256, 256, 64]
    assert [few.most[group] for group in PeerGroup] == [64, 64, 16]


def test_unfinished_tls_handshakes_count_and_end(world, monkeypatch):
    monkeypatch.setattr(accepting, "HANDSHAKE_WITHIN_S", 0.3)
    bounds, tls = Connections(LIMITS), ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    with serving(world().app, socket.socket(), bounds, tls) as port, contextlib.ExitStack() as held:
        clients = [
            held.enter_context(socket.create_connection(("127.0.0.1", port), timeout=10))
            for _ in range(3)
        ]
        assert [until_closed(client) for client in clients] == [b"", b"", b""]
        assert bounds.crowded_out == 1
        robot = Robot(port, bounds, None)
        robot.until_held(0)


def test_the_dashboard_asks_itself_through_its_own_door(world, hand_clock, monkeypatch):
    monkeypatch.setattr(door_probe, "WITHIN_S", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        probe = DoorProbe(deaf, is_tls=False, clock=hand_clock)
        hand_clock.pass_s(door_probe.SILENT_S + 1)
        asyncio.run(probe.ask())
        assert probe.is_silent
    monkeypatch.setattr(door_probe, "WITHIN_S", 10.0)
    listener = socket.socket()
    with serving(answering_health(), listener, Connections(LIMITS)):
        probe = DoorProbe(listener, is_tls=False, clock=hand_clock)
        hand_clock.pass_s(door_probe.SILENT_S + 1)
        asyncio.run(probe.ask())
        assert not probe.is_silent


def answering_health():
    app = FastAPI()

    @app.get("/healthz")
    async def healthz() -> None:
        return None

    return app


class Exhausted(socket.socket):
    """A listener of a process that may open no more files, until `is_over`."""

    is_over = threading.Event()
    asked = 0

    def accept(self):
        if not self.is_over.is_set():
            Exhausted.asked += 1
            raise OSError(errno.EMFILE, "Too many open files")
        return super().accept()


def test_without_a_file_left_it_rests_instead_of_spinning_and_goes_on_after(world, caplog):
    Exhausted.is_over.clear()
    with (
        serving(world().app, Exhausted(), Connections(LIMITS)) as port,
        socket.create_connection(("127.0.0.1", port), timeout=10) as called,
    ):
        called.sendall(SESSION)
        called.settimeout(2.5 * accepting.PAUSE_S)
        with pytest.raises(TimeoutError):
            called.recv(1)
        Exhausted.is_over.set()
        called.settimeout(10)
        assert b"200 OK" in until_closed(called)
    assert 1 <= Exhausted.asked <= 4
    assert [one.message.partition(":")[0] for one in caplog.records] == [
        f"no connection is accepted for {accepting.PAUSE_S} s at a time"
    ]


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


WHY = b'{"reason": "it smokes"}'
STOP_WHY = (
    b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: %d\r\n\r\n" % len(WHY)
) + WHY
STOP = b"POST /api/v1/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n"


def test_a_stop_is_pressed_before_what_waits_before_it_and_where_there_is_no_room(world):
    entered, goes_on, reasons = queue.Queue(), threading.Event(), queue.Queue()
    app = FastAPI()

    def press(reason):
        reasons.put(reason)
        return True

    @app.get("/slow")
    async def slow() -> None:
        entered.put("/slow")
        await asyncio.to_thread(goes_on.wait)

    bounds = Connections(LIMITS)
    with serving(app, socket.socket(), bounds, press=press) as port, contextlib.ExitStack() as end:
        robot = Robot(port, bounds, None)
        end.callback(goes_on.set)
        with robot.call() as one, robot.call() as other:
            for called in (one, other):
                called.sendall(b"GET /slow HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                entered.get(timeout=10)  # before that it is idle, and would give way
            robot.until_held(2)
            one.sendall(STOP)  # on a connection that waits for an answer
            assert reasons.get(timeout=10) == ""
            assert robot.answer(STOP_WHY) == b""  # there is no room for a third
            assert reasons.get(timeout=10) == "it smokes"
            goes_on.set()


@pytest.mark.parametrize("went_ahead", [True, False])
def test_a_press_that_went_ahead_is_not_pressed_again_by_its_route(went_ahead):
    pressed = []

    class Link:
        def operate(self, act, reason):
            pressed.append((act, reason))

    app = FastAPI()
    app.state.link = Link()
    app.include_router(operate.router, prefix="/api/v1")

    @app.middleware("http")
    async def known(request, call_next):
        request.state.identity = unknown_user("127.0.0.1")
        return await call_next(request)

    with serving(app, socket.socket(), Connections(LIMITS), press=lambda _: went_ahead) as port:
        assert b"200 OK" in Robot(port, None, None).answer(
            STOP.replace(b"Host", b"Connection: close\r\nHost")
        )
    assert pressed == ([] if went_ahead else [("estop", "")])


def test_reads_take_turns_and_a_client_that_takes_nothing_keeps_none():
    async def reads() -> list[Any]:
        turns, sent, came = ReadTurns(at_once=1, most_waiting=1), [], []

        async def send(message):
            sent.append(message)

        async def wait():
            async with turns.turn(send):
                came.append("second")

        async with turns.turn(send) as first:
            waiting = asyncio.create_task(wait())
            await asyncio.sleep(0)
            with pytest.raises(AccessDenied, match="too many reads"):
                async with turns.turn(send):
                    pass
            came.append("first")
            await first.send({"type": "http.response.start"})
            await waiting  # though the first answer is still being sent
        return came

    assert asyncio.run(reads()) == ["first", "second"]
