"""Plans whose actions go on side by side, on skills that a test steps by hand."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import Announcer, ClaimBook, SharedSpace
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots import load_robot
from vla_deploy.skills import executor
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, RobotNotReady, TryAgain
from vla_deploy.skills.executor import PlanExecution
from vla_deploy.skills.link import SkillLink
from vla_deploy.skills.resources import WAIT_LIMIT_S, body_of, needs_of

JOINT = "left_shoulder_yaw"


class Clock:
    ns = NS_PER_S

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = deadline_ns


@dataclass
class Stage:
    """Run plans of actions `skill` or `skill:arm`; each action ends when the test says so."""

    space: SharedSpace
    clock: Clock
    context: SkillContext
    ends: dict[str, Exception | None] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)

    def plan(
        self,
        options: Mapping[str, Any] | None = None,
        command_id: str = "c1",
        **needs: tuple[str, ...],
    ) -> PlanExecution:
        """Return the execution of a plan whose action `a_look_at` does `look_at`."""
        actions = []
        for name, depends_on in needs.items():
            skill, _, arm = name.partition("_")[2].partition("__")
            parameters: dict[str, Any] = {"id": name, **({"arm": arm} if arm else {})}
            action = Action(id=name, skill=skill, parameters=parameters, depends_on=depends_on)
            actions.append(action)
        plan = Plan(goal="test", actions=tuple(actions), options=dict(options or {}))
        return PlanExecution(
            plan,
            self.context,
            lambda one: self.told.append(f"{one.action.id} {one.status}"),
            command_id,
        )

    def step(self, execution: PlanExecution, count: int = 1) -> None:
        for _ in range(count):
            self.clock.ns += NS_PER_S // 50
            status = {"state": "armed", "estop_latched": False, "cause": "", "detail": ""}
            self.space.cell_writer("control_status").put_document(status)
            self.context.link.refresh()
            execution.step()

    def skill(self, context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
        name = parameters["id"]
        context.link.send_goal({JOINT: 0.1})
        while name not in self.ends:
            yield
        end = self.ends.pop(name)
        if end is not None:
            raise end

    def cancelled(self) -> int:
        commands = self.space.ring_reader("motion_command", from_start=True).drain()
        return sum(event.payload["kind"] == "cancel" for event in commands)


@pytest.fixture
def stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Stage]:
    clock, robot = Clock(), load_robot("butler")
    space = SharedSpace(tmp_path / "ipc", clock)
    context = SkillContext(
        robot=robot,
        link=SkillLink(space, clock, robot),
        planner=None,  # type: ignore[arg-type]
        arms={},
        say=lambda _: None,
        voice=Announcer(space, "speak", clock),
        claims=ClaimBook(space, clock),
    )
    context.claims.declare(body_of(robot))
    stage = Stage(space=space, clock=clock, context=context)
    functions = dict.fromkeys(executor.SKILL_FUNCTIONS, stage.skill)
    monkeypatch.setattr(executor, "SKILL_FUNCTIONS", MappingProxyType(functions))
    yield stage
    space.close()


def active(execution: PlanExecution) -> list[str]:
    return [one.action.id for one in execution.records if one.status == "active"]


def test_branches_that_need_other_parts_of_the_robot_go_on_side_by_side(stage: Stage):
    execution = stage.plan(a_turn=(), b_look_at=(), c_speak=(), d_open_gripper__left=())
    stage.step(execution)
    assert active(execution) == ["a_turn", "b_look_at", "c_speak", "d_open_gripper__left"]
    stage.ends = dict.fromkeys(active(execution))
    stage.step(execution)
    assert execution.succeeded


def test_two_hands_move_side_by_side_and_one_hand_does_one_thing_at_a_time(stage: Stage):
    execution = stage.plan(
        a_open_gripper__left=(), b_open_gripper__right=(), c_close_gripper__left=()
    )
    stage.step(execution, 3)
    assert active(execution) == ["a_open_gripper__left", "b_open_gripper__right"]
    stage.ends["a_open_gripper__left"] = None
    stage.step(execution, 2)
    assert active(execution) == ["b_open_gripper__right", "c_close_gripper__left"]


def test_a_chain_goes_on_one_by_one_though_its_parts_are_free(stage: Stage):
    execution = stage.plan(a_turn=(), b_look_at=("a_turn",))
    stage.step(execution, 3)
    assert active(execution) == ["a_turn"]
    stage.ends["a_turn"] = None
    stage.step(execution, 2)
    assert active(execution) == ["b_look_at"]


def test_a_branch_that_fails_ends_the_plan_and_gives_everything_back(stage: Stage):
    execution = stage.plan(a_turn=(), b_look_at=(), c_speak=("a_turn",))
    stage.step(execution)
    stage.ends["b_look_at"] = NotPossible("nothing to see")
    stage.step(execution)
    statuses = [str(one.status) for one in execution.records]
    assert sorted(statuses) == ["aborted", "cancelled", "cancelled"]
    assert stage.cancelled() == 2
    assert stage.context.claims.look().granted == ()


def test_a_branch_that_is_tried_again_disturbs_no_other(stage: Stage):
    execution = stage.plan(a_pick_up=(), b_speak=())
    stage.step(execution)
    stage.ends["a_pick_up"] = TryAgain("lost it")
    stage.step(execution)
    assert stage.cancelled() == 1
    assert active(execution) == ["a_pick_up", "b_speak"]
    stage.step(execution, 60)
    stage.ends |= {"a_pick_up": None, "b_speak": None}
    stage.step(execution)
    assert execution.succeeded


def test_cancelling_gives_everything_back(stage: Stage):
    execution = stage.plan(a_turn=(), b_look_at=(), c_turn=())
    stage.step(execution)
    execution.cancel("on request")
    book = stage.context.claims.look()
    assert (book.granted, book.waiting) == ((), ())
    assert execution.finished


def test_an_action_that_waits_for_another_process_says_who_holds_what(stage: Stage):
    stage.context.claims.ask("the calibration", {"head": 1})
    execution = stage.plan(a_look_at=())
    stage.step(execution, 3)
    assert active(execution) == []
    stage.clock.ns += round(WAIT_LIMIT_S * NS_PER_S)
    stage.step(execution)
    assert execution.records[0].error == "waited 300 s: head is held by the calibration"
    assert execution.finished


def test_an_action_that_waits_starts_when_the_holder_lets_go(stage: Stage):
    stage.context.claims.ask("the calibration", {"head": 1})
    execution = stage.plan(a_look_at=())
    stage.step(execution, 3)
    stage.context.claims.release("the calibration")
    stage.step(execution)
    assert active(execution) == ["a_look_at"]


def test_an_action_is_refused_a_part_that_is_not_there(
    stage: Stage, tmp_path_factory: pytest.TempPathFactory
):
    elsewhere = SharedSpace(tmp_path_factory.mktemp("other"), stage.clock)
    stage.context.claims = ClaimBook(elsewhere, stage.clock)
    execution = stage.plan(a_look_at=())
    stage.step(execution)
    assert "nobody declares" in execution.records[0].error


@pytest.mark.parametrize(
    ("skill", "parameters", "needed"),
    [
        ("turn", {}, {"base"}),
        ("open_gripper", {"arm": "left"}, {"left_arm", "left_gripper"}),
        ("speak", {"text": "hello"}, {"speaker"}),
        ("wait", {}, set()),
    ],
)
def test_every_skill_needs_what_it_moves(skill: str, parameters: dict, needed: set[str]):
    action = Action(id="a", skill=skill, parameters=parameters)
    assert needs_of(action, load_robot("butler")).keys() == needed


def test_an_arm_pose_needs_every_group_that_it_moves():
    robot = load_robot("butler")
    for pose, targets in robot.poses.items():
        action = Action(id="a", skill="move_arm", parameters={"pose": pose})
        moved = {name for name, one in robot.groups.items() if set(one.joints) & set(targets)}
        assert moved <= needs_of(action, robot).keys()


def test_every_resource_of_the_catalogue_is_a_part_of_the_robot():
    robot = load_robot("butler")
    for skill in executor.SKILLS:
        needed = needs_of(Action(id="a", skill=skill), robot)
        assert needed.keys() <= body_of(robot).keys()


# --- options of a plan ----------------------------------------------------------------------------


def statuses(execution: PlanExecution) -> dict[str, str]:
    return {one.action.id[0]: one.status.value for one in execution.records}


def test_a_plan_that_goes_on_cancels_only_what_depends_on_what_failed(stage: Stage):
    execution = stage.plan(
        {"continue_on_error": True},
        a_turn=(),
        b_look_at=("a_turn",),
        c_speak=("b_look_at",),
        d_open_gripper__left=(),
    )
    stage.step(execution)
    stage.ends |= {"a_turn": NotPossible("stuck"), "d_open_gripper__left": None}
    stage.step(execution)
    assert statuses(execution) == {
        "a": "aborted",
        "b": "cancelled",
        "c": "cancelled",
        "d": "succeeded",
    }
    assert execution.succeeded
    assert execution.setback is None


def test_a_plan_that_goes_on_ends_all_the_same_where_the_robot_may_not_move(stage: Stage):
    execution = stage.plan({"continue_on_error": True}, a_turn=(), b_look_at=())
    stage.step(execution)
    stage.ends["a_turn"] = RobotNotReady("stopped")
    stage.step(execution)
    assert statuses(execution) == {"a": "aborted", "b": "cancelled"}
    assert not execution.succeeded


def test_what_comes_after_needs_no_success_where_the_plan_goes_on(stage: Stage):
    execution = stage.plan({"continue_on_error": True}, a_turn=(), b_look_at=())
    second = execution.records[1]
    second.action = second.action.model_copy(update={"after": ("a_turn",)})
    stage.step(execution, 3)
    assert active(execution) == ["a_turn"]
    stage.ends["a_turn"] = NotPossible("stuck")
    stage.step(execution, 2)
    assert active(execution) == ["b_look_at"]


@pytest.mark.parametrize("retries", [0, 1, 3])
def test_what_may_be_tried_again_is_so_often_each_time_after_a_longer_rest(stage: Stage, retries):
    execution = stage.plan({"max_retries": retries}, a_find_object=())
    began, rests_s = [], []
    for _ in range(retries + 1):
        while not (stage.clock.ns and stage.context.link._active):
            stage.step(execution)
        began.append(stage.clock.ns)
        stage.ends["a_find_object"] = TryAgain("not seen")
        stage.step(execution)
    rests_s = [round((later - earlier) / NS_PER_S) for earlier, later in pairwise(began)]
    assert rests_s == [1, 2, 4][:retries]
    assert statuses(execution) == {"a": "aborted"}
    assert execution.records[0].retries == retries


def test_a_plan_may_give_a_kind_of_skill_less_time(stage: Stage):
    execution = stage.plan(
        {"timeouts_s": {"movement": 2.0}, "max_retries": 0}, a_turn=(), b_speak=()
    )
    stage.step(execution, 50 * 3)
    assert "took longer than 2 s" in execution.records[0].error


def test_what_control_refuses_before_it_has_begun_is_rejected(stage: Stage):
    execution = stage.plan(a_turn=())
    status = {"state": "stopped", "estop_latched": True, "cause": "estop", "detail": ""}
    stage.space.cell_writer("control_status").put_document(status)
    execution.step()
    assert statuses(execution) == {"a": "rejected"}


# --- pauses, and several plans at once ------------------------------------------------------------


def test_in_a_pause_nothing_goes_on_and_its_time_does_not_count(stage: Stage):
    execution = stage.plan({"timeouts_s": {"movement": 2.0}}, a_turn=(), b_look_at=("a_turn",))
    stage.step(execution, 50)
    stage.context.link.pause()
    stage.ends["a_turn"] = None
    stage.clock.ns += 400 * NS_PER_S
    stage.step(execution)
    assert active(execution) == ["a_turn"]
    assert stage.cancelled() == 1
    stage.context.link.resume()
    stage.step(execution, 2)
    assert active(execution) == ["b_look_at"]
    assert execution.records[0].execution_time_s == pytest.approx(1.0, abs=0.1)


def test_a_stop_ends_what_is_paused(stage: Stage):
    execution = stage.plan(a_turn=(), b_look_at=("a_turn",))
    stage.step(execution)
    stage.context.link.pause()
    status = {"state": "stopped", "estop_latched": True, "cause": "estop", "detail": ""}
    stage.space.cell_writer("control_status").put_document(status)
    execution.step()
    assert statuses(execution) == {"a": "cancelled", "b": "cancelled"}
    assert "reset and arm" in execution.records[0].error


def test_a_stop_ends_what_only_waits_to_be_tried_again_or_for_a_part_of_the_robot(stage: Stage):
    stage.context.claims.ask("somebody", {"left_arm": 1})
    waiting = stage.plan(command_id="c2", a_open_gripper__left=())
    backing_off = stage.plan(a_find_object=())
    stage.step(backing_off)
    stage.step(waiting)
    stage.ends["a_find_object"] = TryAgain("not seen")
    stage.step(backing_off)
    status = {"state": "stopped", "estop_latched": True, "cause": "estop", "detail": ""}
    stage.space.cell_writer("control_status").put_document(status)
    for execution in (backing_off, waiting):
        execution.step()
        assert execution.finished
        assert "reset and arm" in execution.records[0].error


def test_a_paused_robot_still_answers(stage: Stage):
    execution = stage.plan(a_speak=())
    stage.context.link.pause()
    stage.ends["a_speak"] = None
    stage.step(execution, 2)
    assert execution.succeeded


def test_what_waits_for_a_part_of_the_robot_waits_on_after_a_long_pause(stage: Stage):
    execution = stage.plan(a_turn=(), b_move=())
    stage.step(execution)
    stage.context.link.pause()
    stage.clock.ns += round(WAIT_LIMIT_S + 10) * NS_PER_S
    stage.step(execution)
    stage.context.link.resume()
    stage.step(execution)
    assert statuses(execution) == {"a": "active", "b": "pending"}
    stage.ends["a_turn"] = None
    stage.step(execution, 2)
    assert active(execution) == ["b_move"]


def test_of_two_plans_one_is_cancelled_and_the_other_goes_on(stage: Stage):
    one, other = stage.plan(a_turn=()), stage.plan(command_id="c2", a_open_gripper__left=())
    stage.step(one)
    stage.step(other)
    assert (active(one), active(other)) == (["a_turn"], ["a_open_gripper__left"])
    one.cancel("enough")
    assert (stage.cancelled(), statuses(one)) == (1, {"a": "cancelled"})
    stage.ends["a_open_gripper__left"] = None
    stage.step(other)
    assert other.succeeded
