import pytest

from drivers.clock import NS_PER_S
from drivers.error_budget import BudgetLimits, BudgetState, BusBudget, ErrorBudget

MS = NS_PER_S // 1000
LIMITS = BudgetLimits(window_s=1.0, degraded_at=3, lost_at=6, recover_at=1)
OK, DEGRADED, LOST = BudgetState


def fail(budget: ErrorBudget, times: int, at_ns: int) -> BudgetState:
    return [budget.note_failure(at_ns) for _ in range(times)][-1]


@pytest.mark.parametrize(
    ("failures", "state"), [(1, OK), (2, OK), (3, DEGRADED), (5, DEGRADED), (6, LOST), (50, LOST)]
)
def test_the_count_in_the_window_decides(failures: int, state: BudgetState) -> None:
    assert fail(ErrorBudget(LIMITS), failures, 0) is state


def test_failures_leave_the_window_exactly_when_it_has_passed() -> None:
    budget = ErrorBudget(LIMITS)
    fail(budget, 2, 0)
    budget.state(NS_PER_S - 1)
    assert budget.count == 2
    budget.state(NS_PER_S)
    assert budget.count == 0


def test_slow_failures_never_add_up() -> None:
    budget = ErrorBudget(LIMITS)
    assert {budget.note_failure(n * 600 * MS) for n in range(1000)} == {OK}


def test_a_state_is_left_only_at_the_recovery_count() -> None:
    budget = ErrorBudget(LIMITS)
    for n in range(3):
        budget.note_failure(n * 100 * MS)
    assert budget.state(1050 * MS) is DEGRADED, "2 are left"
    assert budget.state(1150 * MS) is OK, "1 is left"


def test_a_lost_device_stays_lost_until_it_has_recovered() -> None:
    budget = ErrorBudget(LIMITS)
    for n in range(6):
        budget.note_failure(n * 100 * MS)
    assert budget.state(1250 * MS) is LOST, "3 are left: degraded, had it not been lost"
    assert budget.state(1450 * MS) is OK


def test_a_storm_longer_than_the_memory_is_forgotten_a_window_after_its_end() -> None:
    budget = ErrorBudget(LIMITS)
    for n in range(10_000):
        budget.note_failure(n * MS)
    assert budget.count == LIMITS.lost_at
    assert budget.state(9_999 * MS + NS_PER_S) is OK


def test_reset_forgets_everything() -> None:
    budget = ErrorBudget(LIMITS)
    fail(budget, 10, 0)
    budget.reset()
    assert budget.state(1) is OK
    assert fail(budget, 2, 1) is OK


@pytest.mark.parametrize(
    "wrong",
    [
        {"window_s": 0.0, "degraded_at": 1, "lost_at": 2},
        {"window_s": 1.0, "degraded_at": 3, "lost_at": 2},
        {"window_s": 1.0, "degraded_at": 2, "lost_at": 3, "recover_at": 2},
        {"window_s": 1.0, "degraded_at": 2, "lost_at": 3, "recover_at": -1},
    ],
)
def test_limits_that_contradict_themselves_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="error budget"):
        BudgetLimits(**wrong)


def bus() -> BusBudget:
    return BusBudget(["a", "b", "c", "d"], member=LIMITS, bus=LIMITS)


def test_one_dead_member_is_lost_and_then_no_longer_speaks_for_the_bus() -> None:
    budgets = bus()
    states = []
    for n in range(3000):
        budgets.note_cycle([2], n * 4 * MS)
        states.append((budgets.members[2], budgets.bus))
    assert states[0] == (OK, OK)
    assert states[5] == (LOST, LOST)
    assert states[-1] == (LOST, OK)
    assert budgets.as_dict() == {"bus": "ok", "degraded": [], "lost": ["c"]}


def test_scattered_failures_degrade_the_bus_before_any_member() -> None:
    budgets = bus()
    for n in range(4):
        budgets.note_cycle([n], n * 10 * MS)
    assert budgets.as_dict() == {"bus": "degraded", "degraded": [], "lost": []}


def test_a_bus_recovers_when_cycles_are_good_again() -> None:
    budgets = bus()
    for n in range(20):
        budgets.note_cycle([0, 1, 2, 3], n * 10 * MS)
    assert budgets.bus is LOST
    assert budgets.members == [LOST] * 4
    for n in range(20, 200):
        budgets.note_cycle([], n * 10 * MS)
    assert budgets.bus is OK
    assert budgets.members == [OK] * 4


def test_a_bus_without_any_answer_stays_lost() -> None:
    budgets = bus()
    for n in range(3000):
        budgets.note_cycle([0, 1, 2, 3], n * 4 * MS)
    assert budgets.bus is LOST


def test_a_member_that_was_exchanged_starts_afresh() -> None:
    budgets = bus()
    for n in range(8):
        budgets.note_cycle([1], n)
    budgets.reset(1)
    budgets.note_cycle([], 10)
    assert budgets.members[1] is OK
