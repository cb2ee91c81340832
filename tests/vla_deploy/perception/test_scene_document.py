"""The scene's document as a whole: its size, and that what is told can be taken over again."""

import json
from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.ipc import BY_NAME
from vla_deploy.perception.objects.body_state import Hold
from vla_deploy.perception.objects.filtering import Estimate
from vla_deploy.perception.objects.scene import Scene
from vla_deploy.perception.objects.track import Track
from vla_deploy.perception.objects.tracker import MAX_OBJECTS, VANISHED_KEPT
from vla_deploy.world.thing import Rest
from vla_deploy.world.touch import Grip, Touch

WHY = "the right hand lost it: it slipped out: the fingers have closed"


def a_track(number: int) -> Track:
    estimate = Estimate(
        position_m=np.array([-12.3456, -12.3456, 0.4567]),
        covariance_m2=0.1234 * np.eye(3),
        stamp_ns=10**18 - number,
    )
    track = Track(
        estimate=estimate,
        size_m=(0.1234, 0.1234, 0.1234),
        yaw_rad=-1.2345,
        confidence=0.9,
        first_seen_ns=0,
        last_seen_ns=10**18 - number,
        seen_count=123_456,
        object_id=f"bottle_{100 + number}",
        aliases=(f"bottle_{300 + number}",),
        rests=Rest("in", "kitchen_table"),
        cause=WHY,
    )
    for name, colour in (("bottle", "orange"), ("object", "purple"), ("remote", "yellow")):
        track.classes.add(name)
        track.colours.add(colour)
    return track


def full_scene() -> Scene:
    scene = Scene()
    scene._tracker._tracks = [a_track(number) for number in range(MAX_OBJECTS)]
    scene._tracker._vanished = [a_track(100 + number) for number in range(VANISHED_KEPT)]
    corners = [[-12.345, -12.345]] * 24
    surface = {"name": "kitchen_table", "height_m": 0.4567, "polygon_m": corners}
    scene._surfaces = [surface] * 8
    hold = Hold(kind="bottle", reported="bottle", touch=Touch(grip=Grip.LOST), is_confirmed=True,
                cause=WHY)  # fmt: skip
    scene._hands = {name: hold.document("bottle_1") for name in ("left", "right")}
    return scene


def test_the_fullest_scene_fits_its_cell() -> None:
    document = full_scene().document() | {
        "robot": dict.fromkeys(("x_m", "y_m", "yaw_rad"), -1.2345678901234567),
        "away": dict.fromkeys(("lidar", "imu", "camera"), "unplugged; plug it in"),
    }
    room_bytes = BY_NAME["scene"].fields[0].shape
    assert len(document["objects"]) > 30
    assert document["objects"][0]["id"] == "bottle_100"
    # What others add to the scene, such as people and how things are named, needs some of it.
    assert len(json.dumps(document, separators=(",", ":"))) < 0.92 * room_bytes


def test_what_was_told_is_taken_over_by_the_next_instance() -> None:
    scene = Scene()
    scene._tracker._tracks = [a_track(1), replace(a_track(2), aliases=(), cause="")]
    told = scene.document()
    heir = Scene()
    heir.restore(told)
    for before, after in zip(told["objects"], heir.document()["objects"], strict=True):
        names = ("id", "class", "colour", "position_m", "size_m", "sigma_m", "rests")
        assert {name: after[name] for name in names} == {name: before[name] for name in names}
        assert after["confidence"] == pytest.approx(before["confidence"], abs=0.002)
    heir._tracker._used["bottle"] += 1
    assert heir._tracker._used["bottle"] == 302  # a new one gets a number of its own


def test_what_was_lost_keeps_its_id_for_the_next_instance() -> None:
    scene = Scene()
    scene._tracker._tracks = [replace(a_track(1), aliases=())]
    scene._tracker._vanished = [replace(a_track(7), aliases=(), cause="it fell")]
    heir = Scene()
    heir.restore(scene.document())
    assert [(one["id"], one["cause"]) for one in heir.document()["lost"]] == [
        ("bottle_107", "it fell")
    ]
    assert heir._tracker._used["bottle"] == 107
