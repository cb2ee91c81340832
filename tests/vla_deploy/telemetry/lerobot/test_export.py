"""Commands of a recording become episodes: joints between their samples, images as they were."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vla_deploy.cli.main import main
from vla_deploy.robots import load_robot
from vla_deploy.robots.calibration.lerobot_units import units_of
from vla_deploy.telemetry.errors import DatasetRefused
from vla_deploy.telemetry.lerobot.export import DatasetRequest, export
from vla_deploy.telemetry.lerobot.recorded_episodes import frames_of, spoken_episodes
from vla_deploy.telemetry.recorded_file import RecordedFile

from .conftest import JOINTS, image_of, joints_at, spoken

Recording = Callable[..., RecordedFile]
WORDS = [
    *spoken("c1", "take the block", 3.0, 5.0),
    *spoken("c2", "throw it", 6.0, 7.0, success=False),
    *spoken("c3", "put it down", 8.0, 9.0),
]
STATES = [(k / 25 + 0.003, "joint_state", joints_at(k / 25 + 0.003)) for k in range(300)]
IMAGES = [(k / 4, "rgbd/colour", image_of(5 * k)) for k in range(48)]


def frames(file: RecordedFile, **more: Any) -> Any:
    how = {"joints": JOINTS, "cameras": ["rgbd"], "fps": 10, **more}
    return list(frames_of(file, spoken_episodes(file)[0], **how))


def test_a_command_in_words_is_an_episode(recording: Recording) -> None:
    file = recording([*WORDS, *STATES, *IMAGES])
    assert [one.task for one in spoken_episodes(file)] == ["take the block", "put it down"]
    assert [one.task for one in spoken_episodes(file, with_failed=True)][1] == "throw it"
    found = frames(file)
    assert len(found) == 21
    for k, frame in enumerate(found):
        expected = 0.1 * (3.0 + k / 10) + 0.01 * np.arange(JOINTS)
        np.testing.assert_allclose(frame.state, expected, atol=1e-6)
        np.testing.assert_allclose(frame.action, expected + 0.02, atol=1e-6)
        level = 5 * int(4 * (3.0 + k / 10) + 1e-9)  # the last image before
        assert int(frame.images["rgbd"][20, 40, 0]) == pytest.approx(level, abs=3)
        assert frame.images["rgbd"][20, 5, 0] > 200  # red comes first
        assert frame.images["rgbd"][20, 5, 2] < 60


def test_frames_begin_with_the_first_image(recording: Recording) -> None:
    late = [one for one in IMAGES if one[0] > 4.0]
    assert len(frames(recording([*WORDS, *STATES, *late]))) == 8  # from 4.3 s


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([one for one in STATES if not 3.5 < one[0] < 4.2], "no joint values for 0.72 s from"),
        ([one for one in STATES if one[0] < 4.0], "no joint values for 1.04 s from"),
        ([(at, name, joints_at(at, 7)) for at, name, _ in STATES], "of 7 joints, expected 6 as"),
        ([(at, n, {**d, "position": [None] * 32}) for at, n, d in STATES], "no joint values"),
    ],
)
def test_what_was_not_recorded_is_not_made_up(
    recording: Recording, messages: list[Any], words: str
) -> None:
    with pytest.raises(DatasetRefused, match=words):
        frames(recording([*WORDS, *messages, *IMAGES]))


def test_a_joint_that_is_unknown_for_a_moment_is_bridged(recording: Recording) -> None:
    gone = [
        (at, name, {**document, "position": [None] * 32} if k == 100 else document)
        for k, (at, name, document) in enumerate(STATES)
    ]
    assert len(frames(recording([*WORDS, *gone, *IMAGES]))) == 21


@pytest.mark.parametrize(
    ("others", "request_of", "words"),
    [
        ([], {"task": None}, "no command in words has been carried out"),
        ([{"robot": "butler"}], {}, "recordings of butler, so101: expected those of one robot"),
        ([{"messages": IMAGES}], {}, "recordings with different cameras"),
    ],
)
def test_what_does_not_fit_together_is_refused(
    recording: Recording,
    tmp_path: Path,
    others: list[dict[str, Any]],
    request_of: dict[str, Any],
    words: str,
) -> None:
    files = [recording(STATES)]
    files += [
        recording(
            [*STATES, *other.get("messages", [])], robot=other.get("robot", "so101"), name="b"
        )
        for other in others
    ]
    with pytest.raises(DatasetRefused, match=words):
        export(files, tmp_path / "set", DatasetRequest(fps=10, **{"task": "wave", **request_of}))
    assert not (tmp_path / "set").exists()


@pytest.mark.usefixtures("needs_arrow")
def test_the_command_writes_a_dataset_or_says_why_not(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, folder = recording([*WORDS, *STATES]), str(tmp_path / "set")
    words = ["record", "export", str(file.path), "-o", folder]
    assert main([*words, "--with-failed", "--fps", "20"]) == 0
    assert capsys.readouterr().out == f"{folder}: 3 episodes, 83 frames, no camera\n"
    assert main(words) == 2
    assert f"{folder} exists; name a folder that does not" in capsys.readouterr().err


@pytest.mark.usefixtures("needs_arrow")
def test_a_dataset_has_the_units_of_lerobot(recording: Recording, tmp_path: Path) -> None:
    from vla_deploy.telemetry.lerobot.reader import LeRobotDataset

    files = [recording([*WORDS, *STATES, *IMAGES]), recording([*WORDS, *STATES, *IMAGES], name="b")]
    written = export(files, tmp_path / "set", DatasetRequest(fps=10))
    assert (written.episodes, written.frames, written.cameras) == (4, 2 * (21 + 11), ("rgbd",))
    assert written.tasks == ("take the block", "put it down")
    dataset = LeRobotDataset(tmp_path / "set")
    assert dataset.names[0] == "shoulder_pan.pos"
    joints = units_of(load_robot("so101")).to_joints(dataset.episode(2).actions)
    np.testing.assert_allclose(joints[0], 0.32 + 0.01 * np.arange(JOINTS), atol=1e-6)
