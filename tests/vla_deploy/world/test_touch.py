"""Fingers as the twin's: 50 samples a second, effort and speed as a servo tells them."""

import math
from dataclasses import replace

import pytest

from vla_deploy.world.touch import FingerSample, Grip, Touch, feel

STEP_NS = 20_000_000
CUP_M = 0.066


class Fingers:
    """Close on something of a width, or on nothing."""

    def __init__(self) -> None:
        self.touch = Touch()
        self.now_ns = 0

    def tell(self, **values: float | bool) -> Touch:
        self.now_ns += STEP_NS
        usual: dict[str, float] = {"speed_m_s": 0.0, "closing_ratio": 0.0}
        sample = FingerSample(stamp_ns=self.now_ns, **(usual | values))  # type: ignore[arg-type]
        self.touch = feel(self.touch, sample)
        return self.touch

    def close(self, width_m: float = CUP_M, goal_m: float = 0.043) -> Touch:
        """Close from 88 mm; what stops the fingers before their goal is pressed."""
        for opening_m in (0.088, 0.082, 0.075, 0.070):
            self.tell(opening_m=opening_m, goal_m=goal_m, speed_m_s=-0.06, closing_ratio=0.01)
        for _ in range(10):
            self.rest(max(width_m, goal_m), goal_m)
        return self.touch

    def rest(self, opening_m: float, goal_m: float = 0.043) -> Touch:
        presses = opening_m - goal_m > 0.001
        return self.tell(opening_m=opening_m, goal_m=goal_m, closing_ratio=0.25 * presses)


def test_fingers_stopped_short_and_pressing_hold_something_as_wide_as_they_stand() -> None:
    touch = Fingers().close()
    assert (touch.grip, touch.width_m) == (Grip.HOLDING, CUP_M)
    assert touch.fits((0.066, 0.066, 0.095))
    assert touch.fits((0.2, 0.06, 0.04))
    assert not touch.fits((0.03, 0.03, 0.03))


def test_fingers_that_reach_their_goal_hold_nothing() -> None:
    assert Fingers().close(width_m=0.0).grip is Grip.EMPTY


def test_they_are_only_closing_until_they_have_stood_still() -> None:
    fingers = Fingers()
    seen = [fingers.tell(opening_m=0.08, goal_m=0.04, speed_m_s=-0.05).grip for _ in range(3)]
    assert set(seen) == {Grip.CLOSING}
    for _ in range(4):
        assert not fingers.rest(CUP_M).is_held
    for _ in range(3):
        touch = fingers.rest(CUP_M)
    assert touch.is_held


def test_one_blow_against_the_fingers_while_they_close_is_no_hold() -> None:
    fingers = Fingers()
    for effort in (0.01, 0.3, 0.01, 0.01, 0.01, 0.3):
        touch = fingers.tell(opening_m=0.07, goal_m=0.04, speed_m_s=-0.05, closing_ratio=effort)
    assert touch.grip is Grip.CLOSING


def test_slow_closing_under_pressure_is_slip_and_then_loss() -> None:
    fingers = Fingers()
    fingers.close()
    grips = []
    for step in range(1, 18):
        opening_m = CUP_M - 0.0015 * step
        grips.append(
            fingers.tell(
                opening_m=max(opening_m, 0.043),
                goal_m=0.043,
                speed_m_s=-0.1,
                closing_ratio=0.25 if opening_m > 0.044 else 0.0,
            ).grip
        )
    assert grips[0] is Grip.HOLDING
    assert Grip.SLIPPING in grips
    assert grips[-1] is Grip.LOST
    assert "slipped out" in fingers.touch.cause


def test_a_tapered_thing_that_comes_to_rest_again_is_held_at_its_new_width() -> None:
    fingers = Fingers()
    fingers.close()
    moved = fingers.tell(opening_m=0.062, goal_m=0.043, speed_m_s=-0.05, closing_ratio=0.25)
    assert (moved.grip, moved.drift_m) == (Grip.SLIPPING, pytest.approx(0.004))
    for _ in range(7):
        touch = fingers.rest(0.062)
    assert (touch.grip, touch.width_m, touch.drift_m) == (Grip.HOLDING, 0.062, 0.0)


def test_a_thing_snatched_away_is_lost_with_its_cause_until_the_hand_is_used_again() -> None:
    fingers = Fingers()
    fingers.close()
    for _ in range(30):
        touch = fingers.rest(0.043)
    assert touch.grip is Grip.LOST
    assert "slipped out" in touch.cause
    assert fingers.tell(opening_m=0.05, goal_m=0.08).grip is Grip.EMPTY


def test_pads_that_let_go_without_closing_are_noticed_too() -> None:
    fingers = Fingers()
    fingers.close()
    for _ in range(9):
        assert fingers.tell(opening_m=CUP_M, goal_m=0.043, closing_ratio=0.0).is_held
    for _ in range(3):
        touch = fingers.tell(opening_m=CUP_M, goal_m=0.043, closing_ratio=0.0)
    assert (touch.grip, touch.cause) == (Grip.LOST, "it is gone: the fingers press on nothing")


def test_a_hand_that_is_opened_has_let_go_rather_than_lost() -> None:
    fingers = Fingers()
    fingers.close()
    for goal_m in (0.050, 0.056, 0.062, 0.070, 0.088, 0.088):
        touch = fingers.tell(opening_m=CUP_M, goal_m=goal_m, closing_ratio=0.2)
        assert (touch.grip, touch.cause) == (Grip.EMPTY, "the hand was opened")
    assert fingers.close().is_held


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        ({"is_powered": False}, "no power"),
        ({"opening_m": math.nan}, "tell nothing"),
        ({"closing_ratio": math.inf}, "tell nothing"),
    ],
)
def test_fingers_that_cannot_feel_say_so(changes: dict[str, float], cause: str) -> None:
    fingers = Fingers()
    fingers.close()
    usual = {"opening_m": CUP_M, "goal_m": 0.043, "closing_ratio": 0.25}
    touch = fingers.tell(**(usual | changes))
    assert touch.grip is Grip.UNKNOWN
    assert cause in touch.cause


def test_the_same_past_feels_the_same() -> None:
    """A step has no memory but its state: replaying it gives the same."""
    fingers = Fingers()
    before = fingers.close()
    sample = FingerSample(
        stamp_ns=fingers.now_ns + STEP_NS,
        opening_m=CUP_M,
        goal_m=0.043,
        speed_m_s=0.0,
        closing_ratio=0.25,
    )
    assert feel(before, sample) == feel(replace(before), sample)


def test_a_goal_that_jumps_up_while_the_fingers_press_on_has_not_let_go() -> None:
    """A control that starts anew sends the fingers less far: it opens nothing."""
    fingers = Fingers()
    fingers.close()
    for _ in range(4):
        fingers.rest(CUP_M, goal_m=CUP_M - 0.008)
    for _ in range(10):
        touch = fingers.rest(CUP_M, goal_m=CUP_M - 0.008)
    assert (touch.grip, touch.width_m) == (Grip.HOLDING, CUP_M)
