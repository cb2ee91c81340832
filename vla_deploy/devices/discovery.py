"""Read Home Assistant's discovery documents: how a device on MQTT is switched and tells its state.

https://www.home-assistant.io/integrations/mqtt/#mqtt-discovery; the abbreviations are those of
`homeassistant/components/mqtt/abbreviations.py`. Whoever may write to the broker may write such a
document, so nothing in it is taken as it comes.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.devices.errors import StateUnreadable
from vla_deploy.devices.state_text import StateWords, document_in, shown
from vla_deploy.robots.home_devices import DISCOVERY_PREFIX, MqttTopics, is_topic

COMPONENTS: Final = ("switch", "light")
_ABBREVIATIONS: Final[Mapping[str, str]] = {
    "cmd_t": "command_topic", "stat_t": "state_topic", "pl_on": "payload_on",
    "pl_off": "payload_off", "stat_on": "state_on", "stat_off": "state_off",
    "val_tpl": "value_template", "stat_val_tpl": "state_value_template", "avty_t":
    "availability_topic", "avty": "availability", "t": "topic", "pl_avail": "payload_available",
    "pl_not_avail": "payload_not_available", "opt": "optimistic",
}  # fmt: skip
# {{ value_json.state }} and {{ value_json['state'] }}: what else Jinja can do is not done.
_KEY: Final = r"\.[A-Za-z_]\w{0,40}|\['[\w -]{1,40}'\]|\[\"[\w -]{1,40}\"\]"
_TEMPLATE: Final = re.compile(r"\{\{\s*value_json((?:" + _KEY + r"){1,4})\s*\}\}")
_STEP: Final = re.compile(r"[\w -]+")
_MOST_AVAILABILITIES: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Availability:
    """Name a topic on which a device, or a part on the way to it, says that it is there."""

    topic: str
    available: str = "online"
    not_available: str = "offline"


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchTopics:
    """Say how a device is switched, tells its state, and says that it is there.

    `called` is what it calls itself, for people: it is shown, and means nothing.
    """

    command_topic: str
    state_topic: str
    payload_on: str
    payload_off: str
    words: StateWords
    availability: tuple[Availability, ...] = ()
    called: str = ""

    def payload(self, on: bool) -> str:
        """Return what is sent to switch it."""
        return self.payload_on if on else self.payload_off


def config_topics(discovery_id: str) -> tuple[str, ...]:
    """Return where the document of a discovery id may be."""
    return tuple(f"{DISCOVERY_PREFIX}/{one}/{discovery_id}/config" for one in COMPONENTS)


def topics_of(declared: MqttTopics) -> SwitchTopics:
    """Return the topics that a robot file has given."""
    availability = Availability(
        topic=declared.availability_topic,
        available=declared.payload_available,
        not_available=declared.payload_not_available,
    )
    return SwitchTopics(
        command_topic=declared.command_topic,
        state_topic=declared.state_topic,
        payload_on=declared.payload_on,
        payload_off=declared.payload_off,
        words=StateWords(
            on=declared.state_on or declared.payload_on,
            off=declared.state_off or declared.payload_off,
            pointer=declared.pointer,
        ),
        availability=(availability,) if availability.topic else (),
    )


def read_discovery(payload: bytes) -> SwitchTopics:
    """Return the topics that a discovery document gives.

    Raises:
        StateUnreadable: it is none, tells no state, or needs what is not known here.
    """
    document = document_in(payload)
    if not isinstance(document, dict):
        raise StateUnreadable(f'expected a discovery document, got "{shown(payload)}"')
    config = _Config(_in_full(document))
    is_json = config.text("schema", "default") == "json"
    on, off = config.text("payload_on", "ON"), config.text("payload_off", "OFF")
    pointer = "/state" if is_json else config.pointer()
    return SwitchTopics(
        command_topic=config.topic("command_topic"),
        state_topic=config.topic("state_topic"),
        payload_on=json.dumps({"state": on}) if is_json else on,
        payload_off=json.dumps({"state": off}) if is_json else off,
        words=StateWords(
            on=config.text("state_on", on), off=config.text("state_off", off), pointer=pointer
        ),
        availability=tuple(config.availability()),
        called=shown(document.get("name") or ""),
    )


def _in_full(document: Mapping[str, Any]) -> dict[str, Any]:
    return {_ABBREVIATIONS.get(key, key): value for key, value in document.items()}


class _Config:
    """Hold a document whose keys are in full, and take of it what is right."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values
        self._base = values.get("~")

    def text(self, key: str, default: str) -> str:
        value = self._values.get(key, default)
        if not isinstance(value, str) or not 0 < len(value) <= 200:
            raise StateUnreadable(
                f'discovery document: expected a text as {key}, got "{shown(value)}"'
            )
        return value

    def topic(self, key: str) -> str:
        """Return a topic, with the base that "~" stands for."""
        value = self._values.get(key)
        if value is None and key == "state_topic":
            raise StateUnreadable(
                "discovery document: expected a state_topic, there is none; a device that tells "
                "no state cannot be used"
            )
        if isinstance(value, str) and isinstance(self._base, str):
            value = value.removesuffix("~") + self._base if value.endswith("~") else value
            value = self._base + value[1:] if value.startswith("~") else value
        if not is_topic(value):
            raise StateUnreadable(
                f"discovery document: expected one topic, without + and #, as {key}, "
                f'got "{shown(value)}"'
            )
        return str(value)

    def pointer(self) -> str:
        """Return the JSON pointer that the template of the state amounts to, "" without one."""
        given = ("state_value_template", "value_template")
        template = next((self._values[key] for key in given if key in self._values), "")
        if not template:
            return ""
        found = _TEMPLATE.fullmatch(template.strip()) if isinstance(template, str) else None
        if found is None:
            raise StateUnreadable(
                "discovery document: expected a template such as {{ value_json.state }}, got "
                f'"{shown(template)}"; give the topics in the robot file instead'
            )
        return "".join(f"/{part}" for part in _STEP.findall(found[1]))

    def availability(self) -> Iterator[Availability]:
        listed = self._values.get("availability", [])
        if "availability_topic" in self._values:
            listed = [{**self._values, "topic": self._values["availability_topic"]}]
        if not isinstance(listed, list) or len(listed) > _MOST_AVAILABILITIES:
            raise StateUnreadable(
                f"discovery document: expected a list of at most {_MOST_AVAILABILITIES} topics as "
                f'availability, got "{shown(listed)}"'
            )
        for row in listed:
            one = _Config(_in_full(row) if isinstance(row, dict) else {})
            one._base = self._base
            yield Availability(
                topic=one.topic("topic"),
                available=one.text("payload_available", "online"),
                not_available=one.text("payload_not_available", "offline"),
            )
