from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.clock import NS_PER_S
from platforms import LadderAction, LadderStep, LadderTiming
from vla_deploy.supervisor.budgets.judge import Line, Measurement, judge
from vla_deploy.supervisor.budgets.ladder import EMERGENCY, LadderMove, LadderState, Pressure, climb

TIMING = LadderTiming(rise_s=2.0, fall_s=5.0, release_ratio=0.8)
SLOW = LadderStep(action=LadderAction.SLOW, process="perception", ratio=0.5)
SMALLER = LadderStep(action=LadderAction.SMALLER_MODEL, process="perception")
SUSPEND = LadderStep(action=LadderAction.SUSPEND, process="planner")
RESTART = LadderStep(action=LadderAction.RESTART, process="perception")
LADDER = (SLOW, SMALLER, SUSPEND, RESTART, EMERGENCY)
LINES = {
    "perception": Line(metric="memory_mb", process="perception", limit=100.0),
    "planner": Line(metric="memory_mb", process="planner", limit=100.0),
    "executor": Line(metric="memory_mb", process="executor", limit=100.0),
    "total": Line(metric="temperature_c", limit=100.0),
}


class Climber:
    """Step judge and ladder once a second with what each line is said to use."""

    def __init__(self, ladder: tuple[LadderStep, ...] = LADDER) -> None:
        self.ladder = ladder
        self.state = LadderState()
        self.changes: list[LadderMove] = []
        self.second = 0
        self._findings = {}

    def go(self, seconds: int, emergency: str = "", **used: float) -> list[LadderStep]:
        start = len(self.changes)
        for _ in range(seconds):
            measured = {
                line.key: Measurement(value=used.get(name, 0.0)) for name, line in LINES.items()
            }
            now_ns = self.second * NS_PER_S
            self._findings = judge(LINES.values(), self._findings, measured, TIMING, now_ns)
            pressure = Pressure(findings=tuple(self._findings.values()), emergency=emergency)
            self.state, change = climb(self.ladder, TIMING, self.state, pressure, now_ns)
            self.changes += [change] if change else []
            self.second += 1
        return [change.step for change in self.changes[start:]]

    @property
    def in_force(self) -> list[LadderStep]:
        return [one.step for one in self.state.taken]


@pytest.fixture
def climber() -> Climber:
    return Climber()


def test_nothing_is_taken_while_budgets_are_kept(climber: Climber):
    assert climber.go(100, total=99, perception=99) == []


def test_pressure_on_the_whole_robot_takes_steps_one_at_a_time_in_the_declared_order(climber):
    steps = climber.go(30, total=101)
    assert steps == [SLOW, SMALLER, SUSPEND, EMERGENCY]  # nobody offends: no restart
    times_s = [change.at_ns // NS_PER_S for change in climber.changes]
    assert times_s == [2, 4, 6, 8]


def test_one_that_breaks_its_own_budget_takes_its_own_steps_and_nobody_elses(climber):
    assert climber.go(60, perception=101) == [SLOW, SMALLER, RESTART]
    assert climber.go(60, perception=101) == []


def test_one_without_steps_of_its_own_disturbs_nobody(climber):
    assert climber.go(60, executor=101) == []


def test_the_offenders_steps_come_first_when_the_whole_robot_is_under_pressure(climber):
    assert climber.go(30, total=101, planner=101) == [SUSPEND, SLOW, SMALLER, EMERGENCY]


def test_a_step_that_is_declared_twice_is_taken_twice():
    climber = Climber((SMALLER, SMALLER))
    assert climber.go(30, perception=101) == [SMALLER, SMALLER]
    assert climber.in_force == [SMALLER, SMALLER]
    climber.go(60)
    assert climber.in_force == []


def test_steps_are_undone_in_reverse_order_when_the_pressure_goes(climber):
    climber.go(6, total=101)
    assert climber.in_force == [SLOW, SMALLER]
    assert climber.go(30, total=50) == [SMALLER, SLOW]
    assert climber.in_force == []
    taken = [change.taken for change in climber.changes]
    assert taken == [True, True, False, False]


def test_a_step_that_is_enough_is_held_and_no_more_are_taken(climber):
    climber.go(4, total=101)
    assert climber.in_force == [SLOW]
    assert climber.go(100, total=90) == []  # below the limit, above the release ratio
    assert climber.in_force == [SLOW]


def test_the_step_of_a_process_is_undone_though_another_is_still_over(climber):
    climber.go(4, perception=101, planner=101)
    assert climber.in_force == [SLOW]
    climber.go(2, perception=101, planner=101)
    climber.go(3, perception=50, planner=101)
    assert climber.in_force == [SLOW, SMALLER, SUSPEND]
    climber.go(30, perception=50, planner=101)
    assert climber.in_force == [SUSPEND]


def test_an_emergency_stops_the_robot_at_once(climber):
    assert climber.go(1, emergency="supply") == [EMERGENCY]
    assert climber.changes[0].why == "supply"


def test_an_emergency_stop_is_undone_after_the_fall_time_only(climber):
    climber.go(1, emergency="supply")
    assert climber.go(4) == []
    assert climber.go(1) == [EMERGENCY]
    assert not climber.changes[-1].taken


def test_an_emergency_stop_stays_while_the_robot_is_over_its_budget(climber):
    climber.go(1, emergency="supply")
    climber.go(40, total=90)
    assert climber.in_force == []
    climber.go(3, total=101)
    climber.go(1, emergency="supply", total=101)
    climber.go(60, total=90)
    assert EMERGENCY in climber.in_force


def test_every_change_says_what_was_measured_and_its_limit(climber):
    climber.go(3, total=101)
    assert str(climber.changes[0]) == (
        "took slow of perception: temperature_c 101 above its budget of 100"
    )


def test_a_step_that_is_needed_again_soon_stays_longer_each_time(climber):
    held_s = []
    for _ in range(9):
        climber.go(3, total=101)
        taken_s = climber.second
        while climber.in_force:
            climber.go(1, total=50)
        held_s.append(climber.second - taken_s)
    assert held_s == sorted(held_s)
    assert held_s[-1] >= 20 * held_s[0]
    assert held_s[-1] == held_s[-2]  # there is a longest


def test_after_a_long_calm_a_step_is_undone_as_early_as_ever(climber):
    for _ in range(3):
        climber.go(3, total=101)
        climber.go(20, total=50)
    relapsed = climber.state.relapses
    climber.go(2000, total=50)
    assert (relapsed > 0, climber.state.relapses) == (True, 0)


def test_a_load_that_comes_back_with_every_undone_step_causes_few_changes():
    climber = Climber()
    for _ in range(3600):  # the step takes the load away, its end brings it back
        climber.go(1, total=50 if climber.in_force else 101)
    assert len(climber.changes) <= 2 * 5 + 2 * 3600 // (2 + 5 * 2**5) + 2


@given(
    st.lists(
        st.tuples(
            st.integers(1, 8),
            st.sampled_from([0.0, 79.0, 95.0, 120.0]),
            st.sampled_from([0.0, 95.0, 120.0]),
        ),
        max_size=40,
    )
)
def test_no_input_makes_the_ladder_flap(loads: list[tuple[int, float, float]]):
    climber = Climber()
    for seconds, total, perception in loads:
        climber.go(seconds, total=total, perception=perception)
    at_s = [change.at_ns / NS_PER_S for change in climber.changes]
    assert all(later - earlier >= TIMING.rise_s for earlier, later in pairwise(at_s))
    for earlier, later in pairwise(climber.changes):
        if not later.taken:
            assert later.at_ns - earlier.at_ns >= TIMING.fall_s * NS_PER_S
    taken = sum(change.taken for change in climber.changes)
    assert len(climber.in_force) == taken - (len(climber.changes) - taken)


@pytest.mark.parametrize("low_s", [1, 2, 4])
def test_a_load_faster_than_the_rise_time_changes_nothing(climber: Climber, low_s: int):
    for _ in range(100):
        climber.go(1, total=120)
        climber.go(low_s, total=10)
    assert climber.changes == []
