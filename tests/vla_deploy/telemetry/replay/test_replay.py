"""Replay flights of the twin and recordings: the topics of a run come alive, and nothing else."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import ReplayOnly, SharedSpace
from vla_deploy.ipc.rgbd_image import colours, depths_mm
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.errors import FlightUnreadable, ReplayRefused
from vla_deploy.telemetry.recorded_file import RecordedMessage, read_file
from vla_deploy.telemetry.recording.once import OneRecording
from vla_deploy.telemetry.recording.request import RecordingRequest
from vla_deploy.telemetry.replay.feeder import TopicFeeder, shifted
from vla_deploy.telemetry.replay.node import PlaybackPosition, ReplayNode
from vla_deploy.telemetry.robot_state import collect

FLIGHT = Path(__file__).parents[1] / "flights" / "estop_while_driving.mcap"


class Shown:
    """Hold a replay and a reader of its topics."""

    def __init__(self, run_dir: Path, file: Path, clock: Any, **options: Any) -> None:
        self.clock = clock
        run_dir.mkdir(parents=True, exist_ok=True)
        self.node = ReplayNode(run_dir, read_file(file), self.clock, **options)
        self.link = RobotLink(run_dir, self.clock)
        self.node.start()
        self.requests = self.link.space.ring_writer("replay_request")

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            self.clock.time_ns += 20_000_000
            self.node.step()

    def status(self) -> Any:
        self.run(0.3)
        return self.link.document("replay_status")

    def close(self) -> None:
        self.node.stop()
        self.link.close()


@pytest.fixture
def shown(tmp_path: Path, clock: Any) -> Iterator[Shown]:
    shown = Shown(tmp_path / "run", FLIGHT, clock)
    yield shown
    shown.close()


def test_a_flight_drives_what_the_dashboard_shows(shown: Shown) -> None:
    causes = set()
    for _ in range(100):
        shown.run(0.5)
        state = collect(shown.link)
        if state["control"] is not None:
            causes.add(state["control"]["cause"])
        if state["replay"]["state"] == "ended":
            break
    assert "estop" in causes
    assert state["replay"]["file"] == FLIGHT.name
    assert state["replay"]["unfit"] == 0
    moved = shown.link.fresh("joint_state")
    assert moved is not None
    assert int(moved.data["joint_count"]) == 16


def test_nobody_can_ask_anything_of_a_replay(shown: Shown) -> None:
    for act in (
        lambda: shown.link.operate("arm"),
        lambda: shown.link.operate("estop"),
        lambda: shown.link.utter(text="go to the kitchen"),
        lambda: shown.link.space.cell_writer("base_command"),
        lambda: shown.link.space.shared_document("claims"),
        lambda: shown.link.writer("profile_request").publish({}),
        lambda: shown.link.writer("recording_request").publish({}),
    ):
        with pytest.raises(ReplayOnly, match="this is a replay of estop_while_driving"):
            act()
    shown.link.space.cell_writer("dashboard_status").put_document({"url": "x"})


def test_what_stands_still_stays_fresh(shown: Shown) -> None:
    shown.run(0.2)
    shown.requests.publish({"act": "pause"})
    shown.run(20.0)
    for topic in ("control_status", "joint_state"):
        assert shown.link.fresh(topic, 0.5) is not None, topic
    shown.requests.publish({"act": "resume"})
    shown.run(20.0)
    assert shown.status()["state"] == "ended"
    assert shown.link.fresh("control_status", 0.5) is not None


def test_what_was_late_where_the_file_stands_is_not_made_young(tmp_path: Path, clock: Any) -> None:
    space = SharedSpace(tmp_path / "ipc", clock, is_replay=True)
    feeder, cell = TopicFeeder(space, tmp_path / "logs", clock), space.cell_reader("pose")
    fields = {"stamp_ns": 1, "x_m": 2.0}
    feeder.feed(
        RecordedMessage(
            channel="pose", at_ns=0, stamp_ns=0, sequence=1, text=json.dumps(fields).encode()
        )
    )
    for at_s, is_fresh in ((0.1, True), (5.0, False)):
        clock.time_ns += 2 * NS_PER_S
        feeder.hold(round(at_s * NS_PER_S))
        sample = cell.latest()
        assert sample is not None
        assert (sample.age_s(clock.now_ns()) < 1.0) is is_fresh
    space.close()


def test_what_was_so_before_is_shown_from_any_moment_on(shown: Shown) -> None:
    shown.run(0.2)
    shown.requests.publish({"act": "pause"})
    shown.run(0.1)
    before = shown.link.document("control_status")
    shown.requests.publish({"act": "seek", "value": shown.node.document(0)["duration_s"]})
    shown.run(0.1)
    after = shown.link.document("control_status")
    assert before is not None
    assert after is not None
    assert after["tick"] > before["tick"]
    shown.requests.publish({"act": "seek", "value": 0.2})
    shown.run(0.1)
    again = shown.link.document("control_status")
    assert again is not None
    assert again["tick"] <= before["tick"]


def test_a_replay_pauses_goes_on_and_changes_its_speed(shown: Shown) -> None:
    first = shown.status()["position_s"]
    shown.requests.publish({"act": "pause"})
    paused = shown.status()
    shown.run(2.0)
    assert paused["state"] == shown.status()["state"] == "paused"
    assert shown.status()["position_s"] == paused["position_s"] >= first
    shown.requests.publish({"act": "speed", "value": 0.5})
    shown.requests.publish({"act": "resume"})
    shown.run(0.5)
    assert shown.status()["position_s"] == pytest.approx(paused["position_s"] + 0.4, abs=0.15)


def test_a_replay_begins_again_at_its_end_where_that_is_wanted(tmp_path: Path, clock: Any) -> None:
    shown = Shown(tmp_path / "run", FLIGHT, clock, loop=True)
    length_s = shown.status()["duration_s"]
    shown.requests.publish({"act": "seek", "value": length_s - 0.2})
    shown.run(1.0)
    assert shown.status()["position_s"] < 2.0
    assert shown.status()["state"] == "playing"
    shown.close()


@pytest.mark.parametrize(
    "request_",
    [
        {"act": "jump"},
        {"act": "speed", "value": 0},
        {"act": "speed", "value": 1e9},
        {"act": "seek", "value": -1},
        {"act": "seek", "value": 1e9},
        {"act": "seek", "value": "end"},
        {"act": None},
        {},
    ],
)
def test_what_a_replay_cannot_do_is_refused_and_it_goes_on(
    shown: Shown, request_: dict[str, Any]
) -> None:
    shown.requests.publish(request_)
    told = shown.status()
    assert told["refused"]
    assert told["state"] == "playing"


def test_images_logs_and_events_come_back_as_they_were(
    tmp_path: Path, context: NodeContext, clock: Any
) -> None:
    """Record a run that this test plays, then replay the file."""
    space = SharedSpace(context.run_dir / "ipc", clock)
    one = OneRecording(
        context,
        RecordingRequest(duration_s=2.0),
        tmp_path / "x.mcap",
        image_period_s=0.1,
        wall_ns=clock.wall_ns,
    )
    pixels = np.zeros((48, 64, 3), np.uint8)
    cv2.circle(pixels, (30, 20), 10, (250, 10, 10), -1)
    depths = np.full((48, 64), 1234, np.uint16)
    frames, ring, scene = (
        space.frame_writer("rgbd"),
        space.ring_writer("task_event"),
        space.cell_writer("scene"),
    )

    def once() -> None:
        clock.each = lambda: None
        now_ns = clock.now_ns()
        frames.put(pixels.tobytes() + depths.tobytes(), width=64, height=48, stamp_ns=now_ns)
        ring.publish({"command_id": "c-1", "event": "said", "text": "hello"})
        scene.put_document({"stamp_ns": now_ns, "objects": [], "surfaces": [], "bystanders": []})
        line = {"stamp_ns": now_ns, "level": "WARNING", "process": "planner", "message": "slow"}
        (context.run_dir / "logs" / "planner.log").write_text(json.dumps(line) + "\n")

    clock.each = once
    one.run(lambda: False)
    space.close()
    shown = Shown(tmp_path / "run", tmp_path / "x.mcap", clock)
    events = shown.link.events("task_event", from_start=True)
    shown.run(3.0)
    frame = shown.link.frame("rgbd", 10.0)
    assert frame is not None
    assert (depths_mm(frame) == depths).all()
    assert np.abs(colours(frame).astype(int) - pixels).mean() < 5
    assert [event.payload["text"] for event in events.drain()] == ["hello"]
    document = shown.link.document("scene")
    assert document is not None
    sample = shown.link.fresh("scene")
    assert sample is not None
    assert document["stamp_ns"] == pytest.approx(sample.stamp_ns, abs=1e8)
    (line,) = (tmp_path / "run" / "logs" / "planner.log").read_text().splitlines()
    assert json.loads(line)["message"] == "slow"
    assert shown.status()["unfit"] == 0
    shown.close()


def test_only_stamps_are_moved_into_this_runs_clock() -> None:
    document = {"stamp_ns": 5, "never_ns": 0, "x": 7, "deep": [{"seen_ns": 6, "tick": 1}]}
    assert shifted(document, 100) == {
        "stamp_ns": 105,
        "never_ns": 0,
        "x": 7,
        "deep": [{"seen_ns": 106, "tick": 1}],
    }


def test_a_pace_goes_on_from_where_it_was_changed() -> None:
    pace = PlaybackPosition(1000 * NS_PER_S, 1100 * NS_PER_S, 0)
    pace.set_speed(10 * NS_PER_S, 4.0)
    assert pace.position_ns(15 * NS_PER_S) == 1030 * NS_PER_S
    pace.pause(15 * NS_PER_S, paused=True)
    assert pace.position_ns(99 * NS_PER_S) == 1030 * NS_PER_S
    pace.pause(99 * NS_PER_S, paused=False)
    assert pace.position_ns(1000 * NS_PER_S) == 1100 * NS_PER_S
    with pytest.raises(ReplayRefused, match=r"expected 0 to 100\.0 s"):
        pace.seek(0, 100.5)


def test_what_is_no_recording_of_ours_is_refused_with_its_name(tmp_path: Path) -> None:
    for data in (b"", b"no mcap", FLIGHT.read_bytes()[:5000]):
        path = tmp_path / "x.mcap"
        path.write_bytes(data)
        with pytest.raises(FlightUnreadable, match=r"x\.mcap: no whole recording"):
            read_file(path)
