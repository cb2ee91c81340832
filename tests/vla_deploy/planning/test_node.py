"""Talk to the planner through its topics, on a time that only the test moves."""

from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.planning.node import UTTERANCE_AGE_S, PlannerNode
from vla_deploy.robots import load_robot


class StepClock:
    time_ns = NS_PER_S

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = deadline_ns


class Desk:
    """Hold the other ends of the planner's topics."""

    def __init__(self, run_dir: Path) -> None:
        self.clock = StepClock()
        self._space = SharedSpace(run_dir / "ipc", self.clock)
        context = NodeContext(
            run_dir=run_dir, robot="butler", profile="desktop", devices_dir=None, clock=self.clock
        )
        self.planner = PlannerNode(context, load_robot("butler"))
        self.planner.start()
        self._utterances = self._space.ring_writer("utterance")
        self._events = self._space.ring_reader("task_event", from_start=True)
        self._plans = self._space.ring_reader("plan", from_start=True)
        self._control = self._space.cell_writer("control_status")

    def control(self, state: str) -> None:
        self._control.put_document({"state": state, "cause": "", "detail": ""})

    def give(self, **utterance: object) -> None:
        self._utterances.publish({"command_id": "c1", "source": "test"} | utterance)

    def answers(self) -> list[dict]:
        self.planner.step()
        return [event.payload for event in self._events.drain()]

    def plans(self) -> list[dict]:
        return [event.payload for event in self._plans.drain()]

    def close(self) -> None:
        self.planner.stop()
        self._space.close()


@pytest.fixture
def desk(tmp_path):
    desk = Desk(tmp_path)
    yield desk
    desk.close()


def test_a_command_becomes_a_plan_for_the_executor(desk):
    desk.control("armed")
    desk.give(text="go to the kitchen")
    accepted, planned = desk.answers()
    assert (accepted["event"], planned["event"]) == ("accepted", "plan")
    (plan,) = desk.plans()
    assert plan == {"command_id": "c1", "plan": planned["plan"]}
    assert [action["skill"] for action in plan["plan"]["actions"]] == ["navigate_to"]


def test_a_command_to_a_disarmed_robot_is_refused_with_what_to_do(desk):
    desk.control("disarmed")
    desk.give(text="go to the kitchen")
    (answer,) = desk.answers()
    assert answer["event"] == "rejected"
    assert "vla-deploy arm" in answer["reason"]
    assert desk.plans() == []


def test_a_command_that_waited_too_long_for_the_planner_is_refused(desk):
    desk.give(text="go to the kitchen")
    desk.clock.time_ns += round(UTTERANCE_AGE_S * NS_PER_S) + 1
    desk.control("armed")
    (answer,) = desk.answers()
    assert answer["event"] == "rejected"
    assert answer["reason"] == "the command is 5 s old, the planner was away; give it again"
    assert desk.plans() == []


@pytest.mark.parametrize("utterance", [{"cancel": True}, {"text": "stop"}])
def test_a_stop_is_handed_on_however_old_it_is(desk, utterance):
    desk.give(**utterance)
    desk.clock.time_ns += 60 * NS_PER_S
    assert desk.answers() == []
    assert desk.plans() == [{"command_id": "c1", "cancel": True}]
