"""Turn a flight of the twin and a recording into entities, looked at as plain data."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.telemetry.recorded_file import RecordedFile, RecordedMessage, read_file
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.rerun.conversion import convert
from vla_deploy.telemetry.rerun.entity_logger import EntityLogger

FLIGHTS = Path(__file__).parents[1] / "flights"
EVERYTHING = ChannelSelection()


def converted(
    file: RecordedFile, taken: Any, selection: ChannelSelection = EVERYTHING
) -> EntityLogger:
    logger = EntityLogger(taken)
    messages = convert(file, logger, selection)
    assert messages == sum(file.counts.values())
    return logger


@pytest.mark.parametrize("name", ["estop_while_driving", "servo_bus_unplugged", "wheel_blocked"])
def test_a_flight_is_plotted_whole_and_its_views_are_drawn(name: str, taken: Any) -> None:
    file = read_file(FLIGHTS / f"{name}.mcap")
    counts = file.counts
    logger = converted(file, taken)
    assert not logger.unfit
    assert logger.shown["plots/tick_record/sent_v_m_s"] == counts["tick_record"]
    assert logger.shown["plots/base_state/x_m"] == counts["base_state"]
    assert logger.shown["plots/control_status/period_s"] == counts["control_status"]
    assert logger.shown["logs/events/operator"] == counts["operator"]
    assert logger.shown["world/map"] == logger.shown["world/zones/outlines"] == 1
    assert logger.shown["world/base/left_elbow"] > 5


def test_ticks_follow_each_other_on_a_timeline_of_their_own(taken: Any) -> None:
    converted(read_file(FLIGHTS / "wheel_blocked.mcap"), taken)
    path = "plots/tick_record/period_s"
    told = [(tick, one) for _, tick, one in taken.entities if one.path == path]
    ticks = [tick for tick, _ in told]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    assert {round(one.values["scalars"][0], 6) for _, one in told} == {0.004}
    assert all(tick is None for _, tick, one in taken.entities if "joint_state" in one.path)


def test_what_is_older_than_the_file_is_shown_from_its_beginning(taken: Any) -> None:
    whole = read_file(FLIGHTS / "estop_while_driving.mcap")
    file = replace(whole, began_ns=whole.ended_ns - 10**8)
    converted(file, taken)
    moments = {stamp_ns for stamp_ns, _, _ in taken.entities}
    assert min(moments) == file.began_ns
    assert max(moments) == file.ended_ns


def test_a_flight_of_a_robot_that_is_not_known_here_is_plotted(taken: Any) -> None:
    file = replace(read_file(FLIGHTS / "estop_while_driving.mcap"), robot="somebody_elses")
    logger = converted(file, taken)
    assert logger.shown["plots/joint_state/position"] == file.counts["joint_state"]
    assert not [path for path in logger.shown if path.startswith("world/")]


def test_a_recording_shows_the_views_that_it_holds_and_draws_none_anew(
    recording: Path, taken: Any
) -> None:
    file = read_file(recording)
    counts = file.counts
    logger = converted(file, taken)
    assert not logger.unfit
    assert logger.shown["world/base/camera/colour"] == counts["rgbd/colour"] > 2
    assert logger.shown["world/base/camera/depth"] == counts["rgbd/depth"]
    assert logger.shown["world/base/scan"] == counts["view/scan"]
    assert logger.shown["world/scene/boxes"] == counts["view/scene"]
    assert logger.shown["world/pose"] == counts["view/pose"]
    assert logger.shown["logs/planner"] == counts["view/log"] > 2
    assert logger.shown["logs/events/task_event"] == counts["task_event"]
    temperatures = taken.of("plots/control_status/joints/temperature_c")
    archetypes = Counter(one.archetype for one in temperatures)
    assert archetypes == {"SeriesLines": 1, "Scalars": counts["control_status"]}
    (box,) = {str(one.values["labels"]) for one in taken.of("world/scene/boxes")}
    assert box == "['object/cup_1']"


def test_views_that_were_not_recorded_are_drawn_and_nothing_is_that_is_not_wanted(
    run: Any, taken: Any, tmp_path: Path
) -> None:
    run.clock.each = run.write
    run.record(tmp_path / "few.mcap", topics=("pose", "joint_state"))
    logger = converted(
        read_file(tmp_path / "few.mcap"), taken, ChannelSelection(without=("view/joints",))
    )
    assert logger.shown["world/pose"] > 2
    assert logger.shown["world/base"] > 2
    assert not taken.of("plots/tick_record/sent")


def test_a_value_that_no_view_can_be_drawn_of_is_counted(
    taken: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = read_file(FLIGHTS / "estop_while_driving.mcap")
    broken = [
        replace(one, text=b'{"range_m": ["far"]}') if one.channel == "scan" else one
        for one in file.messages_from(0)
    ]

    def messages_from(_: RecordedFile, __: int) -> Iterator[RecordedMessage]:
        return iter(broken)

    monkeypatch.setattr(RecordedFile, "messages_from", messages_from)
    logger = converted(file, taken)
    assert logger.unfit.keys() == {"views of scan"}
    assert "world/base/scan" not in logger.shown
