"""Publish how the robot is, and what happens to it.

/vla_deploy/state, /battery_state, /diagnostics, /vla_deploy/events.
"""

import json
import math
import statistics
from collections.abc import Mapping
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import BatteryState
from vla_deploy_msgs.msg import RobotEvent, RobotState

from vla_deploy.gateways.ros.graph import LATCHED, SENSOR
from vla_deploy.gateways.ros.outward.health import TOPICS, PartHealth, health_of
from vla_deploy.gateways.ros.part import Due, Gateway, GatewayPart
from vla_deploy.ipc import RingReader, topics

STATE_HZ: Final = 2.0
LOOK_HZ: Final = 10.0
"""How often a change is looked for."""
DIAGNOSTICS_HZ: Final = 1.0
BATTERY_HZ: Final = 1.0
_EXECUTOR_AGE_S: Final = 1.0
_POSE_AGE_S: Final = 0.5
_PLACES: Final = ("tracking", "unsure", "lost")
_UNMEASURED: Final = math.nan
_FULL: Final = 0.99
_NOT_MEASURED: Final = (
    *("temperature", "current", "charge", "capacity", "design_capacity", "percentage"),
)
EVENT_SOURCES: Final = {
    "task_event": "event",
    "operator": "act",
    "voice_event": "event",
    "heard": "verdict",
    "motion_result": "status",
    "flight_event": "event",
}
"""By the topic of shared memory, the key whose value is the kind of event."""


class StateTopic(GatewayPart):
    """Publish /vla_deploy/state twice a second, and when something of it changes."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._state = gateway.graph.publisher(RobotState, "/vla_deploy/state", LATCHED)
        self._due = Due(STATE_HZ)
        self._look_due = Due(LOOK_HZ)
        self._published: tuple[Any, ...] = ()

    def step(self, now_ns: int) -> None:
        """Publish what is due or new."""
        if not self._look_due.is_now(now_ns):
            return
        control = self._gateway.control_status()
        executor = self._gateway.link.document(topics.EXECUTOR_STATUS, _EXECUTOR_AGE_S)
        key = _what_changes(control or {}, executor or {})
        if key != self._published or self._due.is_now(now_ns):
            self._published = key
            self._state.publish(self._message(control, executor or {}))

    def stop(self) -> None:
        """Publish last that the robot's state is unknown."""
        self._state.publish(self._message(None, {}))

    def _message(
        self, control: Mapping[str, Any] | None, executor: Mapping[str, Any]
    ) -> RobotState:
        gateway, known = self._gateway, control or {}
        pose = gateway.link.fresh(topics.POSE, _POSE_AGE_S)
        charge = (gateway.battery() or {}).get("charge_ratio")
        return RobotState(
            stamp=gateway.time.now(),
            robot=gateway.robot.name,
            control_state=RobotState.UNKNOWN if control is None else str(control["state"]),
            armed=known.get("state") == RobotState.ARMED,
            estop_latched=bool(known.get("estop_latched", False)),
            cause=str(known.get("cause") or ""),
            detail=str(known.get("detail") or ""),
            speed_ratio=float(known.get("speed_ratio", 0.0)),
            executor_state=str(executor.get("state") or RobotState.UNKNOWN),
            command_id=str(executor.get("command_id") or ""),
            action_id=str(executor.get("action_id") or ""),
            skill=str(executor.get("skill") or ""),
            battery_ratio=_UNMEASURED if charge is None else float(charge),
            localisation="" if pose is None else _PLACES[min(int(pose.data["state"]), 2)],
        )


def _what_changes(control: Mapping[str, Any], executor: Mapping[str, Any]) -> tuple[Any, ...]:
    return (
        *(control.get(key) for key in ("state", "estop_latched", "cause")),
        *(executor.get(key) for key in ("state", "command_id", "action_id", "skill")),
    )


class SupplyTopic(GatewayPart):
    """Publish /battery_state: the battery, or where none is declared the supply of the servos."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._battery = gateway.graph.publisher(BatteryState, "/battery_state", SENSOR)
        self._due = Due(BATTERY_HZ)

    def step(self, now_ns: int) -> None:
        """Publish what is due."""
        if not self._due.is_now(now_ns):
            return
        battery = self._gateway.battery()
        if battery is not None:
            self._battery.publish(self._message_of(battery))
        if self._gateway.robot.battery is not None:
            return
        control = self._gateway.control_status() or {}
        measured = control.get("joints", {}).get("voltage_v", ())
        volts = [float(one) for one in measured if one is not None]
        if volts:
            self._battery.publish(self._message(statistics.median(volts)))

    def _message_of(self, battery: Mapping[str, Any]) -> BatteryState:
        """Return the battery as it is measured; what is not, is NaN. A current out is negative."""
        message = self._message(_or_nan(battery["voltage_v"]))
        message.current = _or_nan(battery["current_a"])
        message.percentage = _or_nan(battery["charge_ratio"])
        message.power_supply_status = _status_of(battery)
        message.location = f"battery, by {battery['source']}"
        return message

    def _message(self, volts: float) -> BatteryState:
        message = BatteryState(
            voltage=volts,
            **dict.fromkeys(_NOT_MEASURED, _UNMEASURED),
            power_supply_status=BatteryState.POWER_SUPPLY_STATUS_UNKNOWN,
            power_supply_health=BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN,
            power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
            present=True,
            location="supply of the servo bus",
        )
        message.header.stamp = self._gateway.time.now()
        return message


def _or_nan(value: float | None) -> float:
    return _UNMEASURED if value is None else float(value)


def _status_of(battery: Mapping[str, Any]) -> int:
    charging, charge = battery["is_charging"], battery["charge_ratio"]
    if charging is None:
        return int(BatteryState.POWER_SUPPLY_STATUS_UNKNOWN)
    if charging:
        return int(BatteryState.POWER_SUPPLY_STATUS_CHARGING)
    if charge is not None and charge >= _FULL and not (battery["current_a"] or 0.0) < 0.0:
        return int(BatteryState.POWER_SUPPLY_STATUS_FULL)
    return int(BatteryState.POWER_SUPPLY_STATUS_DISCHARGING)


class HealthTopic(GatewayPart):
    """Publish /diagnostics once a second."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._array = gateway.graph.publisher(DiagnosticArray, "/diagnostics")
        self._due = Due(DIAGNOSTICS_HZ)

    def step(self, now_ns: int) -> None:
        """Publish what is due."""
        if not self._due.is_now(now_ns):
            return
        gateway = self._gateway
        found = health_of(
            {topic: gateway.link.document(topic, age_s) for topic, age_s in TOPICS.items()}
        )
        message = DiagnosticArray(status=[_status(one, gateway.robot.name) for one in found])
        message.header.stamp = gateway.time.now()
        self._array.publish(message)


def _status(health: PartHealth, robot: str) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes([health.level]),
        name=f"vla_deploy: {health.name}",
        message=health.message,
        hardware_id=robot,
        values=[KeyValue(key=key, value=_text(one)) for key, one in health.values.items()],
    )


def _text(value: Any) -> str:
    return "none" if value is None else str(value)


class EventsTopic(GatewayPart):
    """Publish every event of those topics, in their order within each."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._events = gateway.graph.publisher(RobotEvent, "/vla_deploy/events")
        self._rings: dict[str, RingReader[dict[str, Any]]] = {
            source: gateway.link.events(source) for source in EVENT_SOURCES
        }

    def step(self, now_ns: int) -> None:
        """Publish what is new."""
        for source, ring in self._rings.items():
            for event in ring.drain():
                self._events.publish(
                    RobotEvent(
                        stamp=self._gateway.time.stamp(event.stamp_ns),
                        kind=str(event.payload.get(EVENT_SOURCES[source]) or source),
                        source=source,
                        json=json.dumps(event.payload, separators=(",", ":"), ensure_ascii=False),
                    )
                )

    def stop(self) -> None:
        """Close the topics."""
        for ring in self._rings.values():
            ring.close()
