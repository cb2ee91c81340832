"""The judge of pressure must see every step out of order, every stop, end and delay."""

import argparse
import math
from dataclasses import replace

import pytest

from sim_twin.campaigns.pressing import pressure
from sim_twin.campaigns.pressing.judge import TroubleSeen, judge, steps_of
from sim_twin.campaigns.pressing.troubles import TROUBLES
from sim_twin.campaigns.ticks import TickWatch

HOG = next(trouble for trouble in TROUBLES if trouble.name == "memory_hog")
QUIET = TickWatch(ticks=1000, late=2)
GOOD = TroubleSeen(
    taken=HOG.steps,
    undone=tuple(reversed(HOG.steps)),
    metrics_over=frozenset({"memory_mb"}),
    before=QUIET,
    during=QUIET,
    after=QUIET,
    states={"armed": ""},
    replaced=frozenset({"perception"}),
    crashed=("perception",),
    hazards=(),
    steps_s=8.0,
    service_s=20.0,
)


def faults(**changes: object) -> list[str]:
    return list(judge(HOG, replace(GOOD, **changes)))  # type: ignore[arg-type]


def test_what_is_as_declared_has_no_fault() -> None:
    assert not faults()


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"taken": HOG.steps[::-1], "undone": HOG.steps}, "steps taken"),
        ({"taken": (*HOG.steps, "protective_stop")}, "steps taken"),
        ({"undone": HOG.steps}, "steps undone"),
        ({"undone": ()}, "steps undone: none"),
        ({"metrics_over": frozenset({"cpu_ratio"})}, "memory_mb was never told"),
        ({"steps_s": math.nan}, "the last step"),
        ({"steps_s": HOG.steps_s + 0.1}, "the last step"),
        ({"service_s": math.nan}, "full service"),
        ({"service_s": HOG.service_s + 0.1}, "full service"),
        ({"during": TickWatch(ticks=1000, late=13)}, "late during it"),
        ({"after": TickWatch(ticks=1000, late=13)}, "late after it"),
        ({"during": TickWatch(ticks=0, late=0)}, "late during it"),
        (
            {"states": {"armed": "", "protective_stop": "zone_stop"}},
            "control was protective_stop (zone_stop)",
        ),
        ({"states": {"armed": "", "silent": ""}}, "control was silent"),
        ({"replaced": frozenset({"perception", "control"})}, "control ended"),
        ({"crashed": ("executor",)}, "crash reports of executor"),
        ({"hazards": ("fall red_cup: 2, limit 1",)}, "fall red_cup"),
    ],
)
def test_what_is_not_as_declared_is_reported(changes: dict[str, object], word: str) -> None:
    found = faults(**changes)
    assert any(word in fault for fault in found), found


def test_a_computer_that_was_late_before_is_allowed_twice_that() -> None:
    busy = TickWatch(ticks=1000, late=100)
    assert not faults(before=busy, during=TickWatch(ticks=1000, late=200))
    assert faults(before=busy, during=TickWatch(ticks=1000, late=201))


def test_steps_are_listed_with_their_process_in_order() -> None:
    history = [
        {"action": "slow", "process": "perception", "taken": True},
        {"action": "protective_stop", "process": None, "taken": True},
        {"action": "protective_stop", "process": None, "taken": False},
    ]
    assert steps_of(history, taken=True) == ("slow perception", "protective_stop")
    assert steps_of(history, taken=False) == ("protective_stop",)


def test_every_kind_of_pressure_has_a_trouble() -> None:
    names = {trouble.name for trouble in TROUBLES}
    hogs = {"memory_hog", "cpu_hog", "disk_full"}
    assert names == hogs | {"thermal_ramp", "brown_out", "clock_forward", "clock_back"}


@pytest.mark.slow
@pytest.mark.stack
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("only", [trouble.name for trouble in TROUBLES])
def test_the_real_processes_bear_it(only: str) -> None:
    report = pressure.run(argparse.Namespace(only=only, seed=0), print)
    assert report.cases
    assert not report.failed, report.text()
