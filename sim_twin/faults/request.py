"""Check a request for a fault against the table and the robot: all its faults in one message."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, TypeVar

from sim_twin.errors import FaultRefused
from sim_twin.faults.effect import Effect, FaultParameter
from sim_twin.faults.table import EFFECTS, faults_of
from sim_twin.faults.timing import FaultTiming
from sim_twin.faults.vocabulary import Component, Fault
from vla_deploy.robots import RobotDescription

LONGEST_S: Final = 86_400.0
_TIMING: Final[Mapping[str, tuple[float, float]]] = {
    "start_s": (0.0, LONGEST_S),
    "duration_s": (0.001, LONGEST_S),
    "period_s": (0.002, LONGEST_S),
    "duty_ratio": (0.001, 0.999),
    "probability": (0.001, 0.999),
    "seed": (0, 2**31),
}
_RHYTHM: Final = ("period_s", "duty_ratio", "probability")
_WORDS: Final = ("component", "instance", "fault", "of")

Word = TypeVar("Word", bound=Enum)


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRequest:
    """Hold a checked request; `effect` is what happens, also where it comes and goes."""

    component: Component
    instance: str | None
    number: int
    fault: Fault
    of: Fault | None
    timing: FaultTiming
    values: Mapping[str, float]
    effect: Effect

    @property
    def label(self) -> str:
        """Return the request in words."""
        where = self.component.value + (f" {self.instance}" if self.instance else "")
        return f"{where}: {self.fault.value}" + (f" {self.of.value}" if self.of else "")


def parse_request(raw: Mapping[str, Any], robot: RobotDescription) -> FaultRequest:
    """Return the request, checked: keys of `FaultTiming` and of the effect beside the words.

    Raises:
        FaultRefused: a word is unknown, the combination is not supported, or a number is missing,
            unknown or out of range.
    """
    component = _word(Component, "component", raw.get("component"))
    fault = _word(Fault, "fault", raw.get("fault"))
    rhythmic = fault is Fault.INTERMITTENT
    if fault not in faults_of(component):
        raise _unsupported(component, fault)
    of = _word(Fault, "of", raw.get("of")) if rhythmic else None
    effect = EFFECTS.get((component, of or fault))
    if effect is None:
        raise _unsupported(component, of or fault)
    part = _PARTS.get(component)
    if part is not None and getattr(robot.parts, part) is None:
        raise FaultRefused(f"{component.value}: the robot file has no [{part}]")
    device = _DEVICES.get(component)
    if device is not None and getattr(robot, device) is None:
        raise FaultRefused(f"{component.value}: the robot file has no [{device}]")
    instance, number = _instance(component, raw.get("instance"), robot)
    faults = _unknown_keys(raw, effect, rhythmic=rhythmic)
    timing = _timing(raw, faults, rhythmic=rhythmic)
    values = {each.name: _value(each, raw, faults) for each in effect.parameters}
    supplies = max(1, len(robot.servo_bus.supplies))
    if values.get("supply", 0) > supplies:
        faults.append(f"supply: expected 0..{supplies} of this robot; got {values['supply']:g}")
    if faults:
        raise FaultRefused(f"{component.value} {fault.value}: {'; '.join(faults)}")
    return FaultRequest(
        component=component,
        instance=instance,
        number=number,
        fault=fault,
        of=of,
        timing=timing,
        values=values,
        effect=effect,
    )


_DEVICES: Final = {
    Component.ESTOP: "estop",
    Component.MICROPHONE: "microphone",
    Component.SPEAKER: "speaker",
    Component.BATTERY: "battery",
    Component.BROKER: "broker",
}
"""What a component is called in the robot file, where it is no part that moves or sees."""
_PARTS: Final = {
    Component.LIDAR: "lidar",
    Component.IMU: "imu",
    Component.CAMERA: "camera",
    Component.CAN_BUS: "can_bus",
    Component.DRIVE: "can_bus",
}
"""The part of a robot that each component belongs to, where a robot may lack it."""


def instances_of(component: Component, robot: RobotDescription) -> dict[str, int]:
    """Return names and ids of what there is several of; empty where there is but one."""
    match component:
        case Component.SERVO:
            return {servo.joint: servo.id for servo in robot.servo_bus.all_servos}
        case Component.DRIVE:
            can_bus = robot.parts.can_bus
            return {one.joint: one.node_id for one in (can_bus.drives if can_bus else ())}
        case Component.HOME_DEVICE:
            return {name: number for number, name in enumerate(robot.devices, 1)}
    return {}


def _word(kind: type[Word], key: str, given: object) -> Word:
    if isinstance(given, kind):
        return given
    try:
        return kind(given)
    except ValueError:
        known = ", ".join(str(each.value) for each in kind)
        raise FaultRefused(f"{key}: expected one of {known}; got {given!r}") from None


def _unsupported(component: Component, fault: Fault) -> FaultRefused:
    supported = ", ".join(each.value for each in faults_of(component))
    return FaultRefused(
        f"{component.value}: there is no fault {fault.value!r} here; it supports {supported}"
    )


def _instance(
    component: Component, given: object, robot: RobotDescription
) -> tuple[str | None, int]:
    known = instances_of(component, robot)
    if not known:
        if given is not None:
            raise FaultRefused(f"{component.value}: there is only one; got instance {given!r}")
        return None, 0
    by_id = {str(number): name for name, number in known.items()}
    name = by_id.get(str(given), str(given))
    if name not in known:
        choices = ", ".join(f"{each} ({number})" for each, number in known.items())
        raise FaultRefused(
            f"{component.value}: instance: expected a name or an id of {choices}; got {given!r}"
        )
    return name, known[name]


def _unknown_keys(raw: Mapping[str, Any], effect: Effect, *, rhythmic: bool) -> list[str]:
    timing = [name for name in _TIMING if rhythmic or name not in _RHYTHM]
    known = [*_WORDS, *timing, *(each.name for each in effect.parameters)]
    return [f"{key}: unknown; expected {', '.join(known[4:])}" for key in raw if key not in known]


def _timing(raw: Mapping[str, Any], faults: list[str], *, rhythmic: bool) -> FaultTiming:
    given = {
        name: _number(name, raw[name], *_TIMING[name], faults)
        for name in _TIMING
        if raw.get(name) is not None
    }
    if rhythmic and "period_s" not in given:
        faults.append("period_s: expected how often it comes and goes; got nothing")
    seed = int(given.pop("seed", 0))
    return FaultTiming(**given, seed=seed)


def _value(parameter: FaultParameter, raw: Mapping[str, Any], faults: list[str]) -> float:
    given = raw.get(parameter.name, parameter.default)
    return _number(parameter.name, given, parameter.low, parameter.high, faults)


def _number(name: str, given: object, low: float, high: float, faults: list[str]) -> float:
    sound = isinstance(given, int | float) and not isinstance(given, bool) and math.isfinite(given)
    if not isinstance(given, int | float) or not sound or not low <= given <= high:
        faults.append(f"{name}: expected {low:g}..{high:g}; got {given!r}")
        return low
    return float(given)
