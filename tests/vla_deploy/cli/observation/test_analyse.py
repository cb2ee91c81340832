import argparse
import json

import numpy as np
import pytest

from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.observation.analyse import analyser_for, as_text, ask
from vla_deploy.client.place_state import PlaceState

CUP = {
    "id": "cup_1",
    "class": "cup",
    "colour": "red",
    "position_m": [2.2, 1.6, 0.5],
    "size_m": [0.07, 0.07, 0.1],
    "yaw_rad": 0.0,
    "confidence": 0.9,
}


@pytest.fixture
def seen(robot, clock):
    """The robot tells a cup on the coffee table, its pose, its hands and an image."""
    scene = {"stamp_ns": clock.now_ns(), "objects": [CUP | {"last_seen_ns": clock.now_ns()}]}
    robot.space.cell_writer("scene").put_document(scene)
    robot.space.cell_writer("process_table").put_document({"robot": "butler", "processes": []})
    place = {"x_m": 2.2, "y_m": 2.05, "yaw_rad": -1.5708, "state": PlaceState.TRACKING}
    robot.space.cell_writer("pose").put(**place, match_ratio=1.0, covariance=np.zeros(9), doubt=0)
    robot.executes(None)
    image = np.zeros((4, 6, 3), np.uint8)
    image[0, 0] = (250, 1, 2)
    payload = image.tobytes() + bytes(2 * 4 * 6)
    robot.space.frame_writer("rgbd").put(payload, width=6, height=4, stamp_ns=clock.now_ns())


def arguments(**changes) -> argparse.Namespace:
    return argparse.Namespace(**{"server": None, "within": 1.0, "runtime_base": None} | changes)


def test_the_running_robot_s_scene_is_analysed(session, seen):
    question = ask(session, "pick up the red cup")
    assert question.image is not None
    assert question.image[0, 0].tolist() == [250, 1, 2]
    analysis = analyser_for(session, arguments()).analyse(question)
    assert [one.id for one in analysis.objects] == ["cup_1"]
    text = as_text(analysis)
    assert "cup_1          small red cup, centre near, can be taken, 90 % sure (geometry)" in text
    assert '"pick up the red cup": yes, 90 % sure' in text


def test_a_server_that_is_not_there_leaves_the_measured_analysis(session, seen, tmp_path):
    folder = tmp_path / "base-config"
    folder.mkdir()
    (folder / "servers.toml").write_text(
        '[servers.gone]\napi = "ollama"\nurl = "http://127.0.0.1:1"\nmodel = "llava"\n'
        'location = "local"\nmax_attempts = 1\n'
    )
    chosen = arguments(server="gone", runtime_base=tmp_path / "base")
    analysis = analyser_for(session, chosen).analyse(ask(session, ""))
    assert json.loads(analysis.model_dump_json())["analyser"] == "geometric"
    assert "note: measured only, server gone gave nothing" in as_text(analysis)


def test_a_robot_that_is_silent_is_told(session, robot):
    with pytest.raises(UsageError, match="perception tells no scene"):
        ask(session, "")
    with pytest.raises(UsageError, match="which robot this is"):
        analyser_for(session, arguments())
