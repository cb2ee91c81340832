"""Plot numbers: the packed fields of topics, and some that documents tell."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from vla_deploy.ipc import BY_NAME, PackedField
from vla_deploy.ipc.topics import MAX_JOINTS
from vla_deploy.telemetry.rerun.entity import PLOTS, Entity
from vla_deploy.telemetry.schemas.geometry import Json

JOINT_TOPIC: Final = "joint_state"
_JOINT_COUNT: Final = "joint_count"
TOLD: Final[Mapping[str, tuple[str, ...]]] = {
    "control_status": (
        "period_s",
        "late_ticks",
        "speed_ratio",
        "joints.temperature_c",
        "joints.voltage_v",
    ),
    "twin_status": ("real_time_factor",),
}
"""The numbers of documents that are worth a plot, by topic; what a version does not tell is not."""


def plotted(topic: str) -> tuple[PackedField, ...]:
    """Return the packed fields that are plotted: not the beams and points, which are drawn."""
    return tuple(field for field in BY_NAME[topic].fields if field.shape <= MAX_JOINTS)


def packed(topic: str, document: Json) -> Iterator[Entity]:
    """Yield each packed field of a value; of joints those that the robot has."""
    joints = int(document.get(_JOINT_COUNT, MAX_JOINTS))
    for field in plotted(topic):
        if field.name != _JOINT_COUNT and field.name in document:
            value = document[field.name]
            yield curve(f"{topic}/{field.name}", value[:joints] if field.shape > 1 else value)


def told(topic: str, document: Json) -> Iterator[Entity]:
    """Yield the numbers of a document."""
    for name in TOLD[topic]:
        value: Any = document
        for step in name.split("."):
            value = value.get(step) if value is not None else None
        if value is not None:
            yield curve(f"{topic}/{name.replace('.', '/')}", value)


def names(message: Json) -> Iterator[Entity]:
    """Yield the joints' names for every plot that has a curve for each of them."""
    joints = [str(joint["name"]) for joint in message["joints"]]
    fields = [one.name for one in plotted(JOINT_TOPIC) if one.shape == MAX_JOINTS]
    places = [
        *(f"{JOINT_TOPIC}/{field}" for field in fields),
        *("control_status/joints/temperature_c", "control_status/joints/voltage_v"),
        "tick_record/sent",
    ]
    for place in places:
        yield Entity(
            path=f"{PLOTS}/{place}",
            archetype="SeriesLines",
            values={"names": joints},
            static=True,
        )


def curve(place: str, value: float | Sequence[float | None] | None) -> Entity:
    """Return one moment of a plot, or of several side by side; null is a gap."""
    numbers = value if isinstance(value, Sequence) else [value]
    scalars = [math.nan if number is None else float(number) for number in numbers]
    return Entity(path=f"{PLOTS}/{place}", archetype="Scalars", values={"scalars": scalars})
