from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.cli.session import Session
from vla_deploy.ipc import SharedSpace


class ScriptedClock:
    """Pass time only when someone waits, and let the script act after each wait."""

    def __init__(self) -> None:
        self.time_ns = NS_PER_S
        self.after_wait = lambda: None

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)
        self.after_wait()

    @property
    def now_s(self) -> float:
        return self.time_ns / NS_PER_S


class Robot:
    """Play the processes at the other end of the session's topics."""

    def __init__(self, run_dir: Path, clock: ScriptedClock) -> None:
        self.clock = clock
        self.space = SharedSpace(run_dir / "ipc", clock)
        self._events = self.space.ring_writer("task_event")
        self._utterances = self.space.ring_reader("utterance", from_start=True)
        self._executor = self.space.cell_writer("executor_status")
        self._planner = self.space.cell_writer("planner_status")

    def heard(self) -> list[dict]:
        return [event.payload for event in self._utterances.drain()]

    def tell(self, command_id: str, event: str, **details: object) -> None:
        self._events.publish({"command_id": command_id, "event": event} | details)

    def plans(self, *command_ids: str) -> None:
        self._planner.put_document({"commands": list(command_ids)})

    def executes(self, command_id: str | None) -> None:
        state = "executing" if command_id else "idle"
        document = {"state": state, "command_id": command_id, "skill": None, "holding": {}}
        self._executor.put_document(document)


@pytest.fixture
def clock() -> ScriptedClock:
    return ScriptedClock()


@pytest.fixture
def robot(tmp_path: Path, clock: ScriptedClock) -> Iterator[Robot]:
    robot = Robot(tmp_path, clock)
    yield robot
    robot.space.close()


@pytest.fixture
def session(tmp_path: Path, clock: ScriptedClock) -> Iterator[Session]:
    session = Session(tmp_path, clock)
    yield session
    session.close()
