"""The judge of pressure sees what is out of order, stopped or late; the probes read its scene."""

import argparse
import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from platforms import load_profile
from platforms.probes import open_probes
from sim_twin.campaigns.pressing import pressure
from sim_twin.campaigns.pressing.judge import TroubleSeen, judge, steps_of
from sim_twin.campaigns.pressing.pressed_scene import PROFILE, PressedScene
from sim_twin.campaigns.pressing.troubles import TROUBLES
from sim_twin.campaigns.ticks import TickWatch
from vla_deploy.supervisor.budgets.emergency import Emergencies, critical_trips_c

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


def scene_in(folder: Path) -> PressedScene:
    """Return a scene without a robot."""
    scene = PressedScene(0, small_disk=False, shifted_clock=False)
    scene.folder = folder
    scene.lay_out_board()
    return scene


def test_the_profile_is_valid_and_declares_every_step_that_a_trouble_expects(
    tmp_path: Path,
) -> None:
    path = tmp_path / "pressed.toml"
    path.write_text(PROFILE)
    profile = load_profile(str(path))
    declared = [" ".join(filter(None, (step.action, step.process))) for step in profile.ladder]
    for trouble in TROUBLES:
        places = [declared.index(step) for step in trouble.steps]
        assert places == sorted(places), trouble.name


def test_heat_and_brown_outs_reach_the_probes(tmp_path: Path) -> None:
    scene = scene_in(tmp_path)
    scene.disk.mkdir()
    probes = open_probes(scene.board, disk_folders=[scene.disk])
    emergencies = Emergencies(partial(critical_trips_c, scene.board))
    try:
        readings = probes.read()
        assert readings["temperature_c"].value == 45.0
        assert readings["disk_free_bytes"].value
        assert not emergencies.judge(readings)
        scene.heat(91.5)
        assert probes.read()["temperature_c"].value == 91.5
        scene.brown_out()
        assert "under-voltage" in emergencies.judge(probes.read())
        assert not emergencies.judge(probes.read())
        scene.heat(103.0)
        assert "the board goes off" in emergencies.judge(probes.read())
    finally:
        probes.close()
