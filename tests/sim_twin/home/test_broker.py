"""The twin's broker at its bytes: what clients see of each other, and what it does not take."""

import socket
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sim_twin.home.broker import EmulatedBroker
from sim_twin.home.mqtt_packets import MqttMessage, PacketInvalid, matches, packets_in

HELLO = b"\x10\x0c\x00\x04MQTT\x04\x02\x00\x3c\x00\x00"
WELCOME = b"\x20\x02\x00\x00"


def text(said: str) -> bytes:
    return struct.pack(">H", len(said)) + said.encode()


def publish(topic: str, payload: bytes, flags: int = 0) -> bytes:
    body = text(topic) + (b"\x00\x07" if flags & 2 else b"") + payload
    return bytes([0x30 | flags, len(body)]) + body


def subscribe(topic_filter: str) -> bytes:
    body = b"\x00\x05" + text(topic_filter) + b"\x01"
    return bytes([0x82, len(body)]) + body


class Line:
    """A client's socket."""

    def __init__(self, path: Path, hello: bytes = HELLO) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(10.0)
        self.socket.connect(str(path))
        self.socket.sendall(hello)

    def expect(self, data: bytes) -> None:
        got = b""
        while len(got) < len(data) and (more := self.socket.recv(len(data) - len(got))):
            got += more
        assert got == data

    def listen(self, topic_filter: str) -> None:
        self.socket.sendall(subscribe(topic_filter))
        self.expect(b"\x90\x03\x00\x05\x01")


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[EmulatedBroker]:
    broker = EmulatedBroker(tmp_path / "mqtt")
    yield broker
    broker.close()


@pytest.fixture
def new_line(broker: EmulatedBroker) -> Iterator[Callable[[], Line]]:
    lines: list[Line] = []

    def new_line() -> Line:
        lines.append(Line(broker.path))
        lines[-1].expect(WELCOME)
        return lines[-1]

    yield new_line
    for line in lines:
        line.socket.close()


def test_messages_reach_who_listens_and_what_is_retained_who_comes_later(
    broker: EmulatedBroker, new_line: Callable[[], Line]
) -> None:
    heard: list[MqttMessage] = []
    broker.on_message("home/#", heard.append)
    early, speaker = new_line(), new_line()
    early.listen("home/+/state")
    speaker.socket.sendall(publish("home/lamp/state", b"ON", 0b0011))
    speaker.expect(b"\x40\x02\x00\x07")
    early.expect(publish("home/lamp/state", b"ON"))
    late = new_line()
    late.listen("home/lamp/#")
    late.expect(publish("home/lamp/state", b"ON", 1))
    assert [(one.topic, one.payload) for one in heard] == [("home/lamp/state", b"ON")]
    speaker.socket.sendall(publish("home/lamp/state", b"", 1) + b"\xc0\x00")
    speaker.expect(b"\xd0\x00")
    latest = new_line()
    latest.listen("#")
    latest.socket.sendall(b"\xc0\x00")
    latest.expect(b"\xd0\x00")


@pytest.mark.parametrize("is_lost", [True, False])
def test_a_will_is_published_where_a_client_is_lost(
    broker: EmulatedBroker, new_line: Callable[[], Line], is_lost: bool
) -> None:
    listener = new_line()
    listener.listen("#")
    body = b"\x00\x04MQTT\x04\x06\x00\x3c" + text("") + text("lwt") + text("gone")
    mortal = Line(broker.path, bytes([0x10, len(body)]) + body)
    mortal.expect(WELCOME)
    if is_lost:
        mortal.socket.close()
        listener.expect(publish("lwt", b"gone"))
    else:
        mortal.socket.sendall(b"\xe0\x00")
        assert mortal.socket.recv(1) == b""
        mortal.socket.close()
    broker.publish("after", b"it")
    listener.expect(publish("after", b"it"))


@pytest.mark.parametrize(
    "said",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"\x10\x0c\x00\x04MQTT\x05\x02\x00\x3c\x00\x00",
        publish("a", b"before hello"),
        HELLO + publish("a/#", b"wild"),
        HELLO + publish("a", b"qos 2", 0b0100),
        HELLO + b"\x30\xff\xff\xff\xff\x7f",
        HELLO + b"\x30\x01\x00",
        HELLO + b"\x00\x00",
    ],
    ids=["HTTP", "MQTT 5", "no hello", "wildcard", "QoS 2", "length", "short", "no type"],
)
def test_who_breaks_the_protocol_is_hung_up_on_and_nobody_else(
    broker: EmulatedBroker, new_line: Callable[[], Line], said: bytes
) -> None:
    other = new_line()
    bad = Line(broker.path, said)
    while bad.socket.recv(100):
        pass
    bad.socket.close()
    other.listen("a")
    broker.publish("a", b"b")
    other.expect(publish("a", b"b"))


@pytest.mark.parametrize(
    ("topic_filter", "topic", "takes"),
    [
        ("a/b", "a/b", True), ("a/+", "a/b", True), ("+/b", "a/b", True), ("#", "a/b", True),
        ("a/#", "a", True), ("a/#", "a/b/c", True), ("+", "a", True), ("+/+", "/a", True),
        ("a", "a/b", False), ("a/+", "a/b/c", False), ("a/+", "a", False), ("A", "a", False),
        ("#", "$SYS/x", False), ("+/x", "$SYS/x", False), ("$SYS/#", "$SYS/x", True),
    ],
)  # fmt: skip
def test_filters_take_what_the_standard_says(topic_filter: str, topic: str, takes: bool) -> None:
    assert matches(topic_filter, topic) is takes


def test_packets_come_in_any_pieces() -> None:
    stream, buffer, found = HELLO + publish("a", b"x" * 100), bytearray(), []
    for byte in stream:
        buffer.append(byte)
        found += list(packets_in(buffer))
    assert [head for head, _ in found] == [0x10, 0x30]
    assert not buffer
    with pytest.raises(PacketInvalid):
        list(packets_in(bytearray(b"\x30\xff\xff\xff\x7f")))
