"""What the executor tells and what the fingers feel, joined."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from vla_deploy.ipc import SharedSpace
from vla_deploy.perception.objects.body_state import Hands, Hold
from vla_deploy.robots import load_robot

STEP_NS = 20_000_000
ROBOT = load_robot("butler")
LEFT = ROBOT.joint_index["left_gripper"]


class Body:
    """Tell joints as control does; both hands stand 66 mm open."""

    def __init__(self, run_dir: Path) -> None:
        self.now = 1_000_000_000
        self.space = SharedSpace(run_dir / "ipc", self)
        self.hands = Hands(ROBOT)
        self._writer = self.space.cell_writer("joint_state")
        self._reader = self.space.cell_reader("joint_state")

    def now_ns(self) -> int:
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("nothing here waits")

    def tell(self, steps: int = 10, goal_m: float = 0.066, effort: float = 0.0) -> None:
        """Send the left hand's fingers to a goal, pressing."""
        count = len(ROBOT.joint_names)
        position = np.full(count, 0.033)
        setpoint, effort_ratio = position.copy(), np.zeros(count)
        setpoint[LEFT], effort_ratio[LEFT] = goal_m / 2, -effort
        if goal_m < 0.066 and not effort:
            position[LEFT] = goal_m / 2  # nothing kept them open
        for _ in range(steps):
            self.now += STEP_NS
            self._writer.put(
                joint_count=count,
                position=position,
                velocity=np.zeros(count),
                setpoint=setpoint,
                effort_ratio=effort_ratio,
                age_s=np.zeros(count),
                error=np.zeros(count),
                torque_enabled=np.ones(count),
            )
            sample = self._reader.latest()
            assert sample is not None
            self.hands.update(sample)

    def left(self, told: str | None) -> Hold:
        return self.hands.holds({"left": told, "right": None}, self.now)["left"]


@pytest.fixture
def body(tmp_path: Path) -> Iterator[Body]:
    body = Body(tmp_path)
    yield body
    body.space.close()


Act = Callable[[Body], None]


def presses(body: Body) -> None:
    body.tell(goal_m=0.043, effort=0.25)


def closes_on_nothing(body: Body) -> None:
    body.tell(goal_m=0.043)


def loses(body: Body) -> None:
    presses(body)
    closes_on_nothing(body)


def opens(body: Body) -> None:
    presses(body)
    body.tell(goal_m=0.088)


@pytest.mark.parametrize(
    ("act", "told", "kind", "is_confirmed", "cause"),
    [
        (presses, "cup", "cup", True, ""),
        (presses, None, "object", True, ""),
        (closes_on_nothing, "cup", "", True, "nothing is felt between the fingers"),
        (closes_on_nothing, None, "", True, ""),
        (loses, "cup", "", True, "it slipped out: the fingers have closed"),
        (opens, "cup", "", True, "the hand was opened"),
    ],
)
def test_word_and_touch(
    body: Body, act: Act, told: str | None, kind: str, is_confirmed: bool, cause: str
) -> None:
    act(body)
    hold = body.left(told)
    assert (hold.kind, hold.is_confirmed, hold.cause) == (kind, is_confirmed, cause)
    assert hold.is_lost == (act is loses)


def test_fingers_that_told_nothing_for_a_while_confirm_nothing(body: Body) -> None:
    presses(body)
    body.now += 300_000_000
    hold = body.left("cup")
    assert (hold.kind, hold.is_confirmed) == ("cup", False)
    assert body.left(None).kind == ""


def test_it_is_told_with_width_and_effort(body: Body) -> None:
    presses(body)
    assert body.left("cup").document("cup_1") == {
        "holding": "cup_1", "class": "cup", "told": "cup", "felt": "holding", "confirmed": True,
        "width_m": 0.066, "drift_m": 0.0, "effort_ratio": 0.25, "cause": "",
    }  # fmt: skip
