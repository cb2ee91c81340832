"""Be the MQTT broker of the twin's home, on a Unix socket beside the robot's other devices.

It lives by the wall clock in a thread of its own, like the network that it stands for: a robot's
process that waits for an answer may hold the twin's time meanwhile.
"""

import contextlib
import selectors
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

from sim_twin.home.mqtt_packets import (
    PROTOCOL_LEVEL,
    FieldReader,
    MqttMessage,
    PacketInvalid,
    PacketType,
    matches,
    packet,
    packets_in,
    publish_packet,
    read_connect,
    read_publish,
    two_bytes,
)

Handler = Callable[[MqttMessage], None]
_READ_BYTES: Final = 1 << 16
_MOST_WAITING_BYTES: Final = 1 << 25
_ACCEPTED, _UNKNOWN_LEVEL = 0, 1
_MOST_QOS: Final = 1


class EmulatedBroker:
    """Serve clients until it is closed; devices in this process listen by `on_message`."""

    def __init__(self, path: Path) -> None:
        """Listen on a Unix socket.

        Raises:
            OSError: the path cannot be bound.
        """
        path.unlink(missing_ok=True)
        self.path = path
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen()
        self._listener.setblocking(False)
        self._wake, self._waker = socket.socketpair()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._wake, selectors.EVENT_READ)
        self._clients: dict[socket.socket, _Client] = {}
        self._retained: dict[str, MqttMessage] = {}
        self._handlers: list[tuple[str, Handler]] = []
        self._lock = threading.RLock()
        self._is_off = False
        self._thread = threading.Thread(target=self._serve, name="mqtt-broker", daemon=True)
        self._thread.start()

    def on_message(self, topic_filter: str, handler: Handler) -> None:
        """Call a handler, in the broker's thread, for each message that a filter takes."""
        with self._lock:
            self._handlers.append((topic_filter, handler))

    def publish(self, topic: str, payload: bytes, *, retain: bool = False) -> None:
        """Pass a message on to all who listen; it may come from any thread."""
        self._pass_on(MqttMessage(topic=topic, payload=payload, retain=retain))

    def go_off(self) -> None:
        """End every connection and take none, from now on."""
        self._is_off = True
        self.abandon()

    def come_back(self) -> None:
        """Take connections again; what was retained is there."""
        self._is_off = False

    def abandon(self) -> None:
        """Cut every connection at once, as a broker that dies; it may come from any thread."""
        for client in list(self._clients.values()):
            self._drop(client)

    def close(self) -> None:
        """End every connection; closing twice is allowed."""
        with contextlib.suppress(OSError):  # it has been closed
            self._waker.send(b"x")
        self._thread.join()
        self.abandon()
        self._selector.close()
        for one in (self._listener, self._wake, self._waker):
            one.close()
        self.path.unlink(missing_ok=True)

    def _serve(self) -> None:
        while True:
            for key, mask in self._selector.select():
                if key.fileobj is self._wake:
                    return
                if key.fileobj is self._listener:
                    self._accept()
                    continue
                client = key.data
                self._attend(client, mask)

    def _accept(self) -> None:
        try:
            line, _ = self._listener.accept()
        except OSError:  # it has gone already
            return
        if self._is_off:
            line.close()
            return
        line.setblocking(False)
        self._clients[line] = client = _Client(line)
        self._selector.register(line, selectors.EVENT_READ, client)

    def _attend(self, client: "_Client", mask: int) -> None:
        if client.line not in self._clients:
            return  # another one's word has ended it
        try:
            if mask & selectors.EVENT_WRITE:
                self._flush(client)
            if mask & selectors.EVENT_READ:
                data = client.line.recv(_READ_BYTES)
                if not data:
                    raise ConnectionResetError("it has hung up")
                client.heard += data
                if not client.is_greeted and client.heard[0] >> 4 != PacketType.CONNECT:
                    raise PacketInvalid("a client begins with CONNECT")
                for head, body in packets_in(client.heard):
                    self._take(client, head, body)
        except BlockingIOError:
            return
        except (OSError, PacketInvalid):
            self._drop(client)

    def _take(self, client: "_Client", head: int, body: bytes) -> None:
        kind = head >> 4
        if client.is_greeted is (kind == PacketType.CONNECT):
            raise PacketInvalid("a client begins with CONNECT, and says it once")
        match kind:
            case PacketType.CONNECT:
                self._greet(client, body)
            case PacketType.PUBLISH:
                message = read_publish(head, body)
                self._pass_on(message)
                if message.qos:  # who reads this knows that the others have it
                    self._send(client, packet(PacketType.PUBACK, two_bytes(message.packet_id)))
            case PacketType.SUBSCRIBE:
                self._subscribe(client, FieldReader(body))
            case PacketType.UNSUBSCRIBE:
                fields = FieldReader(body)
                packet_id = fields.number()
                while not fields.is_empty:
                    client.filters.pop(fields.text(), None)
                self._send(client, packet(PacketType.UNSUBACK, two_bytes(packet_id)))
            case PacketType.PINGREQ:
                self._send(client, packet(PacketType.PINGRESP))
            case PacketType.DISCONNECT:
                client.will = None
                raise ConnectionResetError("it takes its leave")
            case PacketType.PUBACK:
                return  # what was sent once is not sent again
            case _:
                raise PacketInvalid(f"a broker takes no packet of type {kind}")

    def _greet(self, client: "_Client", body: bytes) -> None:
        hello = read_connect(body)
        if hello.level != PROTOCOL_LEVEL:
            self._send(client, packet(PacketType.CONNACK, bytes([0, _UNKNOWN_LEVEL])))
            raise PacketInvalid(f"MQTT of level {hello.level}, only {PROTOCOL_LEVEL} is spoken")
        client.is_greeted, client.will = True, hello.will
        self._send(client, packet(PacketType.CONNACK, bytes([0, _ACCEPTED])))

    def _subscribe(self, client: "_Client", fields: FieldReader) -> None:
        packet_id, granted = fields.number(), bytearray()
        wanted = []
        while not fields.is_empty:
            topic_filter, qos = fields.text(), min(fields.take(1)[0], _MOST_QOS)
            wanted.append(topic_filter)
            granted.append(qos)
            client.filters[topic_filter] = qos
        self._send(client, packet(PacketType.SUBACK, two_bytes(packet_id) + bytes(granted)))
        with self._lock:
            kept = list(self._retained.values())
        for message in kept:
            if any(matches(one, message.topic) for one in wanted):
                self._deliver(client, message, retain=True)

    def _pass_on(self, message: MqttMessage) -> None:
        with self._lock:
            if message.retain and message.payload:
                self._retained[message.topic] = message
            elif message.retain:
                self._retained.pop(message.topic, None)
            for client in list(self._clients.values()):
                if any(matches(one, message.topic) for one in client.filters):
                    self._deliver(client, message, retain=False)
            handlers = [one for taken, one in self._handlers if matches(taken, message.topic)]
        for handler in handlers:
            handler(message)

    def _deliver(self, client: "_Client", message: MqttMessage, *, retain: bool) -> None:
        """Send with QoS 0: a Unix socket loses nothing."""
        out = MqttMessage(topic=message.topic, payload=message.payload, retain=retain)
        self._send(client, publish_packet(out))

    def _send(self, client: "_Client", data: bytes) -> None:
        with self._lock:
            client.waiting += data
            if len(client.waiting) > _MOST_WAITING_BYTES:
                client.waiting.clear()  # it does not read: its connection ends with its next word
                client.is_greeted = False
            with contextlib.suppress(OSError):  # the thread that serves finds out, and drops it
                self._flush(client)

    def _flush(self, client: "_Client") -> None:
        with self._lock:
            try:
                while client.waiting:
                    del client.waiting[: client.line.send(client.waiting)]
            except BlockingIOError:
                pass
            mask = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.waiting else 0)
            if client.line in self._clients:
                self._selector.modify(client.line, mask, client)

    def _drop(self, client: "_Client") -> None:
        with self._lock:
            if self._clients.pop(client.line, None) is None:
                return
            self._selector.unregister(client.line)
            client.line.close()
        if client.will is not None:
            self._pass_on(client.will)


class _Client:
    """Hold one connection: what was heard and not read yet, what waits to be sent."""

    def __init__(self, line: socket.socket) -> None:
        self.line = line
        self.heard = bytearray()
        self.waiting = bytearray()
        self.filters: dict[str, int] = {}
        self.will: MqttMessage | None = None
        self.is_greeted = False
