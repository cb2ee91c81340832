"""Read and write the packets of MQTT 3.1.1, as a broker needs them.

Sections are those of the standard, OASIS MQTT Version 3.1.1 of 29 October 2014.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

MOST_BYTES: Final = 1 << 24
PROTOCOL_LEVEL: Final = 4
_LENGTH: Final = struct.Struct(">H")


class PacketType(IntEnum):
    """Name the control packets, section 2.2.1."""

    CONNECT = 1
    CONNACK = 2
    PUBLISH = 3
    PUBACK = 4
    SUBSCRIBE = 8
    SUBACK = 9
    UNSUBSCRIBE = 10
    UNSUBACK = 11
    PINGREQ = 12
    PINGRESP = 13
    DISCONNECT = 14


class PacketInvalid(ValueError):
    """Say what is wrong with a packet; the connection ends by it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MqttMessage:
    """Hold one application message."""

    topic: str
    payload: bytes
    retain: bool = False
    qos: int = 0
    packet_id: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectPacket:
    """Hold what a client begins with."""

    level: int
    client_id: str
    will: MqttMessage | None


class FieldReader:
    """Take the fields of a packet's body one after the other."""

    def __init__(self, body: bytes) -> None:
        self._body = body
        self._at = 0

    @property
    def is_empty(self) -> bool:
        """Return whether nothing is left."""
        return self._at >= len(self._body)

    def take(self, count: int) -> bytes:
        """Return the next bytes.

        Raises:
            PacketInvalid: there are not so many.
        """
        taken = self._body[self._at : self._at + count]
        if len(taken) != count:
            raise PacketInvalid(f"a packet of {len(self._body)} bytes ends too early")
        self._at += count
        return taken

    def number(self) -> int:
        """Return an unsigned number of two bytes."""
        return int(_LENGTH.unpack(self.take(2))[0])

    def binary(self) -> bytes:
        """Return bytes with their length before them."""
        return self.take(self.number())

    def text(self) -> str:
        """Return a text, section 1.5.3.

        Raises:
            PacketInvalid: it is no UTF-8.
        """
        try:
            return self.binary().decode()
        except UnicodeDecodeError as error:
            raise PacketInvalid("a text is no UTF-8") from error

    def rest(self) -> bytes:
        """Return all that is left."""
        return self.take(len(self._body) - self._at)


def packets_in(buffer: bytearray) -> Iterator[tuple[int, bytes]]:
    """Take whole packets out of a buffer: the first byte of each, and its body.

    Raises:
        PacketInvalid: a length is none, or too great.
    """
    while len(buffer) >= 2:
        length, at = 0, 1
        while True:
            if at > 4:
                raise PacketInvalid("the remaining length has more than four bytes")
            if at >= len(buffer):
                return
            length |= (buffer[at] & 0x7F) << (7 * (at - 1))
            at += 1
            if not buffer[at - 1] & 0x80:
                break
        if length > MOST_BYTES:
            raise PacketInvalid(f"a packet has {length} bytes, {MOST_BYTES} at most are taken")
        if len(buffer) < at + length:
            return
        head, body = buffer[0], bytes(buffer[at : at + length])
        del buffer[: at + length]
        yield head, body


def packet(kind: PacketType, body: bytes = b"", flags: int = 0) -> bytes:
    """Return a packet."""
    length, left = bytearray(), len(body)
    while True:
        left, digit = left >> 7, left & 0x7F
        length.append(digit | (0x80 if left else 0))
        if not left:
            return bytes([kind << 4 | flags]) + bytes(length) + body


def two_bytes(number: int) -> bytes:
    """Return an unsigned number of two bytes."""
    return _LENGTH.pack(number)


def read_connect(body: bytes) -> ConnectPacket:
    """Return what a client begins with, section 3.1; user and password are not looked at.

    Raises:
        PacketInvalid: it is no such packet.
    """
    fields = FieldReader(body)
    fields.text()
    level, flags = fields.take(1)[0], fields.take(1)[0]
    fields.number()
    if level != PROTOCOL_LEVEL:
        return ConnectPacket(level=level, client_id="", will=None)
    client_id = fields.text()
    will = None
    if flags & 0x04:
        topic, payload = fields.text(), fields.binary()
        will = MqttMessage(topic=topic, payload=payload, retain=bool(flags & 0x20))
    return ConnectPacket(level=level, client_id=client_id, will=will)


def read_publish(head: int, body: bytes) -> MqttMessage:
    """Return a published message, section 3.3.

    Raises:
        PacketInvalid: it is no such packet, its topic has a wildcard, or its QoS is 2.
    """
    fields, qos = FieldReader(body), head >> 1 & 0x03
    topic = fields.text()
    if qos > 1 or not topic or set("+#\0") & set(topic):
        raise PacketInvalid(f"cannot take QoS {qos} on topic {topic!a:.60}")
    packet_id = fields.number() if qos else 0
    return MqttMessage(
        topic=topic, payload=fields.rest(), retain=bool(head & 1), qos=qos, packet_id=packet_id
    )


def publish_packet(message: MqttMessage) -> bytes:
    """Return the packet of a message."""
    topic = message.topic.encode()
    body = two_bytes(len(topic)) + topic
    if message.qos:
        body += two_bytes(message.packet_id)
    flags = message.qos << 1 | message.retain
    return packet(PacketType.PUBLISH, body + message.payload, flags)


def matches(topic_filter: str, topic: str) -> bool:
    """Return whether a subscription takes a topic, section 4.7."""
    wanted, levels = topic_filter.split("/"), topic.split("/")
    if topic.startswith("$") and wanted[0] in ("+", "#"):
        return False
    for at, level in enumerate(wanted):
        if level == "#":
            return True
        if at >= len(levels) or level not in ("+", levels[at]):
            return False
    return len(wanted) == len(levels)
