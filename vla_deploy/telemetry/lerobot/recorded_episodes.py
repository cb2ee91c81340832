"""Find the episodes of a recording, and read their frames at a steady rate."""

import base64
import json
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.ipc import topics
from vla_deploy.telemetry.errors import DatasetRefused
from vla_deploy.telemetry.lerobot.video import Image
from vla_deploy.telemetry.recorded_file import RecordedFile, RecordedMessage

Floats = NDArray[np.float64]
_COLOUR: Final = "/colour"
_JOINTS: Final = topics.JOINT_STATE.name
_COMMANDS: Final = (topics.UTTERANCE.name, topics.TASK_EVENT.name)
_LEAD_NS: Final = 3 * NS_PER_S
"""Read before an episode begins: the last image before it may be so old."""
MAX_GAP_S: Final = 0.5
"""Joint values are recorded 25 times a second; across a longer gap nothing is made up."""
_KEPT_IMAGES: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedEpisode:
    """Bound an episode in the clock of the recorded run; `task` is in words."""

    task: str
    begins_ns: int
    ends_ns: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EpisodeFrame:
    """Hold where the joints were, where they were to be, and what the cameras saw last."""

    state: Floats
    action: Floats
    images: Mapping[str, Image]


def spoken_episodes(file: RecordedFile, *, with_failed: bool = False) -> list[RecordedEpisode]:
    """Return an episode for each command in words, from its first action to its end.

    Raises:
        FlightUnreadable: the file is spoiled.
    """
    words: dict[str, str] = {}
    begun: dict[str, int] = {}
    episodes = []
    for message in file.messages(*_COMMANDS):
        document = message.document()
        command = str(document.get("command_id", ""))
        if message.channel == topics.UTTERANCE.name:
            if text := str(document.get("text") or "").strip():
                words[command] = text
        elif document.get("event") == "action":
            begun.setdefault(command, message.stamp_ns)
        elif document.get("event") == "finished" and command in begun and command in words:
            took = {"begins_ns": begun.pop(command), "ends_ns": message.stamp_ns}
            episodes.append((document.get("success"), RecordedEpisode(task=words[command], **took)))
    return [episode for success, episode in episodes if success or with_failed]


def whole_recording(file: RecordedFile, task: str) -> RecordedEpisode:
    """Return the episode that is all of a recording."""
    return RecordedEpisode(task=task, begins_ns=file.start_ns, ends_ns=file.end_ns)


def cameras_of(file: RecordedFile) -> tuple[str, ...]:
    """Return the names of the cameras whose colour images a recording has."""
    return tuple(
        sorted(
            channel.removesuffix(_COLOUR)
            for channel, count in file.counts.items()
            if channel.endswith(_COLOUR) and count
        )
    )


def frames_of(
    file: RecordedFile, episode: RecordedEpisode, *, joints: int, cameras: Sequence[str], fps: int
) -> Iterator[EpisodeFrame]:
    """Yield the frames of an episode: joints in between of their samples, the last image before.

    The first frame is the one for which every camera has an image.

    Raises:
        DatasetRefused: joint values are missing for longer than a moment, or of another robot.
        FlightUnreadable: the file is spoiled.
    """
    reader = _FrameReader(file, episode, joints, cameras, fps)
    channels = (_JOINTS, *(camera + _COLOUR for camera in cameras))
    from_ns = episode.begins_ns + file.wall_offset_ns - _LEAD_NS
    to_ns = episode.ends_ns + file.wall_offset_ns + round(MAX_GAP_S * NS_PER_S)
    for message in file.messages_between(from_ns, to_ns, *channels):
        yield from reader.take(message)
        if reader.is_over:
            return
    reader.require_end()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Sample:
    at_ns: int
    values: Floats


class _FrameReader:
    """Turn joint samples and images, as they come, into frames at a steady rate."""

    def __init__(
        self,
        file: RecordedFile,
        episode: RecordedEpisode,
        joints: int,
        cameras: Sequence[str],
        fps: int,
    ) -> None:
        self.is_over = False
        self._file = file
        self._episode = episode
        self._joints = joints
        self._period_ns = NS_PER_S / fps
        self._before: _Sample | None = None
        self._images: dict[str, deque[tuple[int, bytes]]] = {
            camera: deque(maxlen=_KEPT_IMAGES) for camera in cameras
        }
        self._decoded: dict[str, tuple[int, Image]] = {}
        self._next = 0

    def take(self, message: RecordedMessage) -> Iterator[EpisodeFrame]:
        """Take in a message, and yield the frames that are complete by it."""
        if message.channel != _JOINTS:
            camera = message.channel.removesuffix(_COLOUR)
            self._images[camera].append((message.stamp_ns, message.text))
            return
        sample = self._sample(message)
        if sample is None:
            return
        before, self._before = self._before, sample
        if before is not None and sample.at_ns > before.at_ns:
            yield from self._frames(before, sample)
        self.is_over = sample.at_ns >= self._episode.ends_ns

    def require_end(self) -> None:
        """Check that the last sample is at the end of the episode, or nearly.

        Raises:
            DatasetRefused: it is not.
        """
        last_ns = self._episode.begins_ns if self._before is None else self._before.at_ns
        self._require_no_gap(last_ns, self._episode.ends_ns)

    def _sample(self, message: RecordedMessage) -> _Sample | None:
        """Return the joints' values; None where one of them was not known."""
        document = message.document()
        if document.get("joint_count") != self._joints:
            raise DatasetRefused(
                f"{self._file.path.name}: joint_state of {document.get('joint_count')} joints, "
                f"expected {self._joints} as the robot {self._file.robot} has now"
            )
        rows: list[Any] = [document[key][: self._joints] for key in ("position", "setpoint")]
        values = np.array(rows, dtype=np.float64)
        return _Sample(at_ns=message.stamp_ns, values=values) if np.isfinite(values).all() else None

    def _frames(self, before: _Sample, after: _Sample) -> Iterator[EpisodeFrame]:
        end_ns = min(after.at_ns, self._episode.ends_ns)
        while (at_ns := self._episode.begins_ns + round(self._next * self._period_ns)) <= end_ns:
            if at_ns >= before.at_ns:
                self._require_no_gap(before.at_ns, after.at_ns)
                part = (at_ns - before.at_ns) / (after.at_ns - before.at_ns)
                state, action = before.values + part * (after.values - before.values)
                images = {camera: self._image(camera, at_ns) for camera in self._images}
                known = {camera: image for camera, image in images.items() if image is not None}
                if len(known) == len(images):
                    yield EpisodeFrame(state=state, action=action, images=known)
            self._next += 1

    def _require_no_gap(self, before_ns: int, after_ns: int) -> None:
        gap_s = (after_ns - before_ns) / NS_PER_S
        if gap_s > MAX_GAP_S:
            at_s = (before_ns - self._file.start_ns) / NS_PER_S
            raise DatasetRefused(
                f"{self._file.path.name}: no joint values for {gap_s:.2f} s from {at_s:.2f} s on, "
                f"expected at most {MAX_GAP_S} s: leave this recording out, or record again"
            )

    def _image(self, camera: str, at_ns: int) -> Image | None:
        """Return the last image before a moment; it is decoded once."""
        held = [one for one in self._images[camera] if one[0] <= at_ns]
        if not held:
            return None
        stamp_ns, text = held[-1]
        if self._decoded.get(camera, (-1,))[0] != stamp_ns:
            self._decoded[camera] = stamp_ns, self._decode(camera, text)
        return self._decoded[camera][1]

    def _decode(self, camera: str, text: bytes) -> Image:
        data = base64.b64decode(json.loads(text)["data"])
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        if pixels is None:
            raise DatasetRefused(f"{self._file.path.name}: an image of {camera} is spoiled")
        rgb: Image = np.ascontiguousarray(pixels[..., ::-1])
        return rgb
