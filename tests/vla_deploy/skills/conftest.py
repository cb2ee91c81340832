"""A skill context with a robot that stands where a test says, on an empty floor with one table."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.client.place_state import PlaceState
from vla_deploy.ipc import Announcer, ClaimBook, SharedSpace
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.navigation.follower import AT_REST, Twist
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.maps.grid_map import GridMap
from vla_deploy.runtime.node import NodeContext
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.link import SkillLink
from vla_deploy.skills.node import ExecutorNode
from vla_deploy.world import Snapshot, read_snapshot

BODY_RADIUS_M = 0.27


class StoppedClock:
    """Stand still at 1000 s."""

    def now_ns(self) -> int:
        """Return the time."""
        return 1_000_000_000_000


class StepClock:
    """Go on when a test says so."""

    def __init__(self) -> None:
        self.ns = 1000 * NS_PER_S

    def now_ns(self) -> int:
        """Return the time."""
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Be there at once."""
        self.ns = deadline_ns


class Executor:
    """The executor's node in a run of its own; control and perception are the test's to play."""

    def __init__(self, run_dir: Path, robot: RobotDescription, plan_within_s: float) -> None:
        self.clock = StepClock()
        context = NodeContext(
            run_dir=run_dir, robot="butler", profile="desktop", devices_dir=None, clock=self.clock
        )
        self.space = SharedSpace(run_dir / "ipc", self.clock)
        self.node = ExecutorNode(context, robot, 20.0, plan_within_s)
        self.node.start()
        self.events = self.space.ring_reader("task_event", from_start=True)

    def give(self, *actions: dict[str, Any]) -> None:
        """Give it a plan."""
        plan = {"goal": "test", "actions": list(actions)}
        self.space.ring_writer("plan").publish({"command_id": "c1", "plan": plan})

    def close(self) -> None:
        """Stop the node and let go of its topics."""
        self.node.stop()
        self.space.close()


@dataclass
class StandingLink:
    """Say where the robot stands and what it has seen; the part of `SkillLink` that is state."""

    pose: Pose2D
    objects: list[dict[str, Any]] = field(default_factory=list)
    surfaces: list[dict[str, Any]] = field(default_factory=list)
    clock: StoppedClock = field(default_factory=StoppedClock)
    hands: dict[str, Any] = field(default_factory=dict)
    positions: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    efforts: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    setpoints: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    is_silent: bool = False
    acting: str = ""
    place_state: PlaceState = PlaceState.TRACKING

    def working_ns(self) -> int:
        """Return the time that pauses do not count in."""
        return self.clock.now_ns()

    def drive(self, twist: Twist) -> None:
        """Take an order to the base, which stays where it is."""
        assert twist == AT_REST

    def snapshot(self) -> Snapshot | None:
        """Return what it has seen as values, None while perception tells nothing."""
        told = {"stamp_ns": self.clock.now_ns(), "objects": self.objects}
        return None if self.is_silent else read_snapshot(told)


def at(x_m: float, y_m: float, yaw_rad: float = 0.0) -> Pose2D:
    """Return a pose of the floor."""
    return Pose2D(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)


@pytest.fixture
def standing() -> StandingLink:
    """The robot's state; a test changes it."""
    return StandingLink(pose=at(1.0, 2.0))


@cache
def butler_arms() -> dict[str, ArmKinematics]:
    """Return the kinematics of both arms."""
    butler = load_robot("butler")
    return {name: ArmKinematics(butler, name) for name in butler.hands}


@pytest.fixture
def context(standing: StandingLink, tmp_path: Path) -> SkillContext:
    """A 6 x 4 m room with a table of 1.0 x 0.4 m around (3.0, 1.0)."""
    blocked = np.zeros((80, 120), dtype=bool)
    blocked[[0, -1], :] = blocked[:, [0, -1]] = True
    blocked[16:24, 50:70] = True
    grid = GridMap(resolution_m=0.05, origin_m=(0.0, 0.0), blocked=blocked)
    space = SharedSpace(tmp_path, MonotonicClock())
    return SkillContext(
        robot=load_robot("butler"),
        link=cast("SkillLink", standing),
        planner=PathPlanner(grid, BODY_RADIUS_M),
        arms=butler_arms(),
        say=lambda _: None,
        voice=Announcer(space, "speak", MonotonicClock()),
        claims=ClaimBook(space, MonotonicClock()),
        hands={"left": None, "right": None},
    )


@pytest.fixture
def new_executor(tmp_path: Path) -> Iterator[Callable[..., Executor]]:
    """Make the executor's node, on a clock that a test steps, of a robot with these bounds."""
    made: list[Executor] = []

    def new_executor(plan_within_s: float = 20.0, **bounds: Any) -> Executor:
        butler = load_robot("butler")
        robot = replace(butler, planning=replace(butler.planning, **bounds))
        made.append(Executor(tmp_path, robot, plan_within_s))
        return made[-1]

    yield new_executor
    for one in made:
        one.close()


@pytest.fixture
def executor(new_executor: Callable[..., Executor]) -> Executor:
    """The executor's node of the butler."""
    return new_executor()
