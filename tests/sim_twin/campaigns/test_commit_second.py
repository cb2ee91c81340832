"""Late ticks around a commit count by themselves; the computer's own stalls explain some."""

from sim_twin.campaigns.switching.commit_second import CommitLook, commit_ns, explained, late_around
from sim_twin.harness.stillness import Stall

S = 1_000_000_000
LOOKS = [
    CommitLook(now_ns=n * S // 10, late=0 if n < 22 else 3, phase="watch" if n >= 20 else "prepare")
    for n in range(60)
]


def test_the_commit_is_where_it_is_seen_first() -> None:
    assert commit_ns(LOOKS) == 2 * S
    assert commit_ns(LOOKS[:20]) is None


def test_late_ticks_in_the_second_count_and_no_others() -> None:
    assert late_around(LOOKS, 2 * S) == (3, 15 * S // 10, 25 * S // 10)
    assert late_around(LOOKS, 4 * S)[0] == 0


def test_a_stall_explains_one_late_tick_and_one_for_each_period() -> None:
    stalls = [Stall(due_ns=S, seconds=0.017), Stall(due_ns=S, seconds=0.001)]
    assert explained(stalls, 0, 2 * S, 0.008) == 3
    assert explained(stalls, 2 * S, 3 * S, 0.008) == 0


def test_a_stall_may_have_been_longer_than_it_was_seen() -> None:
    assert explained([Stall(due_ns=S, seconds=0.0012)], 0, 2 * S, 0.008) == 0
    assert explained([Stall(due_ns=S, seconds=0.0012, before_s=0.0005)], 0, 2 * S, 0.008) == 1
