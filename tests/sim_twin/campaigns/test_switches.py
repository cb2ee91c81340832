"""The judge of switches must see leaks, late ticks, stops, and bad profiles that stay."""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from platforms import ProfileError, load_profile
from sim_twin.campaigns.switching import switches
from sim_twin.campaigns.switching.commit_second import CommitLook, commit_ns, explained, late_around
from sim_twin.campaigns.switching.host_stalls import HostStall
from sim_twin.campaigns.switching.judge import (
    MOST_MIB_PER_SWITCH,
    SwitchSeen,
    judge,
    memory_case,
    slopes,
    ticks_case,
)
from sim_twin.campaigns.switching.profiles import BAD, GOOD
from sim_twin.campaigns.ticks import TickWatch

KEPT = SwitchSeen(
    outcome="kept",
    reason="",
    seconds=4.0,
    ticks=TickWatch(ticks=450, late=0),
    least_rate_hz=100.0,
    moved_rad=1.0,
    states=frozenset({"armed"}),
    memory_mib={"control": 100.0},
)


def history(mib_per_switch: float, count: int = 100) -> list[SwitchSeen]:
    noise = np.random.default_rng(1).normal(0.0, 0.1, count)
    return [
        replace(
            KEPT,
            memory_mib={
                "control": 100.0 + 2.0 * min(number, 10) + mib_per_switch * number + noise[number],
                "planner": 50.0,
            },
        )
        for number in range(count)
    ]


def test_a_switch_that_is_kept_in_motion_has_no_fault() -> None:
    assert not list(judge(KEPT, ("kept",)))


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"outcome": "rolled back", "reason": "control: late"}, "rolled back (control: late)"),
        ({"states": frozenset({"armed", "stopped"})}, "control was stopped"),
        ({"states": frozenset()}, "control was never looked at"),
        ({"ticks": TickWatch(ticks=359, late=0)}, "359 ticks in 4.0 s, expected 360"),
        ({"moved_rad": 0.0}, "moved 0.000 rad"),
        ({"late_at_commit": 1}, "1 ticks late in the second around the commit"),
        ({"late_at_commit": 3, "explained_at_commit": 2}, "the computer explains 2"),
    ],
)
def test_what_a_switch_must_not_do_is_reported(changes: dict[str, object], word: str) -> None:
    found = list(judge(replace(KEPT, **changes), ("kept",)))  # type: ignore[arg-type]
    assert any(word in fault for fault in found), found


def test_late_ticks_at_a_commit_that_the_computer_explains_are_no_fault() -> None:
    assert not list(judge(replace(KEPT, late_at_commit=2, explained_at_commit=2), ("kept",)))


def test_a_bad_profile_that_stays_or_is_refused_for_another_reason_is_a_fault() -> None:
    refused = replace(KEPT, outcome="refused", reason="planner: too much")
    assert not list(judge(refused, ("refused",), "planner"))
    assert list(judge(refused, ("refused",), "control"))
    assert list(judge(KEPT, ("refused",), ""))


@pytest.mark.parametrize("slope", [0.0, 0.02, 0.5])
def test_the_slope_is_that_after_the_warm_up(slope: float) -> None:
    found = slopes(history(slope))
    assert found["control"] == pytest.approx(slope, abs=0.003)
    assert found["planner"] == pytest.approx(0.0, abs=1e-9)


def test_a_leak_is_a_failure_that_names_the_process() -> None:
    assert not memory_case(history(0.5 * MOST_MIB_PER_SWITCH)).failures
    (failure,) = memory_case(history(2.0 * MOST_MIB_PER_SWITCH)).failures
    assert failure.startswith("control grows by")


def test_too_few_switches_give_a_slope_and_say_that_it_is_not_judged() -> None:
    case = memory_case(history(1.0, count=12))
    assert not case.failures
    assert case.figures["control_mib_per_switch"] > 0.9
    assert case.figures["not_judged"] == "12 switches, 40 are needed"


def test_late_ticks_are_judged_over_all_switches_against_those_before() -> None:
    before = TickWatch(ticks=1000, late=10)
    few = [replace(KEPT, ticks=TickWatch(ticks=500, late=n)) for n in (20, 0)]
    many = [replace(KEPT, ticks=TickWatch(ticks=500, late=n)) for n in (20, 1)]
    assert not ticks_case(before, few).failures
    assert ticks_case(before, many).failures == ("2.10% of the ticks late, limit 2.00%",)


def test_the_good_profiles_are_valid_and_the_file_faults_are_faults(tmp_path: Path) -> None:
    for name, text in {**GOOD, **{bad.name: bad.text for bad in BAD}}.items():
        (tmp_path / f"{name}.toml").write_text(text)
    for name in GOOD:
        assert load_profile(str(tmp_path / f"{name}.toml")).control_rate_hz in (100, 125)
    for name in ("not_toml", "out_of_range", "unknown_key"):
        bad = next(bad for bad in BAD if bad.name == name)
        with pytest.raises(ProfileError, match=bad.reason):
            load_profile(str(tmp_path / f"{name}.toml"))
    for name in ("process_refuses", "memory_not_kept", "computer_too_small"):
        load_profile(str(tmp_path / f"{name}.toml"))


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
    stalls = [HostStall(due_ns=S, seconds=0.017), HostStall(due_ns=S, seconds=0.001)]
    assert explained(stalls, 0, 2 * S, 0.008) == 3
    assert explained(stalls, 2 * S, 3 * S, 0.008) == 0


def test_a_stall_may_have_been_longer_than_it_was_seen() -> None:
    assert explained([HostStall(due_ns=S, seconds=0.0010)], 0, 2 * S, 0.008) == 0
    assert explained([HostStall(due_ns=S, seconds=0.0012)], 0, 2 * S, 0.008) == 1


@pytest.mark.slow
@pytest.mark.stack
@pytest.mark.timeout(900)
def test_the_real_processes_switch_under_motion_and_refuse_bad_profiles() -> None:
    report = switches.run(argparse.Namespace(only="", seed=0, count=8), print)
    assert len(report.cases) == 8 + len(BAD) + 2
    assert not report.failed, report.text()
