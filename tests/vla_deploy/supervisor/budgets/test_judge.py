import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.clock import NS_PER_S
from platforms import LadderTiming, ProcessBudget, TotalBudget
from vla_deploy.supervisor.budgets.judge import BudgetStanding, Line, Measurement, judge, lines_of

TIMING = LadderTiming(rise_s=2.0, fall_s=4.0, release_ratio=0.8)
MEMORY = Line(metric="memory_mb", process="planner", limit=100.0)
DISK = Line(metric="disk_free_mb", limit=500.0, at_least=True)


def follow(line: Line, values: list[float | None], timing: LadderTiming = TIMING):
    """Judge one value per second; None is a number that cannot be read."""
    findings, seen = {}, []
    for second, value in enumerate(values):
        got = Measurement(value=value, reason="" if value is not None else "no such file")
        findings = judge([line], findings, {line.key: got}, timing, second * NS_PER_S)
        seen.append(findings[line.key])
    return seen


def test_a_line_is_over_only_after_the_rise_time():
    seen = follow(MEMORY, [50, 101, 101, 101, 101])
    assert [one.over for one in seen] == [False, False, False, True, True]
    assert [one.standing for one in seen[:4]] == [
        BudgetStanding.OK,
        BudgetStanding.RISING,
        BudgetStanding.RISING,
        BudgetStanding.OVER,
    ]


@pytest.mark.parametrize(
    ("line", "at_the_limit", "beyond"), [(MEMORY, 100, 100.1), (DISK, 500, 499)]
)
def test_the_limit_itself_is_allowed(line: Line, at_the_limit: float, beyond: float):
    assert not follow(line, [at_the_limit] * 9)[-1].over
    assert follow(line, [beyond] * 9)[-1].over


def test_one_good_value_starts_the_rise_time_anew():
    assert not any(one.over for one in follow(MEMORY, [101, 101, 99, 101, 101, 99]))


@pytest.mark.parametrize(("value", "released"), [(80.0, True), (80.1, False)])
def test_a_line_stays_over_until_it_was_below_the_release_ratio_for_the_fall_time(
    value: float, released: bool
):
    seen = follow(MEMORY, [101, 101, 101, value, value, value, value, value])
    assert [one.over for one in seen[2:7]] == [True] * 5
    assert seen[7].over is not released


def test_too_little_room_on_the_disk_is_released_above_the_limit_only():
    assert follow(DISK, [400] * 3 + [620] * 9)[-1].over
    assert not follow(DISK, [400] * 3 + [626] * 9)[-1].over


def test_a_missing_number_raises_nothing_and_releases_nothing_and_says_why():
    seen = follow(MEMORY, [None] * 9)
    assert not seen[-1].over
    assert seen[-1].standing is BudgetStanding.MISSING
    assert (seen[-1].measured, seen[-1].reason) == (None, "no such file")
    over = follow(MEMORY, [101, 101, 101] + [None] * 9)
    assert over[-1].over
    assert over[-1].since_ns == 3 * NS_PER_S


def test_a_process_that_has_ended_uses_nothing_any_more():
    findings = {MEMORY.key: follow(MEMORY, [101] * 3)[-1]}
    ended = {MEMORY.key: Measurement(value=None, reason="it does not run", ended=True)}
    for second in (3, 7):
        findings = judge([MEMORY], findings, ended, TIMING, second * NS_PER_S)
    assert not findings[MEMORY.key].over
    assert findings[MEMORY.key].measured is None


def test_a_new_limit_starts_anew():
    findings = {MEMORY.key: follow(MEMORY, [101] * 3)[-1]}
    wider = Line(metric="memory_mb", process="planner", limit=200.0)
    after = judge([wider], findings, {wider.key: Measurement(value=101.0)}, TIMING, 3 * NS_PER_S)
    assert not after[wider.key].over


def test_a_line_that_nobody_measures_is_missing():
    found = judge([MEMORY], {}, {}, TIMING, 0)[MEMORY.key]
    assert found.standing is BudgetStanding.MISSING
    assert "nobody" in found.reason


@given(st.lists(st.sampled_from([50.0, 79.0, 90.0, 101.0, 150.0, None]), max_size=60))
def test_an_answer_changes_only_after_its_time_whatever_is_measured(values: list[float | None]):
    seen = follow(MEMORY, values)
    flips = [second for second in range(1, len(seen)) if seen[second].over != seen[second - 1].over]
    for second in flips:
        needed_s = 2 if seen[second].over else 4
        recent = values[second - needed_s : second + 1]
        assert None not in recent
        assert all(value > 100 if seen[second].over else value <= 80 for value in recent)


def test_a_profile_becomes_a_line_for_each_limit_it_declares():
    total = TotalBudget(memory_mb=2000, cpu_ratio=3, disk_free_mb=500, temperature_c=85)
    lines = lines_of({"planner": ProcessBudget(memory_mb=150, cpu_ratio=0.2)}, total)
    assert {line.key: line.limit for line in lines} == {
        ("memory_mb", "planner"): 150,
        ("cpu_ratio", "planner"): 0.2,
        ("memory_mb", ""): 2000,
        ("cpu_ratio", ""): 3,
        ("temperature_c", ""): 85,
        ("disk_free_mb", ""): 500,
    }
    assert [line.metric for line in lines if line.at_least] == ["disk_free_mb"]
