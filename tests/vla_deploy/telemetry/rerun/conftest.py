"""Provide a run that the tests write, a recording of it, and a list that takes entities."""

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.recording.once import OneRecording
from vla_deploy.telemetry.recording.request import RecordingRequest
from vla_deploy.telemetry.rerun.entity import Entity

SCENE = {
    "objects": [
        {
            "id": "cup_1",
            "class": "cup",
            "colour": "red",
            "position_m": [1.0, 2.0, 0.8],
            "size_m": [0.08, 0.08, 0.1],
            "yaw_rad": 0.3,
        }
    ],
    "surfaces": [{"height_m": 0.75, "polygon_m": [[0, 0], [1, 0], [1, 1]]}],
    "bystanders": [
        {"class": "person", "position_m": [2, 0], "width_m": 0.5, "top_m": 1.7, "confidence": 0.9}
    ],
}


class Run:
    """Hold a run directory whose topics, logs and images the test writes."""

    def __init__(self, context: NodeContext, clock: Any) -> None:
        self.clock = clock
        self.context = context
        self.run_dir = context.run_dir
        self.space = SharedSpace(self.run_dir / "ipc", clock)
        self._cells = {
            name: self.space.cell_writer(name)
            for name in ("joint_state", "pose", "scan", "near_obstacles", "scene", "control_status")
        }
        self._frames = self.space.frame_writer("rgbd")
        self._events = self.space.ring_writer("task_event")
        self._tick = 0

    def write(self) -> None:
        """Write every kind of value once."""
        put, now_ns = self._cells, self.clock.now_ns()
        self._tick += 1
        zeros, ones = np.zeros(16), np.ones(16)
        put["joint_state"].put(
            joint_count=16,
            position=zeros,
            velocity=zeros,
            setpoint=zeros,
            effort_ratio=0.1 * ones,
            age_s=zeros,
            error=zeros,
            torque_enabled=ones,
        )
        put["pose"].put(
            x_m=1.0, y_m=2.0, yaw_rad=0.5, match_ratio=1.0, covariance=(), state=0, doubt=0
        )
        put["scan"].put(range_m=np.full(360, 2.0), beam_age_s=())
        put["near_obstacles"].put(count=1, period_s=0.2, x_m=[0.5], y_m=[0.1], z_m=[0.2])
        put["scene"].put_document(SCENE)
        temperatures = {"temperature_c": [40.0] * 15 + [None], "voltage_v": [12.0] * 16}
        put["control_status"].put_document({"tick": self._tick, "joints": temperatures})
        pixels = bytes(64 * 48 * 5)
        self._frames.put(pixels, width=64, height=48, stamp_ns=now_ns)
        self._events.publish({"command_id": "c-1", "event": "said", "text": "hello"})
        line = {"stamp_ns": now_ns, "level": "WARNING", "process": "planner", "message": "slow"}
        with (self.run_dir / "logs" / "planner.log").open("a", encoding="utf-8") as log:
            log.write(json.dumps(line) + "\n")

    def record(self, path: Path, **wish: object) -> None:
        """Record two seconds of it."""
        OneRecording(
            self.context,
            RecordingRequest(duration_s=2.0, **wish),  # type: ignore[arg-type]
            path,
            image_period_s=0.5,
            wall_ns=self.clock.wall_ns,
        ).run(lambda: False)


class Taken:
    """Take entities with the moment of each."""

    def __init__(self) -> None:
        self.entities: list[tuple[int, int | None, Entity]] = []
        self.flushed = 0
        self._moment: tuple[int, int | None] = (0, None)

    def at(self, stamp_ns: int, tick: int | None) -> None:
        self._moment = stamp_ns, tick

    def log(self, entity: Entity) -> None:
        self.entities.append((*self._moment, entity))

    def flush(self) -> None:
        self.flushed = len(self.entities)

    @property
    def counts(self) -> Counter[str]:
        return Counter(entity.path for _, _, entity in self.entities)

    def of(self, path: str) -> list[Entity]:
        return [entity for _, _, entity in self.entities if entity.path == path]


@pytest.fixture
def run(context: NodeContext, clock: Any) -> Iterator[Run]:
    run = Run(context, clock)
    yield run
    run.space.close()


@pytest.fixture
def taken() -> Taken:
    return Taken()


@pytest.fixture
def recording(run: Run, tmp_path: Path) -> Path:
    run.clock.each = run.write
    run.record(tmp_path / "x.mcap")
    return tmp_path / "x.mcap"
