"""Places and stated errors of perception against the truth of the twin's random scenes."""

import json
from typing import Any

import pytest

from benchmarks.perception_geometry import main, measure

pytestmark = pytest.mark.gl


def must_hold(report: dict[str, Any]) -> None:
    assert report["standing_xy_median_mm"] <= 5.0
    assert report["standing_xy_p90_mm"] <= 15.0
    assert report["lying_xy_median_mm"] <= 10.0
    assert report["lying_yaw_median_deg"] <= 5.0
    for kind in ("standing", "lying"):
        assert report[f"{kind}_missing"] <= 0.15 * report[f"{kind}_things"]
        assert report[f"{kind}_unsure"] <= 0.15 * report[f"{kind}_things"]


def test_things_are_placed_within_the_aims_and_errors_are_stated_honestly() -> None:
    report = measure(scenes=16, seed=1)
    assert report["standing_things"] + report["lying_things"] > 45
    must_hold(report)
    assert report["in_ellipse"] >= 0.9
    assert report["in_height_interval"] >= 0.9
    assert report["in_yaw_interval"] >= 0.9


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_many_scenes_bear_it_out() -> None:
    report = measure(scenes=600, seed=2)
    must_hold(report)
    assert report["in_ellipse"] >= 0.93
    assert report["in_yaw_interval"] >= 0.93


def test_the_report_is_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--json", "--scenes", "3"]) == 0
    assert json.loads(capsys.readouterr().out)["scenes"] == 3
