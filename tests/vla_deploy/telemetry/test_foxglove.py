"""Watch a run by a real WebSocket client of Foxglove's protocol, which can do nothing else."""

import json
import struct
from collections.abc import Iterator
from typing import Any

import jsonschema_rs
import pytest
from websockets.sync.client import ClientConnection, connect

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.foxglove import FoxgloveNode
from vla_deploy.telemetry.recording.settings import FoxgloveSettings

PROTOCOL: Any = "foxglove.sdk.v1"
MESSAGE_DATA = 1
HEAD = struct.Struct("<BIQ")


class Watched:
    def __init__(self, context: NodeContext, clock: Any) -> None:
        self.clock = clock
        self.space = SharedSpace(context.run_dir / "ipc", clock)
        self.base = self.space.cell_writer("base_state")
        self.node = FoxgloveNode(context, FoxgloveSettings(port=0), clock.wall_ns)
        self.node.start()

    def step(self) -> None:
        self.clock.time_ns += NS_PER_S // 10
        self.base.put(x_m=1.5, y_m=0.0, yaw_rad=0.0, v_m_s=0.0, w_rad_s=0.0, enabled=1)
        self.node.step()

    def client(self) -> ClientConnection:
        return connect(f"ws://127.0.0.1:{self.node.port}", subprotocols=[PROTOCOL])


@pytest.fixture
def watched(context: NodeContext, clock: Any) -> Iterator[Watched]:
    watched = Watched(context, clock)
    yield watched
    watched.node.stop()
    watched.space.close()


def told(client: ClientConnection, operation: str) -> dict[str, Any]:
    while True:
        text = client.recv(timeout=10)
        if isinstance(text, str):
            document: dict[str, Any] = json.loads(text)
            if document["op"] == operation:
                return document


def test_a_viewer_gets_values_that_fit_the_advertised_schemas(watched: Watched) -> None:
    with watched.client() as client:
        server = told(client, "serverInfo")
        assert server["capabilities"] == []
        channels = {one["topic"]: one for one in told(client, "advertise")["channels"]}
        wanted = ("base_state", "view/odometry", "view/map")
        request = [{"id": place, "channelId": channels[n]["id"]} for place, n in enumerate(wanted)]
        client.send(json.dumps({"op": "subscribe", "subscriptions": request}))
        got: dict[int, Any] = {}
        for _ in range(200):
            watched.step()
            try:
                data = client.recv(timeout=0.05)
            except TimeoutError:
                continue
            if isinstance(data, bytes) and data[0] == MESSAGE_DATA:
                _, place, stamp_ns = HEAD.unpack_from(data)
                assert stamp_ns > 10**18
                got[place] = json.loads(data[HEAD.size :])
            if len(got) == len(wanted):
                break
        assert got[0]["x_m"] == 1.5
        for place, name in enumerate(wanted):
            schema = json.loads(channels[name]["schema"])
            jsonschema_rs.validator_for(schema).validate(got[place])


def test_a_viewer_cannot_publish_call_or_set(watched: Watched) -> None:
    operator = watched.space.ring_reader("operator", from_start=True)
    with watched.client() as client:
        told(client, "serverInfo")
        for request in (
            {"op": "advertise", "channels": [{"id": 1, "topic": "operator", "encoding": "json"}]},
            {"op": "setParameters", "parameters": [{"name": "x", "value": 1}]},
        ):
            client.send(json.dumps(request))
            assert told(client, "status")["level"] > 0
        client.send(bytes([1, 1, 0, 0, 0]) + b'{"act": "arm"}')
        watched.step()
    assert operator.drain() == []
    assert watched.space.cell_reader("base_state").latest() is not None


def test_nothing_is_drawn_for_nobody(watched: Watched) -> None:
    watched.step()
    assert not any(channel.has_sinks() for channel in watched.node._channels.values())


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "::"])
def test_the_network_sees_nothing_unless_it_is_asked_for(host: str) -> None:
    with pytest.raises(ValueError, match="without a password"):
        FoxgloveSettings(host=host)
    assert FoxgloveSettings(host=host, open_to_network=True).host == host
