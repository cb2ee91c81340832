from collections.abc import Iterator
from pathlib import Path
from typing import cast

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.readiness import refusal_of
from vla_deploy.ipc import Announcer, CellWriter, ClaimBook, Event, SharedSpace
from vla_deploy.navigation.follower import Twist
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import load_robot
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.errors import RobotNotReady, TryAgain
from vla_deploy.skills.link import PATIENCE_S, POSE_AGE_S, SkillLink
from vla_deploy.skills.movements.drive import BLOCKED_TIMEOUT_S, turn
from vla_deploy.skills.movements.motion import move_joints


class SteppedClock:
    """Stand still until a test moves it."""

    def __init__(self) -> None:
        self.at_ns = 5 * NS_PER_S

    def now_ns(self) -> int:
        """Return the time."""
        return self.at_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Step to a moment."""
        self.at_ns = max(self.at_ns, deadline_ns)

    def step(self, seconds: float) -> None:
        """Step by a while."""
        self.at_ns += round(seconds * NS_PER_S)


def put_pose(
    poses: CellWriter, x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0, state: int = 0
) -> None:
    poses.put(
        x_m=x_m,
        y_m=y_m,
        yaw_rad=yaw_rad,
        match_ratio=1.0,
        covariance=(0.0,) * 9,
        state=state,
        doubt=0,
    )


@pytest.fixture
def clock() -> SteppedClock:
    return SteppedClock()


@pytest.fixture
def space(tmp_path: Path, clock: SteppedClock) -> Iterator[SharedSpace]:
    opened = SharedSpace(tmp_path / "ipc", clock)
    yield opened
    opened.close()


def test_a_pose_that_grows_old_is_waited_for_and_then_given_up(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = SkillLink(space, clock, load_robot("butler"))
    before_it_ever_spoke = link.is_blind
    poses = space.cell_writer("pose")
    put_pose(poses, x_m=1.0, y_m=2.0, yaw_rad=0.5)
    assert (link.pose.x_m, link.is_blind) == (1.0, False)
    clock.step(POSE_AGE_S + 0.1)
    silent = link.is_blind
    with pytest.raises(TryAgain, match="pose"):
        _ = link.pose
    clock.step(PATIENCE_S)
    assert (before_it_ever_spoke, silent, link.is_blind) == (False, True, False)


def test_a_halt_rests_the_base_only_if_it_was_driven(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = SkillLink(space, clock, load_robot("butler"))
    commands = space.cell_reader("base_command")
    link.halt()
    assert commands.latest() is None
    link.drive(Twist(0.3, 0.1))
    link.halt()
    sample = commands.latest()
    assert sample is not None
    assert (sample.data["v_m_s"], sample.data["w_rad_s"]) == (0.0, 0.0)


def control_says(space: SharedSpace, **status: object) -> None:
    calm = {"state": "armed", "cause": "", "detail": "", "speed_ratio": 1.0, "blocked": []}
    space.cell_writer("control_status").put_document(calm | status)


@pytest.mark.parametrize(
    ("twist", "status", "held"),
    [
        (Twist(0.3, 0.0), {}, False),
        (Twist(0.3, 0.0), {"speed_ratio": 0.2}, False),
        (Twist(0.3, 0.0), {"speed_ratio": 0.0}, True),
        (Twist(0.3, 0.5), {"blocked": ["forward"]}, True),
        (Twist(-0.3, 0.0), {"blocked": ["forward"]}, False),
        (Twist(-0.3, 0.0), {"blocked": ["backward"]}, True),
        (Twist(0.0, 0.5), {"blocked": ["turn_left"]}, True),
        (Twist(0.0, -0.5), {"blocked": ["turn_left"]}, False),
        (Twist(0.0, -0.5), {"blocked": ["turn_right"]}, True),
        (Twist(0.0, 0.0), {"speed_ratio": 0.0}, False),
    ],
)
def test_a_motion_that_control_holds_back_is_known_with_its_cause(
    space: SharedSpace, clock: SteppedClock, twist: Twist, status: dict[str, object], held: bool
) -> None:
    link = SkillLink(space, clock, load_robot("butler"))
    assert link.held_by_control(twist) == ""
    control_says(space, cause="obstacle_stop_zone", detail="a chair", **status)
    assert link.held_by_control(twist) == ("control holds the base: a chair" if held else "")


def test_a_protective_stop_is_a_pause_and_no_refusal(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = SkillLink(space, clock, load_robot("butler"))
    silent = link.in_protective_stop
    control_says(space, state="protective_stop")
    paused, refusal = link.in_protective_stop, refusal_of(link.control_status)
    control_says(space, state="armed")
    assert (silent, paused, refusal, link.in_protective_stop) == (False, True, None, False)


def context_of(link: SkillLink) -> SkillContext:
    robot = load_robot("butler")
    book = cast("ClaimBook", None)  # the pieces under test claim and say nothing
    return SkillContext(
        robot=robot,
        link=link,
        planner=cast("PathPlanner", None),
        arms={},
        say=lambda text: None,
        voice=cast("Announcer", None),
        claims=book,
    )


def test_a_motion_that_a_pause_ended_is_tried_again_and_one_that_a_stop_ended_is_not(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = SkillLink(space, clock, load_robot("butler"))
    results = space.ring_writer("motion_result")
    for state, expected in (("protective_stop", TryAgain), ("stopped", RobotNotReady)):
        control_says(space, state=state)
        skill = move_joints(context_of(link), {"head_pan": 0.1})
        next(skill)
        (sent,) = [one.payload["motion_id"] for one in _commands(space)][-1:]
        results.publish({"motion_id": sent, "status": "stopped", "reason": "why"})
        link.refresh()
        with pytest.raises(expected, match="why"):
            next(skill)


def _commands(space: SharedSpace) -> list[Event]:
    return space.ring_reader("motion_command", from_start=True).drain()


def test_a_turn_that_control_holds_back_is_asked_for_until_it_is_given_up(
    space: SharedSpace, clock: SteppedClock
) -> None:
    link = SkillLink(space, clock, load_robot("butler"))
    poses, commands = space.cell_writer("pose"), space.cell_reader("base_command")
    skill = turn(context_of(link), {"angle_rad": 1.0})

    def step() -> float:
        put_pose(poses)
        control_says(space, cause="keep_out_zone", blocked=["turn_left"])
        next(skill)
        clock.step(0.1)
        sample = commands.latest()
        assert sample is not None
        return float(sample.data["w_rad_s"])

    asked = [step() for _ in range(round(BLOCKED_TIMEOUT_S / 0.1))]
    assert min(asked) > 0.0
    with pytest.raises(TryAgain, match="keep_out_zone"):
        for _ in range(3):
            step()
    sample = commands.latest()
    assert sample is not None
    assert sample.data["w_rad_s"] == 0.0
