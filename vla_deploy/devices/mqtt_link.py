"""Reach one device over MQTT, as Home Assistant does: a command topic, a state topic, discovery.

Every device has a connection of its own: what one of them sends, however much, ends no other's.
Nothing runs between two calls; the broker's messages wait in the socket meanwhile.
"""

import socket
import ssl
import struct
import threading
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any, Final

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.devices.discovery import SwitchTopics, config_topics, read_discovery, topics_of
from vla_deploy.devices.errors import DeviceAway, DeviceNotUsable, StateUnreadable
from vla_deploy.devices.login import DeviceLogin
from vla_deploy.devices.state_text import shown
from vla_deploy.devices.transport import DeviceReading
from vla_deploy.robots.home_devices import MqttTopics

CONNECT_S: Final = 3.0
STATE_S: Final = 3.0
"""How long a device may take to tell its state after a command."""
FIRST_STATE_S: Final = 1.0
"""How long retained messages may take after they were asked for."""
MOST_PACKET_BYTES: Final = 1 << 20
"""What sends more than that at once is not listened to."""
_KEEP_ALIVE_S: Final = 60
_SLICE_S: Final = 0.1
_MOST_READS: Final = 1000
_QOS: Final = 1


class BrokerAddress:
    """Say where a broker listens: a host's port, or a Unix socket."""

    def __init__(self, host: str, port: int = 0, *, tls: bool = False) -> None:
        """Take a host with its port, or, with port 0, the path of a socket."""
        self.host = host
        self.port = port
        self.tls = tls

    def __str__(self) -> str:
        return f"{self.host}:{self.port}" if self.port else self.host


class MqttLink:
    """Switch a device by its command topic; believe what it says on its state topic."""

    look_period_s = 2.0

    def __init__(
        self,
        declared: MqttTopics,
        broker: BrokerAddress,
        read_login: Callable[[], DeviceLogin] | None = None,
    ) -> None:
        """Prepare; the broker is called when the device is.

        `read_login` returns user and password, where the broker wants them.
        """
        name = declared.discovery or declared.command_topic
        self.where = f"{name} on the MQTT broker {broker}"
        self._declared = declared
        self._broker = broker
        self._read_login = read_login
        self._clock = MonotonicClock()
        self._ended = threading.Event()
        self._client: Any = None
        self._forget()

    @property
    def called(self) -> str:
        """Return what the device calls itself in its discovery, fit to be shown."""
        topics = self._topics  # another thread may have it forgotten meanwhile
        return "" if topics is None else topics.called

    def switch(self, on: bool) -> DeviceReading:
        """Publish the command and return what the device says then.

        Raises:
            DeviceError: broker or device is away, or says nothing that can be read.
        """
        topics = self._connected()
        self._expect_available()
        before = self._told
        sent = self._client.publish(topics.command_topic, topics.payload(on), qos=_QOS)
        awaited = f"its state on {shown(topics.state_topic)} after {shown(topics.payload(on))!r}"

        def is_done() -> bool:
            return self._told > before and self._is_on is on and bool(sent.is_published())

        self._pump(is_done, STATE_S, awaited)
        self._expect_available()
        if self._told > before or self._unreadable:
            return self._reading()
        if self._is_on is on and self._is_available:
            return DeviceReading(is_on=on, note="it was so already, and told nothing new")
        raise DeviceAway(f"{self.where}: waited {STATE_S:g} s for {awaited}")

    def read(self) -> DeviceReading:
        """Return what the device said last; a retained message is believed to be of it.

        Raises:
            DeviceError: broker or device is away, or it has said nothing that can be read.
        """
        self._connected()
        self._expect_available()
        return self._reading()

    def interrupt(self) -> None:
        """End waiting within a tenth of a second, now and from now on."""
        self._ended.set()

    def close(self) -> None:
        """Take leave of the broker."""
        client, self._client = self._client, None
        self._forget()
        if client is not None:
            client.disconnect()

    # --- what the device has said -------------------------------------------------------------

    def _forget(self) -> None:
        self._topics: SwitchTopics | None = None
        self._is_on: bool | None = None
        self._unreadable = ""
        self._told = 0
        """How often it told its state while we listened; retained messages do not count."""
        self._availability: dict[str, bool] = {}
        self._document: bytes | None = None
        self._refused: int | None = None
        self._subscribed = 0

    @property
    def _is_available(self) -> bool:
        return bool(self._availability) and all(self._availability.values())

    def _has_told(self) -> bool:
        return self._is_on is not None or bool(self._unreadable)

    def _expect_available(self) -> None:
        away = [topic for topic, there in self._availability.items() if not there]
        if away:
            raise DeviceAway(f"{self.where}: it is not there, says {shown(away[0])}")

    def _reading(self) -> DeviceReading:
        if self._is_on is not None:
            return DeviceReading(is_on=self._is_on)
        topic = "" if self._topics is None else shown(self._topics.state_topic)
        why = self._unreadable or "it has told no state yet"
        raise StateUnreadable(f"{self.where}: {topic}: {why}")

    def _hear(self, _client: Any, _userdata: Any, message: Any) -> None:
        topic, payload = message.topic, bytes(message.payload)
        if self._topics is None or topic in config_topics(self._declared.discovery):
            self._document = payload
            return
        for one in self._topics.availability:
            if topic == one.topic:
                self._availability[topic] = payload.decode(errors="replace") != one.not_available
        if topic == self._topics.state_topic:
            self._hear_state(payload, is_retained=bool(message.retain))

    def _hear_state(self, payload: bytes, *, is_retained: bool) -> None:
        assert self._topics is not None, "the state topic is known"
        self._told += not is_retained
        try:
            self._is_on, self._unreadable = self._topics.words.is_on(payload), ""
        except StateUnreadable as error:
            self._is_on, self._unreadable = None, str(error)

    # --- the connection -----------------------------------------------------------------------

    def _connected(self) -> SwitchTopics:
        """Take in what has arrived; connect, or connect anew where that has broken off."""
        if self._client is not None and not self._take_in():
            self.close()
        if self._topics is not None:
            return self._topics
        try:
            self._connect()
            self._topics = topics = self._find_topics()
            # In this order: whether it is there is known when its state is.
            self._subscribe(*(one.topic for one in topics.availability))
            self._subscribe(topics.state_topic)
            self._pump(self._has_told, FIRST_STATE_S, "its state")
        except BaseException:
            self.close()
            raise
        return topics

    def _connect(self) -> None:
        self._client = client = _client_class(_paho())(self._broker)
        client.on_message = self._hear
        client.on_connect = lambda _c, _u, _f, reason, _p: self._note_answer(reason)
        client.on_subscribe = lambda _c, _u, _mid, reasons, _p: self._note_subscribed(reasons)
        if self._read_login is not None:
            login = self._read_login()
            client.username_pw_set(login.user, login.password.reveal())
        try:
            client.connect(self._broker.host, self._broker.port or 1883, keepalive=_KEEP_ALIVE_S)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise DeviceAway(f"{self.where}: the broker cannot be reached: {why}") from error
        self._pump(lambda: self._refused is not None, CONNECT_S, "the broker's greeting")
        self._expect_welcome()
        if self._refused is None:
            raise DeviceAway(f"{self.where}: the broker did not answer within {CONNECT_S:g} s")

    def _expect_welcome(self) -> None:
        if self._refused:
            raise DeviceNotUsable(
                f"{self.where}: the broker refuses us (code {self._refused}); "
                "see credentials in [mqtt] of the robot file"
            )

    def _note_answer(self, reason: Any) -> None:
        self._refused = int(reason.value)

    def _note_subscribed(self, reasons: Any) -> None:
        self._subscribed += 1
        if any(reason.is_failure for reason in reasons):
            self._unreadable = "the broker does not let us listen there"

    def _find_topics(self) -> SwitchTopics:
        if not self._declared.discovery:
            return topics_of(self._declared)
        self._subscribe(*config_topics(self._declared.discovery))
        self._pump(lambda: self._document, FIRST_STATE_S, "its discovery document")
        if not self._document:
            expected = " or ".join(config_topics(self._declared.discovery))
            raise DeviceAway(f"{self.where}: no discovery document on {expected}")
        document, self._document = self._document, None
        try:
            return read_discovery(document)
        except StateUnreadable as error:
            raise StateUnreadable(f"{self.where}: {error}") from error

    def _subscribe(self, *topics: str) -> None:
        before, wanted = self._subscribed, dict.fromkeys(topics)
        for topic in wanted:
            self._client.subscribe(topic, _QOS)
        consent = before + len(wanted)
        self._pump(lambda: self._subscribed >= consent, CONNECT_S, "the broker's consent")

    def _take_in(self) -> bool:
        """Take in all that has arrived; return whether the connection is still of use.

        A device that describes itself anew is to be found anew.
        """
        for _ in range(_MOST_READS):
            before = self._client.received
            if self._exchange(0.0):
                return False
            if self._client.received == before:
                break
        return self._document is None

    def _pump(self, done: Callable[[], object], within_s: float, awaited: str) -> None:
        """Exchange packets until it is done, or the time is up."""
        end_ns = self._clock.now_ns() + round(within_s * NS_PER_S)
        while not done() and self._clock.now_ns() < end_ns:
            if self._ended.is_set():
                raise DeviceAway(f"{self.where}: not waited for {awaited}: the robot ends")
            self._loop(_SLICE_S, awaited)

    def _loop(self, timeout_s: float, awaited: str) -> None:
        why = self._exchange(timeout_s)
        if why:
            self._expect_welcome()
            self.close()
            raise DeviceAway(f"{self.where}: the connection ended waiting for {awaited}: {why}")

    def _exchange(self, timeout_s: float) -> str:
        """Exchange packets for a moment; return why the connection has ended, "" while it holds."""
        try:
            code = int(self._client.loop(timeout_s))
        except (ValueError, LookupError, struct.error) as error:
            # What is no packet of MQTT leaves the library as whatever it stumbled over.
            return f"the broker breaks the protocol: {shown(error)}"
        if self._client.flooded:
            return f"more than {MOST_PACKET_BYTES} bytes came at once"
        return "it broke off" if code else ""


def _paho() -> ModuleType:
    try:
        return import_module("paho.mqtt.client")
    except ImportError as error:
        raise DeviceNotUsable(
            "a device on MQTT needs the package paho-mqtt: pip install 'paho-mqtt>=2.1,<3'"
        ) from error


def _client_class(paho: ModuleType) -> Callable[[BrokerAddress], Any]:
    class BoundedClient(paho.Client):  # type: ignore[name-defined,misc]
        """Break off where a packet is too long; MQTT 3.1.1 has no way to forbid it."""

        def __init__(self, broker: BrokerAddress) -> None:
            super().__init__(
                paho.CallbackAPIVersion.VERSION2,
                transport="tcp" if broker.port else "unix",
                reconnect_on_failure=False,
            )
            self.connect_timeout = CONNECT_S
            self.flooded = False
            self.received = 0
            self._path = broker.host
            if broker.tls:
                self.tls_set_context(ssl.create_default_context())

        def _create_unix_socket_connection(self) -> socket.socket:
            """Leave no socket open where nobody listens, as the library's own does."""
            line = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                line.connect(self._path)
            except OSError:
                line.close()
                raise
            return line

        def _sock_recv(self, bufsize: int) -> bytes:
            if bufsize > MOST_PACKET_BYTES:
                self.flooded = True
                raise ConnectionAbortedError("the packet is too long")
            data: bytes = super()._sock_recv(bufsize)
            self.received += len(data)
            return data

    return BoundedClient
