"""A computer that stood still excuses what it can explain, and nothing else."""

import pytest

from sim_twin.campaigns.kill_failures import is_void, late, late_ready, wrong_state
from sim_twin.stillness import HELD_UP_S

LATE = next(late(1.5, 1.7, "left_elbow moves at 0.1 rad/s"))
NOT_READY = next(late_ready(30.0, 31.0))
BUS_LOST = wrong_state("stopped", "servo_bus_lost: no answer", ("armed",))


@pytest.mark.parametrize("failures", [(LATE,), (NOT_READY,), (BUS_LOST,), (LATE, BUS_LOST)])
def test_lateness_and_a_stop_for_a_lost_bus_are_void_if_the_computer_stood_still(
    failures: tuple[str, ...],
) -> None:
    assert is_void(failures, HELD_UP_S)
    assert not is_void(failures, HELD_UP_S - 0.001)


@pytest.mark.parametrize(
    "failure",
    [
        "orphan 12 of run 7",
        "fall red_cup: 2, limit 1",
        "joint speed left_elbow: 3, limit 1.5",
        wrong_state("armed", "none: ", ("disarmed", "stopped", "fault")),
        wrong_state("disarmed", "none: ", ("armed",)),
        wrong_state("silent", "None: None", ("armed",)),
        wrong_state("stopped", "collision: left_elbow", ("armed",)),
        wrong_state("stopped", "servo_bus_lost: no answer", ("silent",)),
    ],
)
def test_what_no_stall_explains_stands_alone_and_beside_lateness(failure: str) -> None:
    assert not is_void((failure,), 1.0)
    assert not is_void((LATE, failure), 1.0)


def test_what_did_not_fail_is_not_void() -> None:
    assert not is_void((), 1.0)
    assert not list(late(1.5, 1.5, "")) + list(late(None, 9.0, "")) + list(late_ready(30.0, 30.0))


def test_what_never_came_is_late() -> None:
    assert "inf" in next(late(1.5, float("inf"), "left_wheel"))
    assert "inf" in next(late_ready(30.0, float("inf")))
