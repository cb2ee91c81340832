"""Run the recorder beside control in lock-step: when it writes, what is in it, what it survives."""

import errno
import json
import logging
from typing import Any as Rig  # the classes in conftest.py, which no test can import
from typing import Any as Stopped

import numpy as np
import pytest

from vla_deploy.telemetry import node as recorder_node
from vla_deploy.telemetry.channels import TICKS, tick_bytes
from vla_deploy.telemetry.errors import FlightUnreadable
from vla_deploy.telemetry.judge import judge_again
from vla_deploy.telemetry.recorded_file import read_flight
from vla_deploy.telemetry.timeline import time_line


def judged(flight):
    return judge_again(tick_bytes(message.text) for message in flight.messages(TICKS))


def table(state: str, restarts: int) -> dict[str, object]:
    row = {"name": "planner", "state": state, "restarts": restarts, "exit_code": -9, "reason": "k"}
    return {"processes": [row]}


def test_a_stop_saves_what_was_before_and_three_seconds_after(stopped: Stopped) -> None:
    flight, stopped_ns = stopped.flight, stopped.stopped_ns
    (cause,) = flight.causes
    assert (cause["kind"], cause["what"]) == ("stop", "estop")
    assert cause["at_ns"] == pytest.approx(stopped_ns, abs=50_000_000)
    assert flight.start_ns < stopped_ns - 4e9
    assert flight.end_ns == pytest.approx(stopped_ns + 3e9, abs=0.2e9)
    assert (flight.robot, flight.profile) == ("butler", "desktop")
    moved = [message.document() for message in flight.messages("base_state")]
    assert max(one["v_m_s"] for one in moved) > 0.15
    assert abs(moved[-1]["v_m_s"]) < 0.01


def test_stamps_are_wall_clock_by_one_offset(stopped: Stopped) -> None:
    flight = stopped.flight
    assert flight.wall_offset_ns == pytest.approx(1_800_000_000_000_000_000, abs=1)
    stamps = [message.stamp_ns for message in flight.messages("control_status")]
    assert stamps == sorted(stamps)
    assert 0 < stamps[0] < stopped.now_ns


def test_every_tick_is_there_and_judged_to_the_same_verdict(stopped: Stopped) -> None:
    judgement = judged(stopped.flight)
    assert judgement.difference is None
    assert judgement.unread == 0
    assert judgement.ticks > stopped.ticks_before + 1000


def test_ticks_outlive_a_control_that_is_killed(rig: Rig) -> None:
    rig.process_table.put_document(table("ready", 0))
    rig.drive(1.0)
    last = rig.status()["tick"]
    rig.lockstep.kill(rig.control)
    rig.process_table.put_document(table("back-off", 0))
    flight = rig.wait_for_flight()
    assert flight.causes[0]["kind"] == "crash"
    ticks = [message.document()["tick"] for message in flight.messages(TICKS)]
    assert ticks == list(range(1, len(ticks) + 1))
    assert ticks[-1] >= last
    assert judged(flight).difference is None


def test_a_new_control_goes_on_in_the_same_record(rig: Rig) -> None:
    rig.lockstep.kill(rig.control)
    rig.restart_control()
    rig.run(1.0)
    rig.requests.publish({"source": "test", "reason": ""})
    judgement = judged(rig.wait_for_flight())
    assert judgement.difference is None
    assert judgement.unread == 0


def test_a_recorder_that_is_killed_leaves_no_half_flight_and_its_successor_has_the_ticks(
    rig: Rig,
) -> None:
    rig.drive(1.0)
    rig.operate("estop")
    rig.run(3.1)  # it has begun to write
    rig.lockstep.kill(rig.recorder)
    assert rig.flights() == []
    assert len(list(rig.folder.path.iterdir())) == 1
    rig.new_recorder()
    rig.run(0.1)
    rig.requests.publish({"source": "test", "reason": "again"})
    flight = rig.wait_for_flight()
    assert len(list(rig.folder.path.iterdir())) == 1
    assert "GROUP_STOP for estop" in {line["text"] for line in time_line(flight)}


def test_a_storm_of_stops_gives_few_files(rig: Rig) -> None:
    for _ in range(15):
        rig.operate("estop")
        rig.run(0.4)
        rig.operate("reset")
        rig.run(0.4)
    rig.run(21.0)
    flights = rig.flights()
    assert len(flights) == 2
    assert sum(len(flight.causes) for flight in flights) == 15


def test_the_end_of_the_run_writes_what_waits(rig: Rig) -> None:
    rig.operate("estop")
    rig.run(0.5)
    assert rig.flights() == []
    rig.lockstep.remove(rig.recorder)
    assert [cause["what"] for cause in rig.flights()[0].causes] == ["estop"]


def test_a_full_disk_is_told_in_one_line_and_costs_nothing_else(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as broken, caplog.at_level(logging.ERROR):
        broken.setattr("mcap.writer.Writer.finish", full)
        rig.operate("estop")
        rig.run(6.0)
    (line,) = [record.getMessage() for record in caplog.records]
    assert line.endswith("No space left on device; make room on that disk")
    assert list(rig.folder.path.iterdir()) == []
    assert [event.payload["event"] for event in rig.events.drain()] == ["failed"]
    rig.requests.publish({"source": "test", "reason": ""})
    assert rig.wait_for_flight()


def test_images_are_kept_compressed_and_seldom(rig: Rig) -> None:
    frames = rig.space.frame_writer("rgbd")
    pixels = np.random.default_rng(0).integers(0, 255, 64 * 48 * 3, dtype=np.uint8).tobytes()
    for _ in range(50):
        now_ns = rig.lockstep.clock.now_ns()
        frames.put(pixels + bytes(64 * 48 * 2), width=64, height=48, stamp_ns=now_ns)
        rig.run(0.2)
    rig.requests.publish({"source": "test", "reason": ""})
    flight = rig.wait_for_flight()
    assert 4 <= flight.counts["rgbd/colour"] == flight.counts["rgbd/depth"] <= 6
    shown = next(flight.messages("rgbd/depth")).document()
    assert shown["format"] == "png"
    assert shown["data"].startswith("iVBOR")


def test_a_cut_flight_is_refused_with_its_name(rig: Rig) -> None:
    rig.requests.publish({"source": "test", "reason": ""})
    path = rig.wait_for_flight().path
    data = path.read_bytes()
    for size in (0, 7, 100, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:size])
        with pytest.raises(FlightUnreadable, match=path.name):
            read_flight(path)


def test_a_flight_is_written_a_few_messages_per_step(rig: Rig) -> None:
    rig.drive(2.0)
    rig.requests.publish({"source": "test", "reason": ""})
    flight = rig.wait_for_flight()
    steps = sum(flight.counts.values()) / recorder_node.MESSAGES_AT_ONCE
    assert steps > 5
    (event,) = rig.events.drain()
    written_s = (event.stamp_ns - flight.causes[0]["at_ns"]) / 1e9
    assert written_s == pytest.approx(steps * rig.recorder.period_s, abs=0.2)


def test_the_time_line_tells_who_did_what(rig: Rig) -> None:
    rig.process_table.put_document(table("ready", 0))
    rig.run(0.2)
    rig.operate("estop")
    rig.process_table.put_document(table("back-off", 0))
    lines = [(line["who"], line["text"]) for line in time_line(rig.wait_for_flight())]
    for expected in (
        ("operator", "estop by test"),
        ("judge", "GROUP_STOP for estop"),
        ("supervisor", "planner: back-off (k)"),
        ("recorder", "crash: planner (k)"),
    ):
        assert expected in lines
    assert json.dumps(lines)
