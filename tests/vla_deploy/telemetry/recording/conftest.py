"""Provide a run whose topics the tests write, and a rolling recorder that writes at once."""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.recording.folder import RecordingFolder
from vla_deploy.telemetry.recording.recorder import RollingRecorder
from vla_deploy.telemetry.recording.settings import RecordingSettings
from vla_deploy.telemetry.topic_history import TopicHistory

STEP_S = 0.04


class Rig:
    """Hold a run directory, what its processes would write, and the recorder."""

    def __init__(self, tmp_path: Path, context: NodeContext, clock: Any) -> None:
        self.clock = clock
        self.context = context
        self.run_dir = context.run_dir
        self.space = SharedSpace(self.run_dir / "ipc", clock)
        self.folder_path = tmp_path / "recordings"
        self.requests = self.space.ring_writer("recording_request")
        self.status = self.space.cell_reader("recording_status")
        self._base = self.space.cell_writer("base_state")
        self._control = self.space.cell_writer("control_status")
        self._control.put_document({"state": "armed", "tick": 1})
        self._history = TopicHistory(self.space)
        self.recorder: RollingRecorder
        self._open: list[RollingRecorder] = []

    def begin(self, executor: Executor | None = None, **settings: Any) -> None:
        chosen = RecordingSettings(**{"spare_mb": 0.0, **settings})
        self.folder = RecordingFolder(self.folder_path, chosen.bounds)
        self.recorder = RollingRecorder(
            self.context,
            self.space,
            self.clock.wall_ns,
            settings=chosen,
            folder=self.folder,
            executor=executor or InlineExecutor(),
        )
        self.recorder.start()
        if executor is None:
            self._open.append(self.recorder)

    def close(self) -> None:
        for recorder in self._open:
            recorder.stop()
        self.space.close()

    def run(self, seconds: float, each: Callable[[], None] = lambda: None) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.clock.time_ns += round(STEP_S * NS_PER_S)
            x_m = self.clock.time_ns / NS_PER_S
            self._base.put(x_m=x_m, y_m=0.0, yaw_rad=0.0, v_m_s=0.0, w_rad_s=0.0, enabled=1)
            each()
            now_ns = self.clock.now_ns()
            self.recorder.step(now_ns, self._history.refresh(now_ns), self._history.newest)

    def ask(self, **request: Any) -> None:
        self.requests.publish({"act": "start", "source": "test", **request})

    def report(self) -> dict[str, Any]:
        sample = self.status.latest()
        assert sample is not None
        return sample.document()


@pytest.fixture
def rig(tmp_path: Path, context: NodeContext, clock: Any) -> Iterator[Rig]:
    rig = Rig(tmp_path, context, clock)
    yield rig
    rig.close()


@pytest.fixture
def read() -> Callable[[Path], list[tuple[str, int, Any]]]:
    """Return topic, stamp and document of every message, by the library's standard reader."""

    def messages(path: Path) -> list[tuple[str, int, Any]]:
        with path.open("rb") as file:
            return [
                (channel.topic, message.log_time, json.loads(message.data))
                for _, channel, message in make_reader(file, validate_crcs=True).iter_messages()
            ]

    return messages


@pytest.fixture
def frame_pixels() -> bytes:
    pixels = np.random.default_rng(0).integers(0, 255, 64 * 48 * 3, dtype=np.uint8).tobytes()
    return pixels + bytes(64 * 48 * 2)
