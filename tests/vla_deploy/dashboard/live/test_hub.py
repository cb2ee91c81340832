"""Live topics reach subscribers; waiting messages are bounded, no client delays another."""

import asyncio
import contextlib
import json
import socket
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.live.hub import ALIVE, FROZEN_S, LiveHub, Outbox
from vla_deploy.dashboard.live.message import LiveMessage, LookTime, json_message

NOW = LookTime(run_ns=0, wall_ns=0)


def message(topic: str, number: int, *, queued: bool = False) -> LiveMessage:
    return json_message(topic, 0, NOW, number, queued=queued)


def taken(outbox: Outbox) -> list[tuple[str, object]]:
    texts = [json.loads(payload_of(one)) for one in outbox.take()]
    return [(text["topic"], text["data"]) for text in texts]


def test_a_client_that_comes_late_gets_the_newest_value_only() -> None:
    outbox = Outbox()
    for number in range(1000):
        outbox.put(message("pose", number))
    outbox.put(message("scan", 7))
    assert taken(outbox) == [("pose", 999), ("scan", 7)]
    assert not outbox


def test_events_come_in_order_and_before_values() -> None:
    outbox = Outbox()
    outbox.put(message("pose", 1))
    outbox.put(message("task_event", 2, queued=True))
    outbox.put(message("heard", 3, queued=True))
    assert taken(outbox) == [("task_event", 2), ("heard", 3), ("pose", 1)]


def test_of_too_many_events_the_oldest_are_lost_and_counted_by_topic() -> None:
    outbox = Outbox(most_events=3)
    for number in range(5):
        outbox.put(message("heard" if number == 0 else "task_event", number, queued=True))
    lost = [("lost", {"topic": "heard", "count": 1}), ("lost", {"topic": "task_event", "count": 1})]
    assert taken(outbox) == [*lost, *(("task_event", number) for number in (2, 3, 4))]
    assert taken(outbox) == []


def test_what_is_wanted_no_more_does_not_come() -> None:
    outbox = Outbox()
    outbox.put(message("pose", 1))
    outbox.forget("pose")
    assert not outbox


MakeHub = Callable[..., LiveHub]
Until = Callable[[Callable[[], object]], Awaitable[None]]
PIECE = "x" * 200_000


async def subscribe(hub: LiveHub, until: Until, client: ClientConnection, *topics: str) -> None:
    """Subscribe, and return when the hub knows it."""
    await client.send(json.dumps({"subscribe": list(topics)}))
    await until(lambda: any(one.topics == set(topics) for one in hub._clients))


async def heard(client: ClientConnection, *but: str) -> Any:
    """Return the next message that is no sign of life."""
    while (text := json.loads(await client.recv()))["topic"] in (ALIVE, *but):
        pass
    return text


def test_each_client_gets_what_it_subscribed_to(
    make_hub: MakeHub, serve: Any, until: Until, script: Any, clock: ManualClock
) -> None:
    pose, events, idle = script("pose"), script("heard", queued=True), script("scan")
    hub = make_hub(pose, events, idle)

    async def talk() -> None:
        async with (
            serve(hub) as served,
            connect(served.url) as a,
            connect(served.url) as b,
        ):
            await subscribe(hub, until, a, "pose", "heard")
            await subscribe(hub, until, b, "heard")
            pose.waiting, events.waiting = [{"x_m": 1.5}], ["one", "two"]
            hub.step()
            assert [(await heard(a))["data"] for _ in range(3)] == ["one", "two", {"x_m": 1.5}]
            assert [(await heard(b))["data"] for _ in range(2)] == ["one", "two"]

    asyncio.run(talk())
    assert idle.looks == 0


def test_nothing_is_looked_at_while_nobody_is_subscribed(
    make_hub: MakeHub, serve: Any, until: Until, script: Any, clock: ManualClock
) -> None:
    pose = script("pose")
    hub = make_hub(pose)

    async def talk() -> None:
        async with serve(hub) as served:
            hub.step()
            async with connect(served.url) as client:
                hub.step()
                assert pose.looks == 0
                await subscribe(hub, until, client, "pose")
                for _ in range(10):
                    hub.step()
                    clock.ns += NS_PER_S // 20
                assert pose.looks == 5
                await client.send('{"subscribe": []}')
                await until(lambda: not any(one.topics for one in hub._clients))
                hub.step()
                assert pose.looks == 5

    asyncio.run(talk())


def test_a_newcomer_takes_no_event_away_from_the_others(
    make_hub: MakeHub, serve: Any, until: Until, script: Any, clock: ManualClock
) -> None:
    events = script("heard", queued=True)
    hub = make_hub(events)

    async def talk() -> None:
        async with serve(hub) as served, connect(served.url) as a, connect(served.url) as b:
            await subscribe(hub, until, a, "heard")
            hub.step()
            events.waiting = ["before"]
            await b.send('{"subscribe": ["heard"]}')
            await until(lambda: sum("heard" in one.topics for one in hub._clients) == 2)
            events.waiting = ["after"]
            clock.ns += NS_PER_S
            hub.step()
            assert [(await heard(a))["data"] for _ in range(2)] == ["before", "after"]
            assert (await heard(b))["data"] == "after"

    asyncio.run(talk())


def test_a_frozen_client_holds_nobody_up_and_is_cut_off(
    make_hub: MakeHub, serve: Any, until: Until, script: Any, clock: ManualClock
) -> None:
    """Its connection ends although what waits for it was never read."""
    pose = script("pose")
    hub = make_hub(pose)

    async def talk() -> None:
        async with serve(hub) as served, connect(served.url, max_size=None) as live:
            await subscribe(hub, until, live, "pose")
            frozen = await _frozen(served.port)
            await until(lambda: sum(bool(one.topics) for one in hub._clients) == 2)
            for number in range(60):  # as many bytes as no socket's buffers hold
                pose.waiting = [[number, PIECE]]
                clock.ns += NS_PER_S // 10
                hub.step()
                assert (await heard(live))["data"][0] == number
            clock.ns += round(FROZEN_S * NS_PER_S)
            hub.step()
            await until(lambda: len(hub._clients) == 1)
            await until(lambda: len(served.connections) == 1)  # though nothing was read
            frozen.close()
            pose.waiting = ["still here"]
            clock.ns += NS_PER_S
            hub.step()
            assert (await heard(live))["data"] == "still here"

    asyncio.run(talk())


async def _frozen(port: int) -> socket.socket:
    """Return a client that subscribed and reads no more."""
    frozen = socket.create_connection(("127.0.0.1", port))
    frozen.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\n"
    frozen.sendall(f"GET /live HTTP/1.1\r\nHost: 127.0.0.1\r\n{upgrade}{key}\r\n".encode())
    answer = await asyncio.to_thread(frozen.recv, 1024)
    assert answer.startswith(b"HTTP/1.1 101")
    text = b'{"subscribe": ["pose"]}'
    frozen.sendall(bytes((0x81, 0x80 | len(text), 0, 0, 0, 0)) + text)
    return frozen


def test_what_is_no_subscription_is_answered_and_too_much_of_it_ends_the_talk(
    make_hub: MakeHub, serve: Any, script: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vla_deploy.dashboard.live.endpoint.STEP_S", 0.0)
    hub = make_hub(script("pose"))
    nonsense = [
        "",
        "{",
        "[]",
        '{"subscribe": "pose"}',
        '{"subscribe": [1]}',
        "[" * 5000,
        "1" * 9000,
    ]

    async def talk() -> None:
        async with serve(hub) as served, connect(served.url) as client:
            await client.send('{"subscribe": ["pose", "nonsense"]}')
            answer = await heard(client)
            assert (answer["topic"], answer["data"]["code"]) == ("error", "unknown_topic")
            for text in nonsense:
                await client.send(text)
                assert (await heard(client))["data"]["code"] == "invalid"
            await client.send(b"\xff\x00\xfe")
            assert (await heard(client))["data"]["code"] == "invalid"
            with pytest.raises(ConnectionClosed) as closed:
                for _ in range(20):
                    await client.send("nonsense")
                    await heard(client)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008

    asyncio.run(talk())
    assert not hub._clients


def test_a_topic_that_cannot_be_told_takes_no_other_along(
    make_hub: MakeHub, serve: Any, until: Until, script: Any, caplog: pytest.LogCaptureFixture
) -> None:
    broken, pose = script("broken"), script("pose")
    hub = make_hub(broken, pose)

    async def talk() -> None:
        async with serve(hub) as served, connect(served.url) as client:
            await subscribe(hub, until, client, "broken", "pose")
            broken.waiting, pose.waiting = [float("nan")], [1]
            hub.step()
            assert (await heard(client))["data"] == 1

    asyncio.run(talk())
    assert hub.failed_looks == {"broken": 1}
    assert "broken: it cannot be told" in caplog.text


def test_a_client_that_goes_is_forgotten(
    make_hub: MakeHub, serve: Any, until: Until, script: Any
) -> None:
    hub = make_hub(script("pose"))

    async def talk() -> None:
        async with serve(hub) as served:
            clients = [await connect(served.url) for _ in range(3)]
            await until(lambda: len(hub._clients) == 3)
            await clients[0].close()
            clients[1].transport.abort()
            with contextlib.suppress(ConnectionClosed):
                await clients[2].close(1001)
            await until(lambda: not hub._clients)

    asyncio.run(talk())
