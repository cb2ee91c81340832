"""Turn a flight of the twin and a recording into entities, looked at as plain data."""

from collections import Counter
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.telemetry.recording.selection import Selection
from vla_deploy.telemetry.replay.source import Source
from vla_deploy.telemetry.rerun.conversion import convert
from vla_deploy.telemetry.rerun.showing import Showing

FLIGHTS = Path(__file__).parents[1] / "flights"
EVERYTHING = Selection()


def converted(source: Source, taken: Any, selection: Selection = EVERYTHING) -> Showing:
    showing = Showing(taken)
    with closing(source):
        messages = convert(source, showing, selection)
    assert messages == sum(source.summary.counts.values())
    return showing


@pytest.mark.parametrize("name", ["estop_while_driving", "servo_bus_unplugged", "wheel_blocked"])
def test_a_flight_is_plotted_whole_and_its_views_are_drawn(name: str, taken: Any) -> None:
    source = Source(FLIGHTS / f"{name}.mcap")
    counts = source.summary.counts
    showing = converted(source, taken)
    assert not showing.unfit
    assert showing.shown["plots/tick_record/sent_v_m_s"] == counts["tick_record"]
    assert showing.shown["plots/base_state/x_m"] == counts["base_state"]
    assert showing.shown["plots/control_status/period_s"] == counts["control_status"]
    assert showing.shown["logs/events/operator"] == counts["operator"]
    assert showing.shown["world/map"] == showing.shown["world/zones/outlines"] == 1
    assert showing.shown["world/base/left_elbow"] > 5


def test_ticks_follow_each_other_on_a_timeline_of_their_own(taken: Any) -> None:
    converted(Source(FLIGHTS / "wheel_blocked.mcap"), taken)
    path = "plots/tick_record/period_s"
    told = [(tick, one) for _, tick, one in taken.entities if one.path == path]
    ticks = [tick for tick, _ in told]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    assert {round(one.values["scalars"][0], 6) for _, one in told} == {0.004}
    assert all(tick is None for _, tick, one in taken.entities if "joint_state" in one.path)


def test_what_is_older_than_the_file_is_shown_from_its_beginning(taken: Any) -> None:
    source = Source(FLIGHTS / "estop_while_driving.mcap")
    source.began_ns = source.summary.ended_ns - 10**8
    converted(source, taken)
    moments = {stamp_ns for stamp_ns, _, _ in taken.entities}
    assert min(moments) == source.began_ns
    assert max(moments) == source.summary.ended_ns


def test_a_flight_of_a_robot_that_is_not_known_here_is_plotted(taken: Any) -> None:
    source = Source(FLIGHTS / "estop_while_driving.mcap")
    source.summary = replace(source.summary, robot="somebody_elses")
    showing = converted(source, taken)
    assert showing.shown["plots/joint_state/position"] == source.summary.counts["joint_state"]
    assert not [path for path in showing.shown if path.startswith("world/")]


def test_a_recording_shows_the_views_that_it_holds_and_draws_none_anew(
    recording: Path, taken: Any
) -> None:
    source = Source(recording)
    counts = source.summary.counts
    showing = converted(source, taken)
    assert not showing.unfit
    assert showing.shown["world/base/camera/colour"] == counts["rgbd/colour"] > 2
    assert showing.shown["world/base/camera/depth"] == counts["rgbd/depth"]
    assert showing.shown["world/base/scan"] == counts["view/scan"]
    assert showing.shown["world/scene/boxes"] == counts["view/scene"]
    assert showing.shown["world/pose"] == counts["view/pose"]
    assert showing.shown["logs/planner"] == counts["view/log"] > 2
    assert showing.shown["logs/events/task_event"] == counts["task_event"]
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
    showing = converted(Source(tmp_path / "few.mcap"), taken, Selection(without=("view/joints",)))
    assert showing.shown["world/pose"] > 2
    assert showing.shown["world/base"] > 2
    assert not taken.of("plots/tick_record/sent")


def test_a_value_that_no_view_can_be_drawn_of_is_counted(
    taken: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = Source(FLIGHTS / "estop_while_driving.mcap")
    broken = [
        replace(one, text=b'{"range_m": ["far"]}') if one.channel == "scan" else one
        for one in source.from_moment(0)
    ]
    monkeypatch.setattr(source, "from_moment", lambda _: iter(broken))
    showing = converted(source, taken)
    assert showing.unfit.keys() == {"views of scan"}
    assert "world/base/scan" not in showing.shown
