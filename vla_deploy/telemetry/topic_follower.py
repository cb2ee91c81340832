"""Follow the cells, rings and images of a run: what is new in them since the last read."""

import json
from collections.abc import Callable, Iterator
from typing import Final

import cv2

from drivers.clock import NS_PER_S
from vla_deploy.ipc import (
    TOPICS,
    CellReader,
    Frame,
    FrameReader,
    RingReader,
    SharedSpace,
    TopicKind,
)
from vla_deploy.ipc.rgbd_image import colours, depths_mm
from vla_deploy.telemetry.channels import ChannelValue, TopicValue

_JPEG: Final = (cv2.IMWRITE_JPEG_QUALITY, 80)
_PNG: Final = (cv2.IMWRITE_PNG_COMPRESSION, 1)


class TopicFollower:
    """Read every cell and ring; a cell that changes faster than it is read loses values."""

    def __init__(self, space: SharedSpace, *, from_start: bool = True) -> None:
        self._cells: dict[str, CellReader] = {}
        self._rings: dict[str, RingReader] = {}
        self._sequences: dict[str, int] = {}
        for topic in TOPICS:
            if topic.kind is TopicKind.CELL:
                self._cells[topic.name] = space.cell_reader(topic.name)
            elif topic.kind is TopicKind.RING:
                self._rings[topic.name] = space.ring_reader(topic.name, from_start=from_start)

    @property
    def cells(self) -> tuple[str, ...]:
        """Return the names of the cells."""
        return tuple(self._cells)

    def new_values(self) -> Iterator[ChannelValue]:
        """Yield what is new: of a cell its newest value, of a ring every event."""
        for name, cell in self._cells.items():
            sample = cell.latest()
            if sample is not None and self._sequences.get(name) != sample.sequence:
                self._sequences[name] = sample.sequence
                yield name, _value(sample.stamp_ns, sample.sequence, sample.payload)
        for name, ring in self._rings.items():
            for event in ring.drain():
                text = json.dumps(event.payload, separators=(",", ":")).encode()
                yield name, _value(event.stamp_ns, event.sequence, text)


class FrameFollower:
    """Read the newest image of some frame topics, at most once per period."""

    def __init__(
        self,
        space: SharedSpace,
        period_s: float,
        wanted: Callable[[str], bool] = lambda _: True,
    ) -> None:
        self._frames: dict[str, FrameReader] = {
            topic.name: space.frame_reader(topic.name)
            for topic in TOPICS
            if topic.kind is TopicKind.FRAME and wanted(topic.name)
        }
        self._period_ns = round(period_s * NS_PER_S)
        self._sequences: dict[str, int] = {}
        self._due_ns = 0

    def new_frames(self, now_ns: int) -> Iterator[tuple[str, Frame]]:
        """Yield the images that are new, with the names of their topics."""
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + self._period_ns
        for name, reader in self._frames.items():
            frame = reader.latest()
            if frame is not None and self._sequences.get(name) != frame.sequence:
                self._sequences[name] = frame.sequence
                yield name, frame


def image_values(topic: str, frame: Frame) -> Iterator[ChannelValue]:
    """Compress a camera image: colour as JPEG, depth as 16-bit PNG, each on its own channel."""
    _, jpeg = cv2.imencode(".jpg", colours(frame)[..., ::-1], _JPEG)
    _, png = cv2.imencode(".png", depths_mm(frame), _PNG)
    yield f"{topic}/colour", _value(frame.stamp_ns, frame.sequence, jpeg.tobytes())
    yield f"{topic}/depth", _value(frame.stamp_ns, frame.sequence, png.tobytes())


def _value(stamp_ns: int, sequence: int, payload: bytes) -> TopicValue:
    return TopicValue(stamp_ns=stamp_ns, sequence=sequence, payload=payload)
