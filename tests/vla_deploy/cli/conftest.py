import json
import os
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.cli.main import main
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.runs.runtime import own_start_ticks


class Said(NamedTuple):
    """Hold how one command ended, and what it printed."""

    code: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        return json.loads(self.out)


@pytest.fixture
def base(tmp_path: Path) -> Path:
    """Return a runtime directory; none runs in it."""
    return tmp_path / "base"


@pytest.fixture
def run_dir(base: Path) -> Path:
    """Return the directory of a run in `base`, whose supervisor this process is."""
    run_dir = base / "run"
    run_dir.mkdir(parents=True)
    owner = {"pid": os.getpid(), "start_ticks": own_start_ticks(), "run_id": "run"}
    (base / "lock").write_text(json.dumps({**owner, "run_dir": str(run_dir)}))
    return run_dir


@pytest.fixture
def vla(base: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., Said]:
    """Run one command line in `base`."""

    def vla(*words: object) -> Said:
        code = main(["--runtime-base", str(base), *map(str, words)])
        return Said(code, *capsys.readouterr())

    return vla


class TwinSocket:
    """Serve the twin's socket of a run: `answer` gets each request."""

    def __init__(self, run_dir: Path, answer: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
        self._answer = answer
        (run_dir / "dev").mkdir()
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(run_dir / "dev" / "referee"))
        self._listener.listen()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with client, client.makefile("rwb") as stream:
                answer = self._answer(json.loads(stream.readline()))
                stream.write(json.dumps(answer).encode() + b"\n")

    def close(self) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join()


@pytest.fixture
def serve_twin() -> Iterator[Callable[..., TwinSocket]]:
    """Return what serves the twin's socket of a run until the test ends."""
    served: list[TwinSocket] = []

    def serve(run_dir: Path, answer: Callable[[dict[str, Any]], dict[str, Any]]) -> TwinSocket:
        served.append(TwinSocket(run_dir, answer))
        return served[-1]

    yield serve
    for one in served:
        one.close()


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
        document = {"state": state, "commands": [command_id] if command_id else []}
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
def session(tmp_path: Path, clock: ScriptedClock) -> Iterator[RobotSession]:
    session = RobotSession(tmp_path, clock)
    yield session
    session.close()
