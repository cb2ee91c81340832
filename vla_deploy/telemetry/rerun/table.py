"""List what becomes what in Rerun: the one table, from channels of a recording to entities."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from vla_deploy.ipc import TOPICS, TopicKind
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.rerun import flat, plots, shapes, spatial
from vla_deploy.telemetry.rerun.entity import LOGS, PLOTS, WORLD, Drawn, Entity
from vla_deploy.telemetry.rerun.ticks import Ticks
from vla_deploy.telemetry.schemas.geometry import Json

Drawer = Callable[[bytes], Drawn]
_BASE: Final = f"{WORLD}/base"
_CAMERA: Final = f"{_BASE}/camera"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Draw the messages of one channel at `path` and below."""

    channel: str
    path: str
    draw: Callable[[Json], Iterator[Entity]]


VIEWS: Final[tuple[Row, ...]] = (
    Row(channel="view/frames", path=_BASE, draw=spatial.transforms),
    Row(channel="view/base_frame", path=_BASE, draw=spatial.transforms),
    Row(channel="view/pose", path=f"{WORLD}/pose", draw=spatial.heading),
    Row(channel="view/odometry", path="odom/base", draw=spatial.odometry),
    Row(channel="view/joints", path=PLOTS, draw=plots.names),
    Row(channel="view/scan", path=f"{_BASE}/scan", draw=spatial.scan),
    Row(channel="view/near_obstacles", path=f"{_BASE}/near_obstacles", draw=spatial.obstacles),
    Row(channel="view/scene", path=f"{WORLD}/scene", draw=shapes.scene),
    Row(channel="view/zones", path=f"{WORLD}/zones", draw=shapes.zones),
    Row(channel="view/map", path=f"{WORLD}/map", draw=spatial.grid),
    Row(channel="view/lens", path=_CAMERA, draw=spatial.lens),
    Row(channel="rgbd/colour", path=f"{_CAMERA}/colour", draw=flat.colour),
    Row(channel="rgbd/depth", path=f"{_CAMERA}/depth", draw=flat.depth),
    Row(channel="view/log", path=LOGS, draw=flat.line),
)
"""What viewers are shown, from the very messages that Foxglove gets."""


def _view(row: Row) -> Drawer:
    return lambda text: Drawn(entities=tuple(row.draw(json.loads(text))))


def _plot(topic: str) -> Drawer:
    return lambda text: Drawn(entities=tuple(plots.packed(topic, json.loads(text))))


def _numbers(topic: str) -> Drawer:
    def drawn(text: bytes) -> Drawn:
        document = json.loads(text)
        return Drawn(entities=tuple(plots.told(topic, document)), tick=document.get("tick"))

    return drawn


def _event(topic: str) -> Drawer:
    return lambda text: Drawn(entities=tuple(flat.event(topic, text)))


_DRAWERS: Final[Mapping[str, Drawer]] = {
    **{row.channel: _view(row) for row in VIEWS},
    **{
        topic.name: _plot(topic.name)
        for topic in TOPICS
        if topic.kind is TopicKind.CELL and not is_document(topic)
    },
    **{topic: _numbers(topic) for topic in plots.TOLD},
    **{
        topic.name: _event(topic.name)
        for topic in TOPICS
        if topic.kind is TopicKind.RING and not topic.private
    },
}


def is_drawn(channel: str) -> bool:
    """Tell whether a channel becomes anything."""
    return channel == TICKS or channel in _DRAWERS


class Table:
    """Draw messages; it remembers the tick before, so it is for one file or one run."""

    def __init__(self) -> None:
        self._drawers = {**_DRAWERS, TICKS: Ticks().drawn}

    def drawn(self, channel: str, text: bytes) -> Drawn:
        """Return what a message becomes; nothing for a channel that is not drawn.

        Raises:
            Exception: the message is not what its channel says.
        """
        drawer = self._drawers.get(channel)
        return Drawn(entities=()) if drawer is None else drawer(text)
