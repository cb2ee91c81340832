"""The scene's analysis over HTTP: by measurement, for viewers, and without any effect."""

import subprocess
import sys
from http import HTTPStatus
from typing import Any

import numpy as np
import pytest

from tests.vla_deploy.dashboard.conftest import Dashboard
from vla_deploy.client.place_state import PlaceState

CUP = {
    "id": "cup_1",
    "class": "cup",
    "colour": "red",
    "position_m": [2.4, 1.6, 0.5],
    "size_m": [0.07, 0.07, 0.1],
    "yaw_rad": 0.0,
    "confidence": 0.9,
}
WIDE_CUP = CUP | {
    "id": "cup_2",
    "colour": "blue",
    "position_m": [2.0, 1.6, 0.5],
    "size_m": [0.14, 0.14, 0.1],
}


def sees(dashboard: Dashboard, *things: dict[str, Any], place: int = PlaceState.TRACKING) -> None:
    """The robot stands before the coffee table and tells what it sees."""
    now_ns = dashboard.link.clock.now_ns()
    seen = [one | {"last_seen_ns": now_ns} for one in things]
    dashboard.robot.shows("scene", stamp_ns=now_ns, objects=seen)
    dashboard.robot.space.cell_writer("pose").put(
        x_m=2.2,
        y_m=2.05,
        yaw_rad=-1.5708,
        match_ratio=1.0,
        covariance=np.zeros(9),
        state=place,
        doubt=0,
    )


def test_a_scene_is_told_with_what_can_be_taken(dashboard: Dashboard) -> None:
    sees(dashboard, CUP, WIDE_CUP)
    told = dashboard.get("analysis")
    assert (told["analyser"], told["task"], told["notes"]) == ("geometric", None, [])
    assert {one["id"]: one["accessible"] for one in told["objects"]} == {
        "cup_1": True,
        "cup_2": False,
    }


def test_a_goal_is_judged_with_what_could_be_done_instead(dashboard: Dashboard) -> None:
    sees(dashboard, CUP, WIDE_CUP)
    assert dashboard.get("analysis", goal="pick up the red cup")["task"]["feasible"] == "yes"
    task = dashboard.get("analysis", goal="pick up the blue cup")["task"]
    assert (task["feasible"], task["alternatives"]) == ("no", ["take the red cup (cup_1)"])


def test_a_goal_that_is_judged_is_no_command(dashboard: Dashboard) -> None:
    sees(dashboard, CUP)
    dashboard.get("analysis", goal="pick up the red cup")
    assert dashboard.robot.hears("utterance") == []
    assert dashboard.robot.hears("plan") == []


def test_what_hands_hold_and_where_the_robot_is_counts(dashboard: Dashboard) -> None:
    sees(dashboard, CUP, place=PlaceState.LOST)
    dashboard.robot.shows("executor_status", holding={"left": "ball", "right": "book"})
    told = dashboard.get("analysis", goal="pick up the red cup")
    assert told["objects"][0]["side"] is None
    assert "put down the ball in the left hand" in told["task"]["prerequisites"]


@pytest.mark.parametrize("document", [None, {"objects": "none"}])
def test_a_robot_that_tells_no_scene_is_told_as_such(
    dashboard: Dashboard, document: dict[str, Any] | None
) -> None:
    if document is not None:
        dashboard.robot.shows("scene", **document)
    error = dashboard.get("analysis", HTTPStatus.SERVICE_UNAVAILABLE)["error"]
    assert (error["code"], error["try"]) == ("no_scene", "vla-deploy status")


def test_whoever_asks_again_and_again_is_told_to_wait(dashboard: Dashboard) -> None:
    sees(dashboard, CUP)
    codes = [dashboard.client.get("/api/v1/analysis").status_code for _ in range(12)]
    assert codes[:5] == [HTTPStatus.OK] * 5
    assert HTTPStatus.TOO_MANY_REQUESTS in codes
    assert set(codes) == {HTTPStatus.OK, HTTPStatus.TOO_MANY_REQUESTS}


def test_a_goal_of_any_length_is_refused(dashboard: Dashboard) -> None:
    sees(dashboard, CUP)
    dashboard.get("analysis", HTTPStatus.UNPROCESSABLE_ENTITY, goal="x" * 501)


def test_a_dashboard_that_nobody_asks_loads_no_kinematics() -> None:
    looked = "import sys, vla_deploy.dashboard.app; print('pinocchio' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", looked], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
