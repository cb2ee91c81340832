"""Hold the judge of the stops, and that its report calls nothing verified that was not tried."""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sim_twin.campaigns.report import CampaignCase
from sim_twin.campaigns.stopping import stop_trials, stops
from sim_twin.campaigns.stopping.cells import (
    SHORT,
    SOURCES,
    HandLoad,
    StopCell,
    StopPhase,
    StopSource,
    cells,
    wall_cells,
)
from sim_twin.campaigns.stopping.report import StopReport

DRIVING = StopCell(source=StopSource.REQUEST, payload=HandLoad.EMPTY, phase=StopPhase.DRIVING)


def options(**chosen: Any) -> argparse.Namespace:
    given = {"short": True, "count": 1, "seed": 0, "only": "", "robot": "butler", "workers": 1}
    return argparse.Namespace(**{**given, **chosen})


def test_the_short_form_is_a_part_of_the_table() -> None:
    names = [cell.name for cell in (*cells(), *wall_cells())]
    assert set(SHORT) <= set(names)
    assert len(names) == len(set(names))
    assert {cell.source for cell in cells()} == set(SOURCES)


def test_the_short_form_is_built_and_verified_by_physics(tmp_path: Path) -> None:
    # Of the twin's time: on a busy computer the cells of the wall clock would judge that.
    report = stops.run(options(only="/empty/"), print)
    report.write(tmp_path)
    told = json.loads((tmp_path / "stops.json").read_text(encoding="utf-8"))
    figures = {case["name"]: case["figures"] for case in told["results"]}
    assert set(figures) == {name for name in SHORT if "/empty/" in name}
    assert (told["failed"], told["skipped"]) == (0, 0)
    for name, one in figures.items():
        assert (one["in_motion"], one["physics"]) == (1, "VERIFIED"), name
        assert 0.02 < one["standstill_s_max"] < 1.0, name
    assert figures["request/empty/driving"]["control"] == "1 verified"
    assert figures["can_bus_lost/empty/driving"]["control"] == "1 failed"
    assert 0.0 < figures["request/empty/driving"]["base_m"] < 0.1


def test_a_lost_bus_rests_and_fails_where_control_would_certify_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lost = replace(DRIVING, source=StopSource.CAN_BUS)
    rule = replace(SOURCES[StopSource.CAN_BUS], proves="verified")
    monkeypatch.setattr(stop_trials, "SOURCES", {**SOURCES, StopSource.CAN_BUS: rule})
    case = stop_trials.play(lost, seed=0, count=1, robot="butler")
    (failure,) = case.failures
    assert "control says failed wheels are not measured" in failure
    assert case.figures["physics"] == "FAILED"


def test_what_was_not_tried_is_written_as_such(tmp_path: Path) -> None:
    cases = (
        CampaignCase(name="request/empty/driving", figures={"n": 1, "physics": "VERIFIED"}),
        CampaignCase(name="wire/page/idle", failures=("no stop on the wire",)),
        *stops._not_played([DRIVING], options()),
    )
    report = StopReport(
        campaign="stops", cases=cases, command="vla-deploy validate stops", robot="butler", seed=0
    )
    report.write(tmp_path)
    told = json.loads((tmp_path / "stops.json").read_text(encoding="utf-8"))
    assert told["facts"]["command"] == "vla-deploy validate stops"
    assert (told["failed"], told["skipped"]) == (1, len(cases) - 2)
    text = (tmp_path / "stops.md").read_text(encoding="utf-8")
    assert text.count("VERIFIED |") == 2  # by physics, and the verdict, of the one cell
    assert "- button/empty/driving" not in text
    assert "voice: not tried here" in text
    page = (tmp_path / "stops.html").read_text(encoding="utf-8")
    assert "no stop on the wire" in page
    assert "http" not in page
