"""The robot must rest in time, and until an operator acts where the rule says so."""

import math
import signal

import pytest

from sim_twin.campaigns.killing.rest import STILL_RAD, RestWatch
from sim_twin.campaigns.killing.rules import RULES

KILLED = RULES["control", signal.SIGKILL]


def seen(watch: RestWatch, *looks: tuple[float, float, float]) -> list[str]:
    """Let the watch see the one joint's place and speed at times; return what it says."""
    for since_s, place, speed in looks:
        if watch.wants(since_s):
            joint = {"position": place, "velocity": speed}
            watch.look(since_s, {"joints": {"elbow": joint}})
    return list(watch.failures())


def test_a_robot_that_rests_in_time_and_stays_is_well() -> None:
    watch = RestWatch(KILLED)
    assert not seen(watch, (0.1, 0.0, 1.0), (0.5, 0.1, 0.0), (1.7, 0.1, 0.0), (9.0, 0.1, 0.0))
    assert watch.rest_s == 0.5


def test_one_that_never_rests_is_late() -> None:
    (failure,) = seen(RestWatch(KILLED), (0.1, 0.0, 1.0), (1.7, 0.4, 1.0), (9.0, 3.0, 1.0))
    assert failure.startswith("at rest after inf s")
    assert "elbow moves" in failure


@pytest.mark.parametrize("jerk", [STILL_RAD + 0.01, -1.0])
def test_a_jerk_when_the_process_comes_back_is_a_failure_though_it_ends(jerk: float) -> None:
    looks = [(0.5, 0.1, 0.0), (6.0, 0.1 + jerk, 0.0), (7.0, 0.1, 0.0)]
    (failure,) = seen(RestWatch(KILLED), *looks)
    assert failure.startswith("elbow moved by")


def test_where_no_hand_is_wanted_motion_goes_on_and_lowered_arms_lie_limp() -> None:
    carried_on = RestWatch(RULES["planner", signal.SIGKILL])
    assert not seen(carried_on, (0.1, 0.0, 1.0), (5.0, 2.0, 1.0))
    assert math.isnan(carried_on.rest_s)
    lowered = RestWatch(RULES["supervisor", signal.SIGTERM])
    assert not seen(lowered, (9.0, 0.0, 0.0), (20.0, 1.0, 0.0))


def test_a_limp_arm_may_slide_on_slowly_and_one_with_power_may_not() -> None:
    slides = ((1.0, 0.0, 0.04), (20.0, 0.5, 0.0))
    assert not seen(RestWatch(RULES["supervisor", signal.SIGTERM]), *slides)
    assert seen(RestWatch(KILLED), *slides)
