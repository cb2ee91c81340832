"""Draw messages as entities of Rerun: one table from the channels of a recording to drawings."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from vla_deploy.ipc import TOPICS, TopicKind
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.rerun import drawing, plots
from vla_deploy.telemetry.rerun.entity import LOGS, PLOTS, WORLD, DrawnMessage, Entity
from vla_deploy.telemetry.schemas.foxglove_json import Json

Drawer = Callable[[bytes], DrawnMessage]
_BASE: Final = f"{WORLD}/base"
_CAMERA: Final = f"{_BASE}/camera"


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelDrawing:
    """Draw the messages of one channel at `path` and below."""

    channel: str
    path: str
    draw: Callable[[Json], Iterator[Entity]]


VIEWS: Final[tuple[ChannelDrawing, ...]] = (
    ChannelDrawing(channel="view/frames", path=_BASE, draw=drawing.transforms),
    ChannelDrawing(channel="view/base_frame", path=_BASE, draw=drawing.transforms),
    ChannelDrawing(channel="view/pose", path=f"{WORLD}/pose", draw=drawing.heading),
    ChannelDrawing(channel="view/odometry", path="odom/base", draw=drawing.odometry),
    ChannelDrawing(channel="view/joints", path=PLOTS, draw=plots.names),
    ChannelDrawing(channel="view/scan", path=f"{_BASE}/scan", draw=drawing.scan),
    ChannelDrawing(
        channel="view/near_obstacles", path=f"{_BASE}/near_obstacles", draw=drawing.obstacles
    ),
    ChannelDrawing(channel="view/scene", path=f"{WORLD}/scene", draw=drawing.scene),
    ChannelDrawing(channel="view/zones", path=f"{WORLD}/zones", draw=drawing.zones),
    ChannelDrawing(channel="view/map", path=f"{WORLD}/map", draw=drawing.grid),
    ChannelDrawing(channel="view/lens", path=_CAMERA, draw=drawing.lens),
    ChannelDrawing(channel="rgbd/colour", path=f"{_CAMERA}/colour", draw=drawing.colour),
    ChannelDrawing(channel="rgbd/depth", path=f"{_CAMERA}/depth", draw=drawing.depth),
    ChannelDrawing(channel="view/log", path=LOGS, draw=drawing.line),
)
"""The drawings of the messages that Foxglove gets as well."""


def _view(row: ChannelDrawing) -> Drawer:
    return lambda text: DrawnMessage(entities=tuple(row.draw(json.loads(text))))


def _plot(topic: str) -> Drawer:
    return lambda text: DrawnMessage(entities=tuple(plots.packed(topic, json.loads(text))))


def _numbers(topic: str) -> Drawer:
    def drawn(text: bytes) -> DrawnMessage:
        document = json.loads(text)
        return DrawnMessage(
            entities=tuple(plots.numbers(topic, document)), tick=document.get("tick")
        )

    return drawn


def _event(topic: str) -> Drawer:
    return lambda text: DrawnMessage(entities=tuple(drawing.event(topic, text)))


_DRAWERS: Final[Mapping[str, Drawer]] = {
    **{row.channel: _view(row) for row in VIEWS},
    **{
        topic.name: _plot(topic.name)
        for topic in TOPICS
        if topic.kind is TopicKind.CELL and not is_document(topic)
    },
    **{topic: _numbers(topic) for topic in plots.DOCUMENT_NUMBERS},
    **{
        topic.name: _event(topic.name)
        for topic in TOPICS
        if topic.kind is TopicKind.RING and not topic.private
    },
}


def is_drawn(channel: str) -> bool:
    """Return whether a channel is drawn."""
    return channel == TICKS or channel in _DRAWERS


class MessageDrawer:
    """Draw the messages of one file or one run; it remembers the tick before."""

    def __init__(self) -> None:
        self._drawers = {**_DRAWERS, TICKS: plots.TickPlotter().draw}

    def draw(self, channel: str, text: bytes) -> DrawnMessage:
        """Return the entities of a message; none for a channel that is not drawn.

        Raises:
            Exception: the message is not what its channel says.
        """
        drawer = self._drawers.get(channel)
        return DrawnMessage(entities=()) if drawer is None else drawer(text)
