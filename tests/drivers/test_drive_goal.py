"""A goal ends when it is reached, impossible or out of time."""

from dataclasses import replace

import pytest

from drivers.wheel_drives.bus import DriveGoal
from drivers.wheel_drives.goal import BRAKE_TIMEOUT_NS, FAULT_RESET_NS, DrivesSeen, GoalKeeper

WELL = DrivesSeen(all_enabled=True, any_lost=False, any_faulted=False, any_braking=False)
OFF = replace(WELL, all_enabled=False)
MOVING = replace(WELL, any_braking=True)


@pytest.fixture
def goals() -> GoalKeeper:
    return GoalKeeper()


def test_drives_may_take_their_time_to_be_enabled(goals: GoalKeeper) -> None:
    goals.enable()
    goals.advance(OFF, 0)
    goals.advance(OFF, 1)
    assert goals.goal is DriveGoal.ENABLED


@pytest.mark.parametrize(
    "trouble",
    [replace(WELL, any_lost=True), replace(WELL, any_faulted=True), OFF],
    ids=["lost", "faulted", "fell out"],
)
def test_trouble_with_one_drive_stops_all(goals: GoalKeeper, trouble: DrivesSeen) -> None:
    goals.enable()
    goals.advance(WELL, 0)
    goals.advance(trouble, 1)
    assert goals.goal is DriveGoal.QUICK_STOP


def test_braked_drives_lose_their_power_when_they_stand(goals: GoalKeeper) -> None:
    goals.quick_stop(0)
    goals.advance(MOVING, 1)
    assert goals.goal is DriveGoal.QUICK_STOP
    goals.advance(WELL, 2)
    assert goals.goal is DriveGoal.DISABLED


def test_drives_that_never_stand_lose_their_power_in_the_end(goals: GoalKeeper) -> None:
    goals.quick_stop(0)
    goals.quick_stop(BRAKE_TIMEOUT_NS)
    goals.advance(MOVING, BRAKE_TIMEOUT_NS)
    assert goals.goal is DriveGoal.QUICK_STOP
    goals.advance(MOVING, BRAKE_TIMEOUT_NS + 1)
    assert goals.goal is DriveGoal.DISABLED


def test_a_reset_is_tried_for_a_while(goals: GoalKeeper) -> None:
    faulted = replace(OFF, any_faulted=True)
    goals.reset_fault(0)
    goals.advance(faulted, FAULT_RESET_NS)
    assert goals.goal is DriveGoal.FAULT_RESET
    goals.advance(faulted, FAULT_RESET_NS + 1)
    assert goals.goal is DriveGoal.DISABLED
    goals.reset_fault(0)
    goals.advance(OFF, 1)
    assert goals.goal is DriveGoal.DISABLED
