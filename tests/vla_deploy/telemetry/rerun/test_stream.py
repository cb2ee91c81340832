"""Write files with Rerun's own library, and read them back with it; needs the extra [rerun]."""

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.telemetry.errors import ExtraMissing
from vla_deploy.telemetry.recorded_file import read_file
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.rerun.conversion import convert
from vla_deploy.telemetry.rerun.entity_logger import EntityLogger
from vla_deploy.telemetry.rerun.stream import RerunStream

pytest.importorskip("rerun", reason="the extra [rerun] is not installed")

FLIGHT = Path(__file__).parents[1] / "flights" / "estop_while_driving.mcap"


def written(file: Path, path: Path) -> EntityLogger:
    stream = RerunStream(file.stem)
    stream.save(path)
    logger = EntityLogger(stream)
    convert(read_file(file), logger, ChannelSelection())
    stream.flush()
    stream.close()
    return logger


def chunks(path: Path) -> list[Any]:
    """Return what a file holds, but for what Rerun says of the file itself."""
    from rerun.chunk import RrdReader

    return [one for one in RrdReader(path).stream() if not one.entity_path.startswith("/__")]


@pytest.mark.parametrize("kind", ["flight", "recording"])
def test_a_file_of_ours_becomes_one_of_reruns(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    file = FLIGHT if kind == "flight" else request.getfixturevalue("recording")
    logger = written(file, tmp_path / "out.rrd")
    assert not logger.unfit
    read: Counter[str] = Counter()
    for chunk in chunks(tmp_path / "out.rrd"):
        read[chunk.entity_path.removeprefix("/")] += chunk.num_rows
    assert read == logger.shown
    assert {"world/map", "plots/joint_state/effort_ratio"} < read.keys()


def test_there_are_two_timelines_and_no_third(tmp_path: Path) -> None:
    written(FLIGHT, tmp_path / "out.rrd")
    timelines = {one.entity_path: set(one.timeline_names) for one in chunks(tmp_path / "out.rrd")}
    assert timelines["/plots/tick_record/sent_v_m_s"] == {"robot_time", "tick"}
    assert timelines["/plots/base_state/x_m"] == {"robot_time"}
    assert set().union(*timelines.values()) == {"robot_time", "tick"}


def test_what_the_library_refuses_is_counted(tmp_path: Path) -> None:
    stream = RerunStream("odd")
    stream.save(tmp_path / "out.rrd")
    logger = EntityLogger(stream)
    text = b'{"frame_id": "camera", "K": [1, 0, 0, 0, 1, 0, 0, 0, 1], "width": "wide", "height": 1}'
    logger.add("view/lens", 1, text)
    logger.add("base_command", 2**70, b'{"v_m_s": 0.0}')
    stream.close()
    assert logger.unfit == {"view/lens": 1, "base_command": 1}


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(ExtraMissing, match=r"missing/out\.rrd: .*No such file"):
        RerunStream("x").save(tmp_path / "missing" / "out.rrd")


def test_an_address_that_is_none_is_told_with_one_that_is() -> None:
    with pytest.raises(ExtraMissing, match=r"robot:9876: .*such as rerun\+http://127.0.0.1:9876"):
        RerunStream("x").connect("robot:9876")
