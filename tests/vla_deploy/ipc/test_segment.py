import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest

from vla_deploy.ipc import (
    TOPICS,
    PackedField,
    SchemaMismatch,
    SharedSpace,
    SpaceUnavailable,
    TopicKind,
    UnknownTopic,
)
from vla_deploy.ipc.memory.layout import is_document, layout_of, record_dtype
from vla_deploy.ipc.topics import BY_NAME

PLACE = BY_NAME["pose"]


def test_another_layout_of_a_topic_is_refused_with_what_to_do(tmp_path, clock):
    SharedSpace(tmp_path, clock, [PLACE]).cell_writer("pose")
    newer = dataclasses.replace(PLACE, fields=(*PLACE.fields, PackedField("z_m", "f8")))
    with pytest.raises(SchemaMismatch, match=r"pose\.cell: topic pose .*stop every process"):
        SharedSpace(tmp_path, clock, [newer]).cell_reader("pose")


def test_a_renamed_field_is_another_layout(tmp_path, clock):
    SharedSpace(tmp_path, clock, [PLACE]).cell_writer("pose")
    first, *rest = PLACE.fields
    renamed = dataclasses.replace(PLACE, fields=(dataclasses.replace(first, name="left_m"), *rest))
    with pytest.raises(SchemaMismatch):
        SharedSpace(tmp_path, clock, [renamed]).cell_writer("pose")


def test_a_file_cut_short_is_refused(tmp_path, clock):
    SharedSpace(tmp_path, clock).cell_writer("pose")
    os.truncate(tmp_path / "pose.cell", 200)
    with pytest.raises(SchemaMismatch):
        SharedSpace(tmp_path, clock).cell_reader("pose")


def test_a_creator_killed_before_the_header_leaves_no_harm(tmp_path, clock):
    (tmp_path / "pose.cell").write_bytes(bytes(1000))
    space = SharedSpace(tmp_path, clock)
    writer = space.cell_writer("pose")
    writer.put(x_m=1, y_m=2, yaw_rad=3, match_ratio=1, covariance=(0,) * 9, state=0, doubt=0)
    assert space.cell_reader("pose").latest().data["y_m"] == 2


def test_a_file_of_an_earlier_boot_begins_anew(tmp_path, clock):
    space = SharedSpace(tmp_path, clock)
    writer = space.cell_writer("pose")
    writer.put(x_m=1, y_m=2, yaw_rad=3, match_ratio=1, covariance=(0,) * 9, state=0, doubt=0)
    writer.close()
    path = tmp_path / "pose.cell"
    data = bytearray(path.read_bytes())
    data[24:60] = b"00000000-0000-0000-0000-000000000000"
    path.write_bytes(data)
    assert space.cell_reader("pose").latest() is None


def test_a_directory_that_cannot_be_made_is_named(tmp_path, clock):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(SpaceUnavailable, match="file/ipc: cannot make it"):
        SharedSpace(tmp_path / "file" / "ipc", clock)


def test_a_link_in_the_place_of_a_topic_is_not_followed(tmp_path, clock):
    precious = tmp_path / "precious"
    precious.write_text("precious")
    space = tmp_path / "ipc"
    space.mkdir()
    (space / "pose.cell").symlink_to(precious)
    with pytest.raises(SpaceUnavailable, match=r"pose\.cell: cannot open shared memory"):
        SharedSpace(space, clock).cell_writer("pose")
    assert precious.read_text() == "precious"


def test_a_file_that_cannot_be_opened_is_named(tmp_path, clock):
    (tmp_path / "pose.cell").mkdir()
    with pytest.raises(SpaceUnavailable, match=r"pose\.cell: cannot open shared memory"):
        SharedSpace(tmp_path, clock).cell_reader("pose")


def test_an_unknown_topic_names_the_known_ones(tmp_path, clock):
    with pytest.raises(UnknownTopic, match=r"no topic 'poes'; .*joint_state"):
        SharedSpace(tmp_path, clock).cell_reader("poes")


@pytest.mark.parametrize("opener", ["cell_writer", "frame_writer", "cell_reader", "frame_reader"])
def test_a_topic_of_another_kind_is_refused(tmp_path, clock, opener):
    with pytest.raises(UnknownTopic, match="'operator' is a event ring"):
        getattr(SharedSpace(tmp_path, clock), opener)("operator")


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_declared_topic_opens_for_writing_and_reading(tmp_path, clock, topic):
    space = SharedSpace(tmp_path, clock)
    if topic.kind is TopicKind.RING:
        space.ring_writer(topic.name).publish({"ok": 1})
        assert space.ring_reader(topic.name, from_start=True).drain()[0].payload == {"ok": 1}
    elif topic.kind is TopicKind.FRAME:
        space.frame_writer(topic.name).put(bytes(topic.slot_bytes), width=1, height=1, stamp_ns=1)
        assert len(space.frame_reader(topic.name).latest().payload) == topic.slot_bytes
    elif topic.kind is TopicKind.RECORD:
        space.record_writer(topic.name).append(b"ok")
        assert space.record_reader(topic.name).held()[0].payload == b"ok"
    elif is_document(topic):
        space.cell_writer(topic.name).put_document({"ok": 1})
        assert space.cell_reader(topic.name).latest().document() == {"ok": 1}
    else:
        space.cell_writer(topic.name).commit()
        data = space.cell_reader(topic.name).latest().data
        assert set(data.dtype.names) == {field.name for field in topic.fields}


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_every_layout_has_three_slots_that_do_not_overlap(topic):
    layout = layout_of(topic)
    assert layout.slots >= 3
    assert layout.offset(layout.slots - 1) + layout.stride_bytes == layout.file_bytes
    assert layout.stride_bytes % 64 == 0


def test_packed_fields_lie_aligned_and_little_endian():
    dtype = record_dtype(BY_NAME["joint_state"])
    assert dtype.isalignedstruct
    assert all(dtype[name].base.byteorder in "=|<" for name in dtype.names)
    assert dtype["position"] == np.dtype(("<f8", (32,)))


def test_a_closed_space_holds_no_descriptor_and_its_samples_stay_valid(tmp_path, clock):
    before = len(list(Path("/proc/self/fd").iterdir()))
    space = SharedSpace(tmp_path, clock)
    space.cell_writer("pose").put(
        x_m=1, y_m=2, yaw_rad=3, match_ratio=1, covariance=(0,) * 9, state=0, doubt=0
    )
    sample = space.cell_reader("pose").latest()
    space.ring_reader("operator", from_start=True).drain()
    space.doorbell("operator")
    space.close()
    space.close()
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert sample.data["y_m"] == 2
