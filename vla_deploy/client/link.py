"""Reach the robot through its shared memory: what it tells, what a person may tell it."""

import itertools
import os
from pathlib import Path
from typing import Any, Final, Unpack

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import clock_of
from vla_deploy.ipc import (
    CellReader,
    Frame,
    FrameReader,
    RingReader,
    RingWriter,
    Sample,
    SharedSpace,
    Topic,
    topics,
)
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.payloads.tasks import UtteranceContent
from vla_deploy.ipc.stop_button import ESTOP, StopButton
from vla_deploy.ipc.topics import P

PAGE: Final = "page"


class RobotLink:
    """Read topics and send acts and commands of one source; nothing here waits for anybody."""

    def __init__(
        self,
        run_dir: Path,
        clock: Clock | None = None,
        *,
        source: str = PAGE,
        robot: str = "butler",
    ) -> None:
        """Open the run's shared memory; `robot` is the name or folder of its description.

        Raises:
            SpaceUnavailable: it cannot be opened.
        """
        self.run_dir = run_dir
        self.clock: Clock = clock or clock_of(run_dir)
        self.source = source
        self.robot = robot
        self._space = SharedSpace(run_dir / "ipc", self.clock)
        self._cells: dict[Topic[Any] | str, CellReader[Any]] = {}
        self._frames: dict[Topic | str, FrameReader] = {}
        self._writers: dict[Topic[Any] | str, RingWriter[Any]] = {}
        self._stop_button: StopButton | None = None
        self._numbers = itertools.count(1)

    @property
    def base(self) -> Path:
        """Return the runtime directory, by which settings, accounts and flights are found."""
        return self.run_dir.parent

    @property
    def space(self) -> SharedSpace:
        """Return the run's shared memory."""
        return self._space

    def fresh(self, topic: Topic[P] | str, age_limit_s: float | None = None) -> Sample[P] | None:
        """Return the newest sample of a cell, or None when there is none that young."""
        if topic not in self._cells:
            self._cells[topic] = self._space.cell_reader(topic)
        sample = self._cells[topic].latest()
        if sample is None or age_limit_s is None:
            return sample
        return sample if sample.age_s(self.clock.now_ns()) <= age_limit_s else None

    def document(self, topic: Topic[P] | str, age_limit_s: float | None = None) -> P | None:
        """Return the newest JSON document of a cell, or None when there is none that young."""
        sample = self.fresh(topic, age_limit_s)
        return None if sample is None else sample.document()

    def frame(self, topic: Topic | str, age_limit_s: float) -> Frame | None:
        """Return the newest image of a frame ring, or None when there is none that young."""
        if topic not in self._frames:
            self._frames[topic] = self._space.frame_reader(topic)
        frame = self._frames[topic].latest()
        if frame is None:
            return None
        age_s = (self.clock.now_ns() - frame.stamp_ns) / NS_PER_S
        return frame if age_s <= age_limit_s else None

    def events(self, topic: Topic[P] | str, *, from_start: bool = False) -> RingReader[P]:
        """Return what comes on a ring from now on, or also what is still in it."""
        return self._space.ring_reader(topic, from_start=from_start)

    def writer(self, topic: Topic[P] | str) -> RingWriter[P]:
        """Return the writer of a ring, which it opens at first use."""
        if topic not in self._writers:
            self._writers[topic] = self._space.ring_writer(topic)
        return self._writers[topic]

    def operate(self, act: OperatorActName, reason: str = "", source: str = "") -> None:
        """Publish an operator's act: estop, reset, arm or disarm; control reads it directly."""
        if act == ESTOP:
            self._press(reason, source or self.source)
            return
        self.writer(topics.OPERATOR).publish(
            {"act": act, "source": source or self.source, "reason": reason}
        )

    def utter(
        self, *, command_id: str = "", source: str = "", **content: Unpack[UtteranceContent]
    ) -> str:
        """Say something to the planner, and return the id that answers to it carry.

        `command_id` is for what is about a command, `source` for who speaks through this one.

        Raises:
            BadPayload: it is longer than a slot of the ring.
        """
        command_id = command_id or f"{self.source}-{os.getpid()}-{next(self._numbers)}"
        self.writer(topics.UTTERANCE).publish(
            {"command_id": command_id, "source": source or self.source, **content}
        )
        return command_id

    def close(self) -> None:
        """Let go of the run's shared memory."""
        self._space.close()

    def _press(self, reason: str, source: str) -> None:
        if self._stop_button is None:
            self._stop_button = StopButton(self._space, source, self.clock)
        self._stop_button.source = source
        self._stop_button.press(reason)
