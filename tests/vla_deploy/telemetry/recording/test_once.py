"""Record into one file of one's own, with no recorder running."""

from pathlib import Path
from typing import Any

import pytest

from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.recorded_file import read_file
from vla_deploy.telemetry.recording.once import OneRecording
from vla_deploy.telemetry.recording.request import RecordingRequest


def one(rig: Any, path: Path, **wish: Any) -> OneRecording:
    return OneRecording(
        rig.context,
        RecordingRequest(**wish),
        path,
        image_period_s=0.5,
        wall_ns=rig.clock.wall_ns,
    )


def test_a_file_of_its_own_has_what_was_and_what_came(rig: Any, read: Any, tmp_path: Path) -> None:
    path = tmp_path / "mine.mcap"
    begun = one(rig, path, duration_s=2.0, topics=("control_status", "operator", "view/zones"))
    rig.space.ring_writer("operator").publish({"act": "arm", "source": "test", "reason": ""})
    messages = begun.run(lambda: False)
    assert [topic for topic, _, _ in read(path)] == ["view/zones", "control_status", "operator"]
    found = read_file(path)
    assert (found.kind, found.robot, sum(found.counts.values())) == ("recording", "butler", 3)
    assert messages == 3
    assert [one.name for one in tmp_path.iterdir() if one.is_file()] == ["mine.mcap"]


def test_it_ends_when_it_is_told_to(rig: Any, tmp_path: Path) -> None:
    begun = one(rig, tmp_path / "mine.mcap")
    end_ns = rig.clock.now_ns() + 3 * 10**9
    begun.run(lambda: rig.clock.now_ns() >= end_ns)
    assert rig.clock.now_ns() == pytest.approx(end_ns, abs=10**8)


def test_a_file_that_cannot_be_written_is_refused_with_its_name(rig: Any, tmp_path: Path) -> None:
    with pytest.raises(RecordingRefused, match=r"missing/mine\.mcap: No such file"):
        one(rig, tmp_path / "missing" / "mine.mcap")
