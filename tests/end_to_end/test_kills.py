"""Whatever process dies, freezes or is asked to end: the robot stays safe and comes back."""

import argparse

import pytest

from sim_twin.campaigns import kills

pytestmark = [pytest.mark.stack, pytest.mark.gl]

INJECTIONS = 20


def campaign(count: int) -> list[str]:
    options = argparse.Namespace(count=count, seed=0, only="")
    report = kills.run(options, print)
    print(report.text())
    return [case.row for case in report.failed]


@pytest.mark.timeout(900)
def test_twenty_kills_at_random_moments_leave_the_robot_safe() -> None:
    assert campaign(INJECTIONS) == []


@pytest.mark.slow
@pytest.mark.timeout(3 * 3600)
def test_two_hundred_kills_at_random_moments_leave_the_robot_safe() -> None:
    assert campaign(200) == []
