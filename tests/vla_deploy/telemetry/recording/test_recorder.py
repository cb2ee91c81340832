"""Record topics that the tests write: what is asked for, in files of bounded size and number."""

import errno
import json
import os
import shutil
from collections import namedtuple
from concurrent.futures import Executor, Future
from typing import Any

import jsonschema_rs
import pytest
from mcap.reader import make_reader

from vla_deploy.ipc import TOPICS
from vla_deploy.telemetry.channels import channels_of
from vla_deploy.telemetry.recording import recorder
from vla_deploy.telemetry.schemas.views import CHANNELS

Usage = namedtuple("Usage", "total used free")


class Stuck(Executor):
    """Take work and never do it, as a disk does that hangs."""

    def __init__(self) -> None:
        self.waiting: list[Future[Any]] = []

    @property
    def taken(self) -> int:
        return len(self.waiting)

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        self.waiting.append(Future())
        return self.waiting[-1]


def test_nothing_is_recorded_unless_it_is_wanted(rig: Any) -> None:
    rig.begin()
    rig.run(1.0)
    assert rig.report()["state"] == "off"
    assert not rig.folder_path.exists()


def test_a_recording_has_every_declared_topic_and_every_message_fits_its_schema(
    rig: Any, read: Any, frame_pixels: bytes
) -> None:
    rig.begin()
    rig.ask(label="all")
    rig.run(0.1)
    rig.space.frame_writer("rgbd").put(
        frame_pixels, width=64, height=48, stamp_ns=rig.clock.now_ns()
    )
    rig.space.record_writer("tick_record").append(b"a tick")
    rig.space.ring_writer("operator").publish({"act": "arm", "source": "test", "reason": ""})
    log = {"stamp_ns": rig.clock.now_ns(), "level": "INFO", "process": "x", "message": "hello"}
    (rig.run_dir / "logs" / "x.log").write_text(json.dumps(log) + "\n")
    rig.run(1.0)
    rig.requests.publish({"act": "stop", "source": "test"})
    rig.run(0.1)
    (path,) = rig.folder.files()
    assert path.name.endswith("-all.mcap")
    declared = {channel.topic for topic in TOPICS for channel in channels_of(topic)}
    validators = {}
    seen = set()
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        names = {channel.topic for channel in summary.channels.values()}
        assert names == declared | {channel.topic for channel in CHANNELS}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if schema.id not in validators:
                validators[schema.id] = jsonschema_rs.validator_for(json.loads(schema.data))
            validators[schema.id].validate(json.loads(message.data))
            seen.add(channel.topic)
    assert seen >= {
        "base_state",
        "control_status",
        "operator",
        "rgbd/colour",
        "rgbd/depth",
        "tick_record",
        "view/log",
        "view/map",
        "view/odometry",
    }


def test_only_the_chosen_topics_are_in_the_file(rig: Any, read: Any) -> None:
    rig.begin()
    rig.ask(topics=["base_*", "rgbd"], without=["*/depth"])
    rig.run(0.5)
    rig.recorder.stop()
    (path,) = rig.folder.files()
    assert {topic for topic, _, _ in read(path)} == {"base_state"}
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        names = {channel.topic for channel in summary.channels.values()}
    assert names == {"base_state", "base_command", "rgbd/colour"}


def test_every_file_begins_with_what_was_so_before(rig: Any, read: Any) -> None:
    rig.begin(file_s=5.0)
    rig.ask()
    rig.run(11.0)
    rig.recorder.stop()
    files = rig.folder.files()
    assert len(files) == 3
    for path in files:
        messages = read(path)
        assert "control_status" in {topic for topic, _, _ in messages}
        assert "view/map" in {topic for topic, _, _ in messages}
        stamps = [stamp for topic, stamp, _ in messages if topic == "base_state"]
        assert max(stamps) - min(stamps) <= 6.1e9
    values = [doc["x_m"] for path in files for topic, _, doc in read(path) if topic == "base_state"]
    assert len(set(values)) == 11 * 25


def test_a_recording_ends_by_itself_and_the_one_by_settings_goes_on(rig: Any) -> None:
    rig.begin(always=True)
    rig.run(1.0)
    assert (rig.report()["state"], rig.report()["label"]) == ("recording", "always")
    rig.ask(label="short", duration_s=2.0)
    rig.run(1.5)
    assert rig.report()["label"] == "short"
    assert 0.0 < rig.report()["left_s"] <= 1.0
    rig.run(2.0)
    assert rig.report()["label"] == "always"
    assert [path.name.rpartition("-")[2] for path in rig.folder.files()] == [
        "always.mcap",
        "short.mcap",
    ]


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        ({"topics": ["no_such_*"]}, "no topic matches 'no_such_*'"),
        ({"topics": "base_state"}, "topics: expected a list"),
        ({"duration_s": -1}, "duration_s: expected seconds, above 0"),
        ({"duration_s": float(2**60)}, "duration_s: expected seconds, above 0"),
        ({"label": "../../etc/passwd"}, "label: expected 1 to 40 of a-z"),
        ({"without": ["*"]}, "leaves nothing"),
        ({"act": "delete"}, "act: expected start or stop"),
    ],
)
def test_a_request_that_cannot_be_is_refused_with_the_reason(
    rig: Any, request_: dict[str, Any], reason: str
) -> None:
    rig.begin()
    rig.ask(**request_)
    rig.run(0.1)
    assert rig.report()["state"] == "off"
    assert reason in rig.report()["refused"]
    assert not rig.folder_path.exists()


def test_a_disk_that_hangs_holds_nobody_up_and_what_is_lost_is_counted(
    rig: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "BACKLOG_BYTES", 2000)
    stuck = Stuck()
    rig.begin(executor=stuck)
    rig.ask(topics=["base_state"])
    rig.run(4.0)
    told = rig.report()
    assert told["state"] == "beginning"
    assert 1000 < told["backlog_bytes"] <= 2000
    assert 50 < told["lost"] <= 100 - stuck.taken
    assert stuck.taken > 10


def test_the_end_of_the_run_finishes_the_file_before_what_still_waits(
    rig: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder, "CLOSE_TIMEOUT_S", 0.0)
    stuck = Stuck()
    rig.begin(executor=stuck)
    rig.ask(topics=["base_state"])
    rig.run(0.5)
    rig.recorder.stop()
    *batches, closing = stuck.waiting
    assert batches
    assert all(batch.cancelled() for batch in batches)
    assert not closing.cancelled()


def test_a_disk_that_refuses_is_told_and_tried_again(
    rig: Any, monkeypatch: pytest.MonkeyPatch, read: Any
) -> None:
    rig.begin()
    rig.ask(topics=["base_state"])
    rig.run(2.0)

    def refuse(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as broken:
        broken.setattr(
            "vla_deploy.telemetry.mcap_file.McapFile.flush", lambda self: refuse(errno.EIO)
        )
        rig.run(3.0)
    told = rig.report()
    assert told["state"] == "failed"
    assert told["why"].endswith("Input/output error")
    assert told["lost"] > 20
    rig.run(12.0)
    assert rig.report()["state"] == "recording"
    rig.recorder.stop()
    assert [len(read(path)) > 20 for path in rig.folder.files()] == [True, True]


def test_the_disk_is_never_filled(rig: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    free = {"bytes": 10**10}
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10**11, 0, free["bytes"]))
    rig.begin(spare_mb=100.0, file_s=5.0)
    rig.ask(topics=["base_state"])
    rig.run(12.0)
    assert len(rig.folder.files()) == 2
    free["bytes"] = 10**7
    rig.run(2.0)
    assert rig.report()["state"] == "paused"
    assert "make room" in rig.report()["why"]
    assert len(rig.folder.files()) == 1  # what was being written; the older ones gave their room
    free["bytes"] = 10**10
    rig.run(12.0)
    assert rig.report()["state"] == "recording"


def test_the_folder_stays_within_its_bounds(rig: Any) -> None:
    rig.begin(file_s=5.0, files=3)
    rig.ask(topics=["base_state"])
    rig.run(22.0)
    assert len(rig.folder.files()) + len(rig.folder.unfinished_files()) == 3
    assert rig.folder.files()[-1].name.startswith("000004-")


def test_a_killed_recorder_leaves_a_file_that_the_next_one_makes_whole(rig: Any, read: Any) -> None:
    rig.begin()
    rig.ask(topics=["base_state", "control_status"])
    rig.run(5.0)
    (part,) = rig.folder.unfinished_files()
    assert rig.folder.files() == []
    rig.begin()  # as after kill -9: nobody finished the file
    rig.ask(topics=["base_state"], label="second")
    rig.run(0.1)
    (whole,) = rig.folder.files()
    messages = read(whole)
    assert len([one for one in messages if one[0] == "base_state"]) >= 4 * 25
    assert not part.exists()
    with whole.open("rb") as file:
        (metadata,) = make_reader(file).iter_metadata()
        assert metadata.metadata["robot"] == "butler"


@pytest.mark.parametrize(
    ("share", "least"), [(0.0, 0), (0.01, 0), (0.3, 0), (0.8, 50), (0.999, 100)]
)
def test_of_a_file_cut_anywhere_all_whole_chunks_are_recovered(
    rig: Any, read: Any, share: float, least: int
) -> None:
    rig.begin()
    rig.ask(topics=["base_state"])
    rig.run(6.0)
    (part,) = rig.folder.unfinished_files()
    data = part.read_bytes()
    part.write_bytes(data[: round(share * len(data))])
    rig.folder.sweep()
    assert rig.folder.unfinished_files() == []
    counts = [len(read(path)) for path in rig.folder.files()]
    assert least <= sum(counts) < 160
    assert 0 not in counts
