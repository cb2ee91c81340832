"""Whatever process dies, freezes or is asked to end: the robot stays safe and comes back."""

import pytest

from sim_twin.campaigns.killing import kills
from sim_twin.campaigns.killing.rules import Injection, injections

pytestmark = [pytest.mark.stack, pytest.mark.gl]

EARLY_S = 3.0


def failures(chosen: list[Injection]) -> list[str]:
    report = kills.inject_all(chosen, 0, print)
    print(report.text())
    return [case.row for case in report.failed]


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_kill_at_a_random_moment_leaves_the_robot_safe() -> None:
    assert failures(injections(1, 0, EARLY_S)) == []


@pytest.mark.slow
@pytest.mark.timeout(6 * 3600)
def test_two_hundred_kills_at_random_moments_leave_the_robot_safe() -> None:
    assert failures(injections(200, 0)) == []
