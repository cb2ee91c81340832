"""The judge of load detects every way in which a busy computer may change a job."""

from typing import Any

import pytest

from sim_twin.campaigns.load import judge

ALONE: dict[str, Any] = {
    "success": True,
    "error": None,
    "refused": None,
    "actions": [{"skill": "pick_up", "status": "succeeded"}],
    "placement_error_m": 0.011,
    "took_s": 50.0,
    "wall_s": 60.0,
    "ticks": 12_500,
    "late_ticks": 0,
    "bus_timeouts": 0,
    "wire_digest": "00",
}


def failures(**changes: Any) -> tuple[str, ...]:
    return judge("busy", {**ALONE, **changes}, ALONE).failures


def test_a_job_that_only_takes_longer_is_in_order() -> None:
    assert failures(wall_s=600.0) == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"success": False, "error": "servo_bus_lost"}, "failed: servo_bus_lost"),
        ({"late_ticks": 1}, "late_ticks: 1, expected 0"),
        ({"bus_timeouts": 3}, "bus_timeouts: 3, expected 0"),
        ({"actions": []}, "did [], alone ['pick_up succeeded']"),
        ({"wire_digest": "01"}, "other bytes on the buses than alone"),
        ({"placement_error_m": 0.0125}, "placed 1.5 mm from where it did alone"),
    ],
)
def test_what_else_changes_is_a_failure(changes: dict[str, Any], words: str) -> None:
    assert failures(**changes) == (words,)
