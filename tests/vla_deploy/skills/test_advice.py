"""A plan that the world is against ends with what to do before, or instead."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.feasibility.verdict import Feasible, Task
from vla_deploy.plans.plan import Action
from vla_deploy.skills.advice import in_words

if TYPE_CHECKING:
    from conftest import Executor

STEP_NS = NS_PER_S // 20
TABLE_M = 0.45
ARMED = {"state": "armed", "estop_latched": False, "cause": "", "detail": "", "blocked": []}


def thing(name: str, colour: str, size_m: tuple[float, float, float], **changes: Any) -> Any:
    """A thing on the coffee table, before which the robot stands."""
    x_m, y_m = changes.pop("at", (2.2, 1.6))
    bottom_m = changes.pop("bottom_m", TABLE_M)
    return {
        "id": name,
        "class": name.partition("_")[0],
        "colour": colour,
        "position_m": [x_m, y_m, bottom_m + size_m[2] / 2],
        "size_m": list(size_m),
        "yaw_rad": 0.0,
        "seen_count": 9,
        "confidence": 0.9,
        **changes,
    }


CUP = thing("cup_1", "red", (0.07, 0.07, 0.1), at=(2.4, 1.6))
WIDE_CUP = thing("cup_2", "blue", (0.14, 0.14, 0.1))
BOOK = thing("book_1", "blue", (0.2, 0.06, 0.03))
BALL = thing("ball_1", "green", (0.06, 0.06, 0.06), bottom_m=TABLE_M + 0.03,
             rests={"relation": "on", "of": "book_1"})  # fmt: skip


class Room:
    """An executor, and what control and perception tell it."""

    def __init__(self, executor: "Executor") -> None:
        self.clock, self.space, self.node = executor.clock, executor.space, executor.node
        self.events, self.give = executor.events, executor.give
        self.things: tuple[dict[str, Any], ...] = ()
        self.place = PlaceState.TRACKING

    def tell(self) -> None:
        now_ns = self.clock.now_ns()
        seen = [one | {"last_seen_ns": now_ns} for one in self.things]
        self.space.cell_writer("scene").put_document({"stamp_ns": now_ns, "objects": seen})
        self.space.cell_writer("control_status").put_document(ARMED)
        self.space.cell_writer("pose").put(
            x_m=2.2,
            y_m=2.05,
            yaw_rad=-1.5708,
            match_ratio=1.0,
            covariance=np.zeros(9),
            state=self.place,
            doubt=0,
        )

    def error_of(self, *actions: dict[str, Any]) -> str:
        """Return by what a plan ends that fails before anything moves."""
        self.give(*actions)
        for _ in range(40):
            self.clock.ns += STEP_NS
            self.tell()
            self.node.step()
            for event in self.events.drain():
                if event.payload["event"] == "finished":
                    return str(event.payload["error"])
        raise AssertionError("the plan did not end")


@pytest.fixture
def room(executor: "Executor") -> Room:
    return Room(executor)


def pick_up(name: str) -> dict[str, Any]:
    return {"id": "a1", "skill": "pick_up", "parameters": {"object": name}}


def test_what_is_too_wide_is_answered_by_another_that_is_not(room: Room) -> None:
    room.things = (WIDE_CUP, CUP)
    error = room.error_of(pick_up("cup_2"))
    assert error.endswith(". I could take the red cup (cup_1) instead")


def test_what_nobody_has_seen_must_be_found_first(room: Room) -> None:
    room.things = (CUP,)
    error = room.error_of(pick_up("bottle"))
    assert ". First find the bottle: it has not been seen" in error


def test_what_lies_on_it_is_to_be_taken_off_first(room: Room) -> None:
    room.things = (BOOK, BALL)
    room.tell()
    action = Action.model_validate(pick_up("book_1"))
    advice = room.node._adviser.advice_on(action)
    assert advice == "First take the green ball off the blue book"


def test_a_robot_that_is_lost_advises_nothing(room: Room) -> None:
    room.things, room.place = (WIDE_CUP, CUP), PlaceState.LOST
    error = room.error_of(pick_up("cup_2"))
    assert "instead" not in error


def test_a_robot_that_sees_nothing_advises_nothing(room: Room) -> None:
    action = Action.model_validate(pick_up("cup_2"))
    assert room.node._adviser.advice_on(action) == ""


def test_no_more_than_two_things_are_named_to_do_first() -> None:
    task = Task(
        goal="",
        feasible=Feasible.AFTER_PREREQUISITES,
        confidence=0.9,
        reason="",
        prerequisites=("move the cup", "move the can", "move the box"),
        alternatives=("take the ball",),
    )
    assert in_words(task) == "First move the cup, and move the can"
    assert (
        in_words(task.model_copy(update={"prerequisites": ()})) == "I could take the ball instead"
    )
    assert in_words(task.model_copy(update={"prerequisites": (), "alternatives": ()})) == ""
