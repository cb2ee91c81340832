"""The supervisor says what the robot does, also when those who do it have ended."""

from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.supervisor.activity_writer import AGAIN_NS, EXECUTOR_S, ActivityWriter


class StepClock:
    def __init__(self) -> None:
        self.ns = NS_PER_S

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = max(self.ns, deadline_ns)


class Robot:
    """Be the processes that the supervisor judges by."""

    def __init__(self, folder: Path) -> None:
        self.clock = StepClock()
        self.space = SharedSpace(folder / "ipc", self.clock)
        self.documents: dict[str, dict[str, Any]] = {
            "control_status": {"state": "armed", "cause": ""},
            "executor_status": {"state": "idle", "skill": None},
            "planner_status": {"commands": [], "question": None},
        }
        self._cells = {name: self.space.cell_writer(name) for name in self.documents}
        self._events: Any = self.space.ring_writer(topics.TASK_EVENT)
        self._activity = self.space.cell_reader(topics.ACTIVITY)
        self.writer = ActivityWriter(self.space, self.clock)
        self.refusal = ""

    def tell(self, event: str, command_id: str = "c1", **details: Any) -> None:
        self._events.publish({"command_id": command_id, "event": event, **details})

    def after(self, seconds: float, silent: tuple[str, ...] = ()) -> dict[str, Any]:
        """Let time pass, in which the others publish, and return what is published then."""
        for _ in range(round(seconds / 0.05)):
            self.clock.ns += NS_PER_S // 20
            for name, document in self.documents.items():
                if name not in silent:
                    self._cells[name].put_document(document)
            self.writer.step(self.refusal)
        sample = self._activity.latest()
        assert sample is not None
        assert self.clock.ns - sample.stamp_ns <= AGAIN_NS + NS_PER_S // 10
        document: dict[str, Any] = sample.document()
        return document


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path)


def test_a_command_is_followed_to_its_end(robot: Robot) -> None:
    assert robot.after(1.0)["activity"] == "idle"
    robot.documents["planner_status"] = {"commands": ["c1"], "question": None}
    begun = robot.after(1.0)
    assert begun["activity"] == "processing"
    assert robot.after(1.0)["since_ns"] == begun["since_ns"]
    robot.documents["planner_status"] = {"commands": [], "question": None}
    robot.documents["executor_status"] = {"state": "executing", "skill": "navigate_to"}
    robot.tell("plan", plan={})
    assert robot.after(1.0)["activity"] == "navigating"
    robot.documents["executor_status"] = {"state": "idle", "skill": None}
    robot.tell("finished", success=True, error=None, actions=[])
    assert robot.after(1.0)["activity"] == "completed"
    assert robot.after(3.0)["activity"] == "idle"


def test_a_halt_and_a_failure_complete_nothing(robot: Robot) -> None:
    robot.tell("finished", "halt", success=True, error=None, actions=[])
    assert robot.after(1.0)["activity"] == "idle"
    robot.tell("plan", plan={})
    robot.tell("finished", success=False, error="it slipped", actions=[])
    assert robot.after(1.0)["activity"] == "idle"


@pytest.mark.parametrize(
    ("silent", "why"),
    [
        ("executor_status", "the executor is silent"),
        ("planner_status", "the planner is silent"),
        ("control_status", "control is silent"),
    ],
)
def test_without_one_of_those_that_work_it_is_stopped_and_says_so(
    robot: Robot, silent: str, why: str
) -> None:
    assert robot.after(1.0)["activity"] == "idle"
    told = robot.after(EXECUTOR_S + 2.0, silent=(silent,))
    assert (told["activity"], told["stopped_by"]) == ("stopped", why)
    assert robot.after(1.0)["activity"] == "idle"


def test_it_goes_on_saying_stopped_while_all_others_have_ended(robot: Robot) -> None:
    robot.documents["control_status"] = {"state": "stopped", "cause": "estop"}
    assert robot.after(1.0)["stopped_by"] == "stopped: estop"
    told = robot.after(30.0, silent=tuple(robot.documents))
    assert (told["activity"], told["stopped_by"]) == ("stopped", "control is silent")


def test_a_long_refusal_fits_the_cell(robot: Robot) -> None:
    robot.refusal = "the executor was given up: " + "x" * 5000
    assert robot.after(1.0)["activity"] == "stopped"
