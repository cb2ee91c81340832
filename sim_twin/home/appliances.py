"""Emulate the lamps and sockets on the home's broker, as Tasmota and Home Assistant have them."""

import json
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from sim_twin.home.broker import EmulatedBroker
from sim_twin.home.mqtt_packets import MqttMessage
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.home_devices import (
    DISCOVERY_PREFIX,
    DeviceKind,
    HomeDevice,
    MqttTopics,
)

_COMPONENTS: Final[Mapping[DeviceKind, str]] = {DeviceKind.LAMP: "light"}


class ApplianceFault(StrEnum):
    """Name what may be wrong with an appliance."""

    NONE = "none"
    STUCK = "stuck"
    FLIPS_BACK = "flips_back"
    SILENT = "silent"


class EmulatedAppliance:
    """Be one lamp or socket: it follows its commands and says what it is then."""

    def __init__(self, broker: EmulatedBroker, device: HomeDevice, topics: MqttTopics) -> None:
        """Announce it where it is declared by its discovery id, and say that it is off."""
        self.is_on = False
        self.fault = ApplianceFault.NONE
        self._broker = broker
        self._topics = topics if topics.command_topic else _announced(broker, device, topics)
        broker.on_message(self._topics.command_topic, self._obey)
        if self._topics.availability_topic:
            payload = self._topics.payload_available.encode()
            broker.publish(self._topics.availability_topic, payload, retain=True)
        self._tell()

    def press(self) -> None:
        """Switch it over by hand."""
        self._become(not self.is_on)

    def _obey(self, message: MqttMessage) -> None:
        wanted = {self._topics.payload_on.encode(): True, self._topics.payload_off.encode(): False}
        on = wanted.get(message.payload)
        if on is None or self.fault is ApplianceFault.SILENT:
            return
        before = self.is_on
        self._become(before if self.fault is ApplianceFault.STUCK else on)
        if self.fault is ApplianceFault.FLIPS_BACK:
            self._become(before)

    def _become(self, on: bool) -> None:
        self.is_on = on
        self._tell()

    def _tell(self) -> None:
        topics = self._topics
        on, off = topics.state_on or topics.payload_on, topics.state_off or topics.payload_off
        said: Any = on if self.is_on else off
        for key in reversed(topics.pointer.split("/")[1:]):
            said = {key: said}
        text = said if isinstance(said, str) else json.dumps(said)
        self._broker.publish(topics.state_topic, text.encode(), retain=True)


def _announced(broker: EmulatedBroker, device: HomeDevice, topics: MqttTopics) -> MqttTopics:
    """Publish a discovery document, and return the topics that it gives."""
    base = f"home/{topics.discovery}"
    component = _COMPONENTS.get(device.kind, "switch")
    document = {
        "~": base,
        "name": device.spoken.capitalize(),
        "unique_id": topics.discovery,
        "cmd_t": "~/set",
        "stat_t": "~/state",
        "avty_t": "~/availability",
        "ret": True,
    }
    where = f"{DISCOVERY_PREFIX}/{component}/{topics.discovery}/config"
    broker.publish(where, json.dumps(document).encode(), retain=True)
    return MqttTopics(
        command_topic=f"{base}/set",
        state_topic=f"{base}/state",
        availability_topic=f"{base}/availability",
    )


class EmulatedHome:
    """Hold the broker of a home, and what is switched in it."""

    def __init__(self, robot: RobotDescription, path: Path) -> None:
        """Serve the devices on MQTT that the robot file names, at the path of a socket.

        Raises:
            OSError: the path cannot be bound.
        """
        self.broker = EmulatedBroker(path)
        self.appliances = {
            name: EmulatedAppliance(self.broker, device, device.mqtt)
            for name, device in robot.devices.items()
            if device.mqtt is not None
        }

    @property
    def switched_on(self) -> frozenset[str]:
        """Return the names of what is on."""
        return frozenset(name for name, one in self.appliances.items() if one.is_on)

    def close(self) -> None:
        """End the broker."""
        self.broker.close()
