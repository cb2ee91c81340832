from typing import Any

import pytest

from vla_deploy.perception.detection import Detection
from vla_deploy.perception.tracking import Tracker, View

CLEAR, HIDDEN = View.CLEAR, View.HIDDEN


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
    }
    return Detection(**(fields | changes))


class Watcher:
    """Feed a tracker one image after the other."""

    def __init__(self) -> None:
        self.tracker = Tracker()
        self.images = 0

    def image(self, *detections: Detection, view: View = CLEAR) -> list[dict[str, Any]]:
        self.images += 1
        views = {id(track): view for track in self.tracker.tracks}
        self.tracker.update(list(detections), views, self.images * 200_000_000)
        return [track.document() for track in self.tracker.objects]


def test_a_thing_is_believed_at_the_second_sight() -> None:
    watcher = Watcher()
    assert watcher.image(seen()) == []
    (cup,) = watcher.image(seen())
    assert (cup["id"], cup["class"], cup["colour"]) == ("cup_1", "cup", "red")
    assert cup["seen_count"] == 2
    assert cup["last_seen_ns"] == 400_000_000


def test_one_false_sight_is_forgotten() -> None:
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
    watcher.image(*pair)
    objects = watcher.image(*pair)
    assert {o["id"]: o["position_m"][0] for o in objects} == {"cup_1": 1.0, "cup_2": 1.3}


def test_a_wrong_class_now_and_then_changes_nothing() -> None:
    watcher = Watcher()
    for i in range(9):
        objects = watcher.image(seen("object" if i % 4 == 3 else "cup"))
    assert [(o["id"], o["class"]) for o in objects] == [("cup_1", "cup")]


def test_what_is_hidden_stays_in_memory() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image(seen())
    for _ in range(50):
        objects = watcher.image(view=HIDDEN)
    assert [o["id"] for o in objects] == ["cup_1"]
    assert objects[0]["last_seen_ns"] == 400_000_000


def test_what_has_left_its_place_is_forgotten_after_several_clear_views() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image(seen())
    for _ in range(4):
        assert watcher.image() != []
    assert watcher.image() == []


def test_a_thing_that_was_carried_away_keeps_its_id() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image(seen())
    for _ in range(6):
        watcher.image()
    elsewhere = seen(at=(4.0, 0.5, 0.6))
    watcher.image(elsewhere)
    (cup,) = watcher.image(elsewhere)
    assert cup["id"] == "cup_1"
    assert cup["position_m"] == [4.0, 0.5, 0.6]


def test_a_thing_that_is_pushed_in_view_keeps_its_id() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image(seen())
    pushed = seen(at=(1.4, 2.0, 0.5))
    watcher.image(pushed)
    (cup,) = watcher.image(pushed)
    assert cup["id"] == "cup_1"
    assert cup["position_m"][0] == 1.4


def test_another_colour_is_another_thing() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image(seen())
    for _ in range(8):
        objects = watcher.image(seen(colour="blue", at=(1.09, 2.0, 0.5)))
    assert [(o["id"], o["colour"]) for o in objects] == [("cup_2", "blue")]


def test_a_truncated_sight_makes_no_thing_but_keeps_one_alive() -> None:
    watcher = Watcher()
    for _ in range(3):
        assert watcher.image(seen(truncated=True)) == []
    watcher.image(seen())
    watcher.image(seen())
    for _ in range(9):
        objects = watcher.image(seen("object", at=(1.02, 2.0, 0.45), truncated=True))
    assert [(o["id"], o["class"]) for o in objects] == [("cup_1", "cup")]
    assert objects[0]["position_m"][0] < 1.01


def test_what_a_hand_holds_moves_with_the_hand_and_is_not_missed() -> None:
    watcher = Watcher()
    pair = (seen(), seen(at=(1.3, 2.0, 0.5)))
    watcher.image(*pair)
    watcher.image(*pair)
    for i in range(20):
        watcher.tracker.carry("cup", (1.0, 2.0, 0.5 + 0.02 * i), 0)
        objects = watcher.image(pair[1])
    heights = {o["id"]: o["position_m"][2] for o in objects}
    assert heights == {"cup_1": pytest.approx(0.88), "cup_2": 0.5}


def test_a_hand_that_holds_something_unknown_moves_nothing() -> None:
    watcher = Watcher()
    watcher.image(seen())
    watcher.image(seen())
    watcher.tracker.carry("ball", (1.0, 2.0, 0.6), 0)
    watcher.tracker.carry("cup", (1.0, 2.0, 1.2), 0)
    (cup,) = watcher.image(seen())
    assert cup["position_m"] == [1.0, 2.0, 0.5]


def test_a_vague_sight_begins_no_track() -> None:
    watcher = Watcher()
    for _ in range(4):
        objects = watcher.image(seen("object", "brown", occluded=True))
    assert objects == []


def test_a_thing_too_far_to_be_recognised_keeps_its_class() -> None:
    watcher = Watcher()
    for _ in range(3):
        watcher.image(seen("ball", "blue"))
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


def test_a_box_seen_better_from_near_replaces_its_far_sight() -> None:
    watcher = Watcher()
    far = seen("box", "brown", at=(4.14, 0.52, 0.475), size_m=(0.28, 0.145, 0.11))
    near = seen("box", "orange", at=(4.21, 0.46, 0.49), size_m=(0.24, 0.24, 0.13))
    for _ in range(3):
        watcher.image(far)
    for _ in range(3):
        boxes = watcher.image(near, view=HIDDEN)
    assert [(box["id"], box["colour"]) for box in boxes] == [("box_1", "orange")]


def test_a_half_hidden_second_sight_of_a_box_is_no_second_box() -> None:
    watcher = Watcher()
    box = seen("box", "orange", at=(4.2, 0.46, 0.49), size_m=(0.24, 0.24, 0.13))
    part = seen("box", "orange", at=(4.14, 0.46, 0.49), size_m=(0.24, 0.14, 0.13), occluded=True)
    for _ in range(4):
        boxes = watcher.image(box, part)
    assert [one["id"] for one in boxes] == ["box_1"]
