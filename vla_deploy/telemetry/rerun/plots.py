"""Plot numbers: packed fields of topics, some numbers of documents, and control's ticks."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import BY_NAME, PackedField
from vla_deploy.ipc.memory.delta import DeltaReader
from vla_deploy.ipc.topics import MAX_JOINTS
from vla_deploy.telemetry.channels import TICKS, tick_bytes
from vla_deploy.telemetry.judge import JUDGED_TYPES
from vla_deploy.telemetry.rerun.entity import PLOTS, DrawnMessage, Entity
from vla_deploy.telemetry.schemas.foxglove_json import Json

JOINT_TOPIC: Final = "joint_state"
_JOINT_COUNT: Final = "joint_count"
_SENT: Final = ("sent", "sent_v_m_s", "sent_w_rad_s", "sent_left_m_s")
DOCUMENT_NUMBERS: Final[Mapping[str, tuple[str, ...]]] = {
    "control_status": (
        "period_s",
        "late_ticks",
        "speed_ratio",
        "joints.temperature_c",
        "joints.voltage_v",
    ),
    "twin_status": ("real_time_factor",),
    "battery": ("charge_ratio", "voltage_v", "current_a"),
}
"""The numbers of documents that are plotted, by topic, where a document has them."""


def plotted(topic: str) -> tuple[PackedField, ...]:
    """Return the packed fields that are plotted: all but beams and points, which are drawn."""
    return tuple(field for field in BY_NAME[topic].fields if field.shape <= MAX_JOINTS)


def packed(topic: str, document: Json) -> Iterator[Entity]:
    """Yield each packed field of a value, of arrays over joints as many as the robot has."""
    joints = int(document.get(_JOINT_COUNT, MAX_JOINTS))
    for field in plotted(topic):
        if field.name != _JOINT_COUNT and field.name in document:
            value = document[field.name]
            yield curve(f"{topic}/{field.name}", value[:joints] if field.shape > 1 else value)


def numbers(topic: str, document: Json) -> Iterator[Entity]:
    """Yield the numbers of a document."""
    for name in DOCUMENT_NUMBERS[topic]:
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
    """Return one moment of a plot of one or more curves; null is a gap."""
    values = value if isinstance(value, Sequence) else [value]
    scalars = [math.nan if one is None else float(one) for one in values]
    return Entity(path=f"{PLOTS}/{place}", archetype="Scalars", values={"scalars": scalars})


class TickPlotter:
    """Plot the tick records of one writer, in their order: period, speed ratio, what was sent."""

    def __init__(self) -> None:
        self._reader = DeltaReader(JUDGED_TYPES)
        self._before: tuple[int, int] | None = None

    def draw(self, text: bytes) -> DrawnMessage:
        """Return the entities of a tick; none where a record before it is missing.

        Raises:
            BadPayload: its record cannot be read, or this version does not know what it carries.
        """
        row = self._reader.row(tick_bytes(text))
        if row is None:
            return DrawnMessage(entities=())
        return DrawnMessage(entities=tuple(self._curves(row)), tick=row["tick"])

    def _curves(self, row: dict[str, Any]) -> Iterator[Entity]:
        tick, now_ns = row["tick"], row["now_ns"]
        before, self._before = self._before, (tick, now_ns)
        if before is not None and before[0] + 1 == tick:
            yield curve(f"{TICKS}/period_s", (now_ns - before[1]) / NS_PER_S)
        yield curve(f"{TICKS}/speed_ratio", row["verdict"].speed_ratio)
        for name in _SENT:
            if (value := row.get(name)) is not None:  # an older version sent less
                yield curve(f"{TICKS}/{name}", _plain(value))


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value
