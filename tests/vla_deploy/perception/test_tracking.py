from typing import Any

import numpy as np
import pytest

from vla_deploy.perception.images.detection import Detection
from vla_deploy.perception.naming.class_fusion import NameSource
from vla_deploy.perception.objects.filtering import Estimate, covariance_of
from vla_deploy.perception.objects.track import KNOWN_LOOKS, MAX_ODD_SIGHTINGS, Sighting
from vla_deploy.perception.objects.tracker import Tracker


def seen(
    name: str = "cup",
    colour: str = "red",
    at: tuple[float, float, float] = (1.0, 2.0, 0.5),
    **changes: Any,
) -> Detection:
    fields: dict[str, Any] = {
        "class_name": name,
        "colour": colour,
        "position_m": at,
        "size_m": (0.066, 0.066, 0.095),
        "yaw_rad": 0.0,
        "confidence": 0.9,
        "truncated": False,
        "occluded": False,
        "box_px": (0, 0, 10, 10),
        "covariance_m2": ((9e-6, 0.0, 0.0), (0.0, 9e-6, 0.0), (0.0, 0.0, 9e-6)),
        "size_sigma_m": (0.003, 0.003, 0.003),
        "yaw_sigma_rad": 0.1,
        "named_by": NameSource.FORM,
    }
    return Detection(**(fields | changes))


def sighting(detection: Detection, stamp_ns: int) -> Sighting:
    """As from 0.8 m away."""
    position_m, covariance = np.array(detection.position_m), covariance_of(detection, 0.8)
    seen_there = Estimate(position_m=position_m, covariance_m2=covariance, stamp_ns=stamp_ns)
    return Sighting(detection, seen_there)


class Watcher:
    """Feed a tracker one image after the other."""

    def __init__(self) -> None:
        self.tracker = Tracker()
        self.images = 0

    def image(
        self, *detections: Detection, in_view: bool = True, times: int = 1
    ) -> list[dict[str, Any]]:
        for _ in range(times):
            self.images += 1
            clear = self.tracker.tracks if in_view else []
            stamp_ns = self.images * 200_000_000
            self.tracker.update([sighting(one, stamp_ns) for one in detections], clear, stamp_ns)
        return [track.document() for track in self.tracker.objects]


def knowing(*detections: Detection) -> Watcher:
    """Return a watcher that has confirmed some things."""
    watcher = Watcher()
    watcher.image(*detections, times=2)
    return watcher


def test_a_thing_is_believed_at_the_second_sighting() -> None:
    watcher = Watcher()
    assert watcher.image(seen()) == []
    (cup,) = watcher.image(seen())
    assert (cup["id"], cup["class"], cup["colour"]) == ("cup_1", "cup", "red")
    assert cup["seen_count"] == 2
    assert cup["last_seen_ns"] == 400_000_000


def test_one_false_sighting_is_forgotten() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image()
    watcher.image()
    assert watcher.image(seen()) == []


def test_noise_is_averaged_and_the_id_stays() -> None:
    watcher = Watcher()
    for i in range(30):
        (*_,) = watcher.image(seen(at=(1.0 + (0.01 if i % 2 else -0.01), 2.0, 0.5)))
    (cup,) = watcher.image(seen())
    assert cup["id"] == "cup_1"
    assert cup["position_m"][0] == pytest.approx(1.0, abs=0.003)


def test_two_of_a_kind_get_two_ids() -> None:
    watcher = Watcher()
    pair = (seen(at=(1.0, 2.0, 0.5)), seen(at=(1.3, 2.0, 0.5)))
    objects = watcher.image(*pair, times=2)
    assert {o["id"]: o["position_m"][0] for o in objects} == {"cup_1": 1.0, "cup_2": 1.3}


def test_a_wrong_class_now_and_then_changes_nothing() -> None:
    watcher = Watcher()
    for i in range(9):
        objects = watcher.image(seen("object" if i % 4 == 3 else "cup"))
    assert [(o["id"], o["class"]) for o in objects] == [("cup_1", "cup")]


def test_what_is_hidden_stays_in_memory() -> None:
    watcher = knowing(seen())
    objects = watcher.image(in_view=False, times=50)
    assert [o["id"] for o in objects] == ["cup_1"]
    assert objects[0]["last_seen_ns"] == 400_000_000


def test_what_has_left_its_place_is_forgotten_after_several_clear_views() -> None:
    watcher = knowing(seen())
    for _ in range(4):
        assert watcher.image() != []
    assert watcher.image() == []


def test_a_thing_that_was_carried_away_keeps_its_id() -> None:
    watcher = knowing(seen())
    watcher.image(times=6)
    elsewhere = seen(at=(4.0, 0.5, 0.6))
    (cup,) = watcher.image(elsewhere, times=2)
    assert cup["id"] == "cup_1"
    assert cup["position_m"] == [4.0, 0.5, 0.6]


def test_a_thing_that_is_pushed_in_view_keeps_its_id() -> None:
    watcher = knowing(seen())
    pushed = seen(at=(1.4, 2.0, 0.5))
    (cup,) = watcher.image(pushed, times=2)
    assert cup["id"] == "cup_1"
    assert cup["position_m"][0] == 1.4


def test_another_colour_is_another_thing() -> None:
    watcher = knowing(seen())
    objects = watcher.image(seen(colour="blue", at=(1.09, 2.0, 0.5)), times=8)
    assert [(o["id"], o["colour"]) for o in objects] == [("cup_2", "blue")]


def test_a_truncated_sighting_makes_no_thing_but_keeps_one_alive() -> None:
    watcher = Watcher()
    for _ in range(3):
        assert watcher.image(seen(truncated=True)) == []
    watcher.image(seen(), times=2)
    objects = watcher.image(seen("object", at=(1.02, 2.0, 0.45), truncated=True), times=9)
    assert [(o["id"], o["class"]) for o in objects] == [("cup_1", "cup")]
    assert objects[0]["position_m"][0] < 1.01


def test_what_a_hand_holds_moves_with_the_hand_and_is_not_missed() -> None:
    pair = (seen(), seen(at=(1.3, 2.0, 0.5)))
    watcher = knowing(*pair)
    for i in range(20):
        watcher.tracker.carry("left", "cup", (1.0, 2.0, 0.5 + 0.02 * i), 0)
        objects = watcher.image(pair[1])
    heights = {o["id"]: o["position_m"][2] for o in objects}
    assert heights == {"cup_1": pytest.approx(0.88), "cup_2": 0.5}


def test_a_hand_that_holds_something_unknown_moves_nothing() -> None:
    watcher = knowing(seen())
    watcher.tracker.carry("right", "ball", (1.0, 2.0, 0.6), 0)
    watcher.tracker.carry("left", "cup", (1.0, 2.0, 1.2), 0)
    (cup,) = watcher.image(seen())
    assert cup["position_m"] == [1.0, 2.0, 0.5]


def test_a_vague_sighting_begins_no_track() -> None:
    watcher = Watcher()
    objects = watcher.image(seen("object", "brown", occluded=True), times=4)
    assert objects == []


def test_a_thing_too_far_to_be_recognised_keeps_its_class() -> None:
    watcher = Watcher()
    watcher.image(seen("ball", "blue"), times=3)
    for _ in range(6):
        (ball,) = watcher.image(seen("object", "blue", confidence=0.4))
    assert (ball["class"], ball["seen_count"]) == ("ball", 9)
    assert ball["confidence"] > 0.5


def test_a_thing_never_surely_recognised_is_no_known_thing() -> None:
    watcher = Watcher()
    watcher.image(seen("bottle", "blue"))
    for _ in range(8):
        (thing,) = watcher.image(seen("object", "blue"))
    assert thing["class"] == "object"


def test_a_box_seen_better_from_near_replaces_its_far_sighting() -> None:
    watcher = Watcher()
    far = seen("box", "brown", at=(4.14, 0.52, 0.475), size_m=(0.28, 0.145, 0.11))
    near = seen("box", "orange", at=(4.21, 0.46, 0.49), size_m=(0.24, 0.24, 0.13))
    watcher.image(far, times=3)
    boxes = watcher.image(near, in_view=False, times=3)
    assert [(box["id"], box["colour"]) for box in boxes] == [("box_1", "orange")]


def test_a_half_hidden_second_sighting_of_a_box_is_no_second_box() -> None:
    watcher = Watcher()
    box = seen("box", "orange", at=(4.2, 0.46, 0.49), size_m=(0.24, 0.24, 0.13))
    part = seen("box", "orange", at=(4.14, 0.46, 0.49), size_m=(0.24, 0.14, 0.13), occluded=True)
    boxes = watcher.image(box, part, times=4)
    assert [one["id"] for one in boxes] == ["box_1"]


def test_half_hidden_sightings_of_its_box_make_a_cup_no_larger() -> None:
    cup, box = seen(), seen("box", "orange", size_m=(0.24, 0.24, 0.13))
    watcher = knowing(cup, box)
    wall = seen("box", "orange", at=(1.03, 2.0, 0.5), size_m=(0.23, 0.15, 0.126), occluded=True)
    shard = seen("object", "orange", at=(1.02, 2.0, 0.5), size_m=(0.16, 0.08, 0.1), truncated=True)
    objects = watcher.image(box, wall, shard, in_view=False, times=30)
    kept = {one["id"]: one for one in objects}
    assert kept["cup_1"]["size_m"] == [0.066, 0.066, 0.095]


def test_a_cup_that_is_seen_as_one_with_its_box_now_and_then_gets_no_larger() -> None:
    watcher = Watcher()
    both = seen(size_m=(0.215, 0.215, 0.126))
    watcher.image(seen(), times=KNOWN_LOOKS)
    for _ in range(3):
        for _ in range(MAX_ODD_SIGHTINGS):
            (cup,) = watcher.image(both)
            assert cup["size_m"] == [0.066, 0.066, 0.095]
        watcher.image(seen(occluded=True))


def test_a_size_that_was_wrong_from_the_start_is_given_up() -> None:
    watcher = Watcher()
    watcher.image(seen(size_m=(0.215, 0.215, 0.126)), times=2 * KNOWN_LOOKS)
    for _ in range(MAX_ODD_SIGHTINGS + 15):
        (cup,) = watcher.image(seen())
    assert cup["size_m"] == pytest.approx([0.066, 0.066, 0.095], rel=0.1)


def test_crossing_sightings_of_two_alike_things_are_shared_out_as_a_whole() -> None:
    """The nearest pair alone would leave the second thing without its sighting."""
    watcher = Watcher()
    pair = (seen(at=(1.0, 2.0, 0.5)), seen(at=(1.05, 2.0, 0.5)))
    watcher.image(*pair, times=4)
    objects = watcher.image(seen(at=(1.028, 2.0, 0.5)), seen(at=(1.09, 2.0, 0.5)))
    assert {o["id"] for o in objects} == {"cup_1", "cup_2"}
    first, second = sorted(objects, key=lambda o: str(o["id"]))
    assert first["position_m"][0] < second["position_m"][0]
    assert first["seen_count"] == second["seen_count"] == 5


def test_one_look_that_sees_something_else_does_not_confirm() -> None:
    watcher = Watcher()
    watcher.image(seen("cup"))
    assert watcher.image(seen("phone", at=(1.01, 2.0, 0.5))) == []
    (thing,) = watcher.image(seen("cup"))
    assert thing["class"] == "cup"


def test_it_tells_how_sure_it_is_of_place_class_and_colour() -> None:
    watcher = Watcher()
    for name in ("cup", "cup", "bottle", "cup"):
        objects = watcher.image(seen(name))
    (cup,) = objects
    assert cup["classes"] == {"cup": 0.75, "bottle": 0.25}
    assert cup["colours"] == {"red": 1.0}
    assert max(cup["sigma_m"]) < 0.015
    for _ in range(300):
        (later,) = watcher.image(in_view=False)
    assert later["sigma_m"] == cup["sigma_m"]  # as it was seen last; `predicted` is of the present


def test_a_thing_found_elsewhere_before_its_old_place_was_seen_empty_gets_its_old_id() -> None:
    watcher = knowing(seen())
    watcher.image(in_view=False, times=20)
    elsewhere = seen(at=(4.0, 0.5, 0.6))
    both = watcher.image(elsewhere, in_view=False, times=2)
    assert {o["id"] for o in both} == {"cup_1", "cup_2"}
    objects = watcher.image(elsewhere, times=5)
    assert [(o["id"], o["aliases"]) for o in objects] == [("cup_1", ["cup_2"])]


def test_a_thing_that_is_carried_about_all_day_goes_by_its_own_and_its_last_ids_only() -> None:
    watcher = Watcher()
    places = ((1.0, 2.0, 0.5), (4.0, 0.5, 0.6))
    watcher.image(seen(), times=2)
    for move in range(1, 9):
        at = places[move % 2]
        watcher.image(in_view=False, times=20)
        watcher.image(seen(at=at), in_view=False, times=2)
        watcher.image(seen(at=at), times=5)
    (cup,) = watcher.tracker.objects
    assert (cup.object_id, cup.aliases) == ("cup_1", ("cup_9", "cup_8", "cup_7"))


def test_one_that_stood_there_all_the_time_is_no_moved_one() -> None:
    pair = (seen(), seen(at=(4.0, 0.5, 0.6)))
    watcher = knowing(*pair)
    objects = watcher.image(pair[1], times=6)
    assert [(o["id"], o.get("aliases")) for o in objects] == [("cup_2", None)]
    assert [one.object_id for one in watcher.tracker.vanished] == ["cup_1"]


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"colour": "blue"}, "another colour"),
        ({"size_m": (0.13, 0.13, 0.2)}, "twice the size"),
        ({"at": (60.0, 2.0, 0.5)}, "nobody runs that fast"),
    ],
)
def test_what_cannot_be_the_missing_thing_is_a_new_one(changes: dict[str, Any], why: str) -> None:
    watcher = knowing(seen())
    watcher.image(times=6)
    other = seen(**({"at": (2.0, 2.0, 0.5)} | changes))
    (thing,) = watcher.image(other, times=2)
    assert thing["id"] == "cup_2", why


def test_a_hand_keeps_what_it_took_when_it_passes_another_one_like_it() -> None:
    pair = (seen(), seen(at=(1.3, 2.0, 0.5)))
    watcher = knowing(*pair)
    for step in range(16):
        watcher.tracker.carry("left", "cup", (1.0 + 0.02 * step, 2.0, 0.62), 0)
        objects = watcher.image(pair[1])
    held = {o["id"]: o.get("held_by") for o in objects}
    assert held == {"cup_1": "left", "cup_2": None}


def test_what_was_let_go_is_found_where_it_has_come_to_rest() -> None:
    watcher = knowing(seen())
    watcher.tracker.carry("left", "cup", (3.0, 1.0, 0.6), 0)
    watcher.tracker.release("left")
    (cup,) = watcher.image(seen(at=(3.02, 1.0, 0.52)))
    assert (cup["id"], "held_by" in cup) == ("cup_1", False)
    assert cup["position_m"][2] < 0.54


def test_the_memory_of_tracks_is_bounded() -> None:
    watcher = Watcher()
    for number in range(200):
        spot = seen("object", at=(number * 1.0, 0.0, 0.5))
        watcher.image(spot, in_view=False, times=2)
    assert len(watcher.tracker.tracks) <= 128
    assert len(watcher.tracker.objects) <= 64


@pytest.mark.parametrize(
    "other",
    [
        seen("box", "brown", at=(1.05, 2.0, 0.4)),
        seen("object", "red", at=(1.05, 2.0, 0.4)),
        seen("cup", "blue", at=(1.05, 2.0, 0.4)),
    ],
    ids=["another thing", "no known thing", "another colour"],
)
def test_what_a_hand_has_lost_is_not_found_in_whatever_else_lies_there(other: Detection) -> None:
    watcher = knowing(seen())
    watcher.tracker.carry("left", "cup", (1.0, 2.0, 0.6), 500_000_000)
    watcher.tracker.lose("left", "it slipped out")
    told = watcher.image(other, in_view=False, times=3)
    lost = next(one for one in told if one["id"] == "cup_1")
    assert lost["cause"] == "it slipped out"
    assert (lost["class"], lost["colour"]) == ("cup", "red")
    assert lost["last_seen_ns"] == 500_000_000

    found = watcher.image(seen(at=(1.1, 2.0, 0.4)), in_view=False)
    cup = next(one for one in found if one["id"] == "cup_1")
    assert "cause" not in cup
    assert cup["position_m"][0] == pytest.approx(1.1, abs=0.02)
