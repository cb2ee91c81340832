"""The gateway in a run of its own, by default of a robot that servers beyond it drive and move.

Nothing of the robot runs besides: a test is the executor, and where it says so, control.
"""

import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.ipc import CellReader, ClaimBook, RingReader, RingWriter, SharedSpace
from vla_deploy.ipc.ros_goals import GoalAnswer, GoalKind, GoalRequest, GoalState, read_answer
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR

SERVER = Path(__file__).parent / "outgoing" / "goal_server.py"
BEYOND = """
[ros]
enabled = true
navigation = "nav2"
arms = "follow_joint_trajectory"
"""
HOLDER = "navigate_to (c1, a1)"
JOINTS = tuple(
    f"left_{name}"
    for name in (
        *("shoulder_yaw", "shoulder_pitch", "elbow"),
        *("forearm_roll", "wrist_pitch", "wrist_roll"),
    )
)


@dataclass
class Gateway:
    """The gateway's process, and what the executor has of it."""

    process: "subprocess.Popen[str]"
    robot: Path
    space: SharedSpace
    clock: MonotonicClock
    requests: RingWriter
    answers: RingReader
    claims: ClaimBook
    status: CellReader
    told: list[GoalAnswer] = field(default_factory=list)

    def claim(self, *parts: str, holder: str = HOLDER) -> None:
        """Hold parts of the robot as the executor does."""
        assert self.claims.ask(holder, dict.fromkeys(parts, 1))

    def send(self, request: GoalRequest) -> None:
        """Ask for a goal."""
        self.requests.publish(request.document())

    def ask(self, act: str, request_id: str = "g1", reason: str = "enough") -> None:
        """Cancel, permit or hold a goal."""
        self.requests.publish({"act": act, "request_id": request_id, "reason": reason})

    def wait_for(self, *states: GoalState, timeout_s: float = 40.0) -> GoalAnswer:
        """Return the first answer in one of these states."""
        found: list[GoalAnswer] = []

        def has_come() -> bool:
            self.told += [read_answer(event.payload) for event in self.answers.drain()]
            found.extend(one for one in self.told if one.state in states)
            return bool(found)

        assert self.wait_until(has_come, timeout_s), [one.document() for one in self.told]
        return found[0]

    def final(self, timeout_s: float = 40.0) -> GoalAnswer:
        """Return how a goal ended."""
        ends = [state for state in GoalState if state.is_final]
        return self.wait_for(*ends, timeout_s=timeout_s)

    def wait_until(self, holds: Callable[[], object], timeout_s: float = 40.0) -> bool:
        """Return whether something came true in time."""
        deadline_ns = self.clock.now_ns() + round(timeout_s * NS_PER_S)
        while not holds():
            if self.clock.now_ns() > deadline_ns:
                return False
            self.clock.sleep_until(self.clock.now_ns() + NS_PER_S // 50)
        return True


def robot_beyond(folder: Path, table: str = BEYOND) -> Path:
    """Make a butler that servers beyond it drive and move."""
    shutil.copytree(ROBOTS_DIR / "butler", folder)
    file = folder / ROBOT_FILE
    file.write_text(file.read_text(encoding="utf-8") + table, encoding="utf-8")
    return folder


@pytest.fixture
def robot_folder(tmp_path: Path) -> Path:
    return robot_beyond(tmp_path / "butler")


@pytest.fixture
def gateway(ros_graph: Any, robot_folder: Path, tmp_path: Path) -> Iterator[Gateway]:
    run_dir = tmp_path / "run"
    run_dir.mkdir()
    clock = MonotonicClock()
    space = SharedSpace(run_dir / "ipc", clock)
    claims = ClaimBook(space, clock)
    claims.declare(dict.fromkeys(("base", "left_arm", "right_arm"), 1))
    requests, answers = (
        space.ring_writer("ros_request"),
        space.ring_reader("ros_answer", from_start=True),
    )
    words = ["-m", "vla_deploy.gateways.ros", "--run-dir", str(run_dir), "--profile", "desktop"]
    process = subprocess.Popen(
        [ros_graph.python, *words, "--robot", str(robot_folder)],
        env=dict(ros_graph.variables),
        text=True,
    )
    made = Gateway(
        process=process,
        robot=robot_folder,
        space=space,
        clock=clock,
        requests=requests,
        answers=answers,
        claims=claims,
        status=space.cell_reader("ros_status"),
    )
    try:
        assert made.wait_until(made.status.latest), "the gateway tells no status"
        yield made
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        space.close()


@pytest.fixture
def serve(ros_graph: Any) -> Callable[..., "subprocess.Popen[str]"]:
    """Start a server of goals: kind, name, what it does with them."""

    def start(kind: str, name: str, mode: str) -> "subprocess.Popen[str]":
        server = ros_graph.start(SERVER.read_text(encoding="utf-8"), kind, name, mode)
        assert server.stdout.readline() == "up\n", server.stderr.read()
        return server

    return start


@pytest.fixture
def drive() -> Callable[..., GoalRequest]:
    """Make a request to drive somewhere."""

    def make(request_id: str = "g1", **changed: Any) -> GoalRequest:
        chosen: dict[str, Any] = {
            "request_id": request_id,
            "kind": GoalKind.NAVIGATE,
            "server": "navigate_to_pose",
            "holder": HOLDER,
            "parts": ("base",),
            "timeout_s": 300.0,
            "pose": (1.0, 2.0, 0.5),
        }
        return GoalRequest(**(chosen | changed))

    return make


@pytest.fixture
def reach() -> Callable[..., GoalRequest]:
    """Make a request to move the left arm."""

    def make(request_id: str = "g1", **changed: Any) -> GoalRequest:
        chosen: dict[str, Any] = {
            "request_id": request_id,
            "kind": GoalKind.FOLLOW,
            "server": "left_arm_controller/follow_joint_trajectory",
            "holder": HOLDER,
            "parts": ("left_arm",),
            "timeout_s": 120.0,
            "joints": JOINTS,
            "times_s": (0.5, 1.0),
            "positions": ((0.1,) * 6, (0.2,) * 6),
        }
        return GoalRequest(**(chosen | changed))

    return make


@pytest.fixture(scope="session")
def make_robot() -> Callable[[Path, str], Path]:
    """Make a butler with further keys of its file."""
    return robot_beyond


@pytest.fixture(scope="session")
def make_robot_folder() -> Callable[[Path, str], Path]:
    """Make a butler that servers beyond it drive and move, with further keys of `[ros]`."""
    return lambda folder, keys: robot_beyond(folder, BEYOND + keys)
