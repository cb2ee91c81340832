"""Declare the devices of the home that the robot switches: `[[devices]]` and `[mqtt]`."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from vla_deploy.robots.consistency import repeats, rows, subtables, table, texts, unknown_name
from vla_deploy.runtime.table_schema import (
    TABLE,
    TEXT,
    TEXTS,
    Shape,
    TableFault,
    ValueCheck,
    integer,
    one_of,
)

BROKER_SOCKET: Final = "mqtt"
"""The broker of a twin's home, among the twin's devices."""
DISCOVERY_PREFIX: Final = "homeassistant"
MOST_DEVICES: Final = 60
TRANSPORTS: Final = ("mqtt", "http", "gpio")


class DeviceKind(StrEnum):
    """Name what is switched; a lamp may be called a light, too."""

    LAMP = "lamp"
    SOCKET = "socket"
    SWITCH = "switch"
    FAN = "fan"


@dataclass(frozen=True, slots=True, kw_only=True)
class MqttBroker:
    """Declare the broker of all devices on MQTT; `credentials` is a file with user and password."""

    host: str
    port: int = 1883
    tls: bool = False
    credentials: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MqttTopics:
    """Declare how a device is reached over MQTT: by the id of its discovery, or by its topics.

    The names are those of Home Assistant. `state_on` and `state_off` are what the device says where
    that is not what it is sent; `pointer` is a JSON pointer into what it says.
    """

    discovery: str = ""
    command_topic: str = ""
    state_topic: str = ""
    payload_on: str = "ON"
    payload_off: str = "OFF"
    state_on: str = ""
    state_off: str = ""
    pointer: str = ""
    availability_topic: str = ""
    payload_available: str = "online"
    payload_not_available: str = "offline"


@dataclass(frozen=True, slots=True, kw_only=True)
class HttpRequests:
    """Declare how a device is reached over HTTP: the URLs that switch it, and that of its state.

    The state is what `pointer` points to in its JSON, or the whole text where there is none.
    """

    on: str
    off: str
    state: str
    method: str = "GET"
    pointer: str = ""
    state_on: str = "ON"
    state_off: str = "OFF"
    credentials: Path | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class GpioLine:
    """Declare the line of a GPIO chip that drives a relay."""

    chip: str
    line: int
    active_low: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeDevice:
    """Declare one device: what it is called, and the one way to reach it."""

    name: str
    kind: DeviceKind
    place: str = ""
    aliases: tuple[str, ...] = ()
    mqtt: MqttTopics | None = None
    http: HttpRequests | None = None
    gpio: GpioLine | None = None

    @property
    def spoken(self) -> str:
        """Return the name as it is said."""
        return self.name.replace("_", " ")


_NAME: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_DISCOVERY_ID: Final = re.compile(r"(?:[A-Za-z0-9_-]{1,64}/)?[A-Za-z0-9_-]{1,64}")
_MOST_TOPIC_BYTES: Final = 512


def is_topic(value: object) -> bool:
    """Return whether a text is one topic: no wildcard, no control character, not too long."""
    return (
        isinstance(value, str)
        and 0 < len(value.encode(errors="replace")) <= _MOST_TOPIC_BYTES
        and value.isprintable()
        and not set("+#") & set(value)
    )


def _is_url(value: object) -> bool:
    if not isinstance(value, str) or not value.isascii() or not value.isprintable() or " " in value:
        return False
    try:
        parts = urlsplit(value)
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        return False


def _has_login(url: object) -> bool:
    return isinstance(url, str) and "@" in urlsplit(url).netloc


TOPIC: Final = ValueCheck(expected="one topic, without + and #", holds=is_topic)
URL: Final = ValueCheck(expected="a URL that begins with http:// or https://", holds=_is_url)
POINTER: Final = ValueCheck(
    expected='a JSON pointer such as "/relay/ison"',
    holds=lambda value: isinstance(value, str) and value.startswith("/"),
)
_FLAG: Final = one_of(False, True)

BROKER: Final[Shape] = {
    "host": TEXT,
    "port": integer(1, 65535).optional,
    "tls": _FLAG.optional,
    "credentials": TEXT.optional,
}
HOME_DEVICE: Final[Shape] = {
    "name": ValueCheck(
        expected="lower-case letters, digits and _",
        holds=lambda value: isinstance(value, str) and _NAME.fullmatch(value) is not None,
    ),
    "kind": one_of(*(kind.value for kind in DeviceKind)),
    "place": TEXT.optional,
    "aliases": TEXTS.optional,
    "mqtt": TABLE.optional,
    "http": TABLE.optional,
    "gpio": TABLE.optional,
}
MQTT_TOPICS: Final[Shape] = {
    "discovery": ValueCheck(
        expected="a discovery id: letters, digits, _ and -, with at most one /",
        holds=lambda value: isinstance(value, str) and _DISCOVERY_ID.fullmatch(value) is not None,
        is_optional=True,
    ),
    "command_topic": TOPIC.optional,
    "state_topic": TOPIC.optional,
    "payload_on": TEXT.optional,
    "payload_off": TEXT.optional,
    "state_on": TEXT.optional,
    "state_off": TEXT.optional,
    "pointer": POINTER.optional,
    "availability_topic": TOPIC.optional,
    "payload_available": TEXT.optional,
    "payload_not_available": TEXT.optional,
}
HTTP_REQUESTS: Final[Shape] = {
    "on": URL,
    "off": URL,
    "state": URL,
    "method": one_of("GET", "POST", "PUT").optional,
    "pointer": POINTER.optional,
    "state_on": TEXT.optional,
    "state_off": TEXT.optional,
    "credentials": TEXT.optional,
}
GPIO_LINE: Final[Shape] = {"chip": TEXT, "line": integer(0, 1023), "active_low": _FLAG.optional}


def device_names_are_distinct(document: Mapping[str, Any]) -> Iterator[TableFault]:
    """No two devices share a name or an alias; where they stand is a place."""
    places = subtables(table(document, "home"), "places")
    words: list[tuple[str, object]] = []
    if len(_devices(document)) > MOST_DEVICES:
        got = f"{len(_devices(document))} devices"
        yield TableFault(key="devices", got=got, expected=f"{MOST_DEVICES} at most")
    for key, device in _devices(document):
        said = [device.get("name"), *texts(device, "aliases")]
        words += [(key, str(one).lower().replace("_", " ")) for one in dict.fromkeys(said) if one]
        place = device.get("place")
        if isinstance(place, str) and place not in places:
            yield unknown_name(f"{key}.place", place, "a place", places)
    yield from repeats(words)


def devices_have_one_transport(document: Mapping[str, Any]) -> Iterator[TableFault]:
    """Each device is reached one way, which says all that it takes."""
    for key, device in _devices(document):
        given = [name for name in TRANSPORTS if name in device]
        if len(given) != 1:
            expected = f"exactly one transport: {', '.join(TRANSPORTS)}"
            yield TableFault(key=key, got=" and ".join(given) or "none", expected=expected)
        if "mqtt" in device:
            yield from _mqtt_faults(f"{key}.mqtt", table(device, "mqtt"))
            if "mqtt" not in document:
                yield TableFault(key="mqtt", got="nothing", expected=f"a broker: {key} needs it")
        for name in ("on", "off", "state"):
            if _has_login(table(device, "http").get(name)):
                expected = 'no user or password in it; name a file: credentials = "lamp.toml"'
                yield TableFault(key=f"{key}.http.{name}", got="a URL with @", expected=expected)


def _mqtt_faults(key: str, topics: Mapping[str, Any]) -> Iterator[TableFault]:
    by_topic = [name for name in ("command_topic", "state_topic") if name in topics]
    if "discovery" in topics and len(topics) > 1:
        others = ", ".join(name for name in topics if name != "discovery")
        expected = "nothing beside discovery: its document says all that"
        yield TableFault(key=key, got=others, expected=expected)
    elif "discovery" not in topics and len(by_topic) != 2:
        expected = "discovery, or command_topic and state_topic: a state must be read back"
        yield TableFault(key=key, got=", ".join(by_topic) or "neither", expected=expected)


def _devices(document: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    return [(f"devices[{i}]", row) for i, row in enumerate(rows(document, "devices"))]


SHAPES: Final[Mapping[str, Shape]] = {
    "mqtt": BROKER,
    "devices": HOME_DEVICE,
    "devices.mqtt": MQTT_TOPICS,
    "devices.http": HTTP_REQUESTS,
    "devices.gpio": GPIO_LINE,
}
CHECKS: Final = (device_names_are_distinct, devices_have_one_transport)
