from dataclasses import replace

import numpy as np
import pytest

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.images.network_view import NetworkView, as_pinhole, to_camera_image
from vla_deploy.perception.naming.class_fusion import ClassVote
from vla_deploy.perception.naming.class_weighting import ClassReliability

BENT = Intrinsics(
    width=320, height=240, fx=216.5, fy=216.5, cx=159.5, cy=119.5, distortion=(-0.3, 0.1, 0, 0, 0)
)
SQUARE = (20, 180, 60, 220)
UNMEASURED = (ClassReliability(class_name="cup"), ClassReliability(class_name="ball"))
MEASURED = tuple(
    ClassReliability(class_name=name, precision=0.7, recall=recall)
    for name, recall in (("cup", 0.6), ("ball", 0.4), ("cup", 0.5))
)


def view(
    *rows: tuple[tuple[float, ...], float, int], reliabilities: tuple[ClassReliability, ...]
) -> NetworkView:
    return NetworkView(
        boxes=Boxes(
            corners_px=np.array([row[0] for row in rows], np.float32).reshape(-1, 4),
            scores=np.array([row[1] for row in rows], np.float32),
            classes=np.array([row[2] for row in rows], np.intp),
        ),
        reliabilities=reliabilities,
    )


def test_a_place_has_a_word_of_each_class_that_fills_the_same_box_the_surest_first() -> None:
    seen = view(
        ((0, 0, 100, 100), 0.9, 1),
        ((12, 10, 30, 40), 0.8, 0),
        ((10, 10, 30, 40), 0.25, 1),
        ((11, 10, 30, 40), 0.2, 2),
        reliabilities=MEASURED,
    )
    cup, ball = (ClassVote(class_name="cup", chance=0.7), ClassVote(class_name="ball", chance=0.35))
    assert seen.votes_for((10, 10, 30, 40)) == [cup, ball]
    assert seen.votes_for((60, 10, 90, 40)) == []


def test_views_that_are_joined_vote_side_by_side() -> None:
    known = view(
        ((10, 10, 30, 40), 1.0, 0),
        reliabilities=(ClassReliability(class_name="block", precision=0.9),),
    )
    both = view(((12, 10, 30, 40), 0.8, 0), reliabilities=MEASURED).joined(known)
    votes = both.votes_for((10, 10, 30, 40))
    assert votes == [
        ClassVote(class_name="block", chance=0.9),
        ClassVote(class_name="cup", chance=0.7),
    ]


def test_an_image_in_which_nothing_was_found_has_no_word() -> None:
    assert view(reliabilities=UNMEASURED).votes_for((0, 0, 20, 20)) == []


def test_sure_words_have_a_place_each_and_leave_weak_ones_out() -> None:
    seen = view(
        ((0, 0, 100, 100), 0.9, 1),
        ((1, 0, 100, 100), 0.8, 0),
        ((200, 0, 300, 100), 0.3, 1),
        ((50, 0, 150, 100), 0.4, 0),
        reliabilities=MEASURED,
    )
    sure = replace(seen, sure_score=0.35)
    assert [word.class_name for _, word in sure.sure_votes({"cup", "ball"})] == ["ball", "cup"]
    assert [place[0] for place, _ in sure.sure_votes({"cup"})] == [1, 50]
    assert len([*seen.sure_votes({"ball"})]) == 2


def test_silence_tells_as_much_as_the_network_finds_of_a_class_and_nothing_of_what_is_tiny() -> (
    None
):
    seen = view(reliabilities=MEASURED)
    assert seen.recall_at((0, 0, 30, 12), "cup") == 0.6
    assert seen.recall_at((0, 0, 30, 12), "ball") == 0.4
    assert seen.recall_at((0, 0, 9, 9), "cup") == 0.0
    assert view(reliabilities=UNMEASURED).recall_at((0, 0, 30, 12), "cup") == 0.0


def test_silence_says_nothing_of_a_class_that_the_network_does_not_know() -> None:
    assert view(reliabilities=MEASURED).recall_at((0, 0, 30, 12), "box") == 0.0


@pytest.mark.parametrize("score", [0.4, 1.0])
def test_a_model_that_nobody_measured_names_nothing_by_itself(score: float) -> None:
    (word,) = view(((0, 0, 20, 20), score, 0), reliabilities=UNMEASURED).votes_for((0, 0, 20, 20))
    assert word.chance <= 0.5


def frame_of(camera: Intrinsics) -> RgbdFrame:
    rgb = np.zeros((240, 320, 3), np.uint8)
    left, top, right, bottom = SQUARE
    rgb[top:bottom, left:right] = 255
    depth = np.ones((240, 320), np.uint16)
    return RgbdFrame(
        stamp_ns=0, sequence=0, intrinsics=camera, depth_unit_m=0.001, rgb=rgb, depth=depth
    )


def test_a_box_that_a_network_draws_lies_on_the_thing_in_the_cameras_image() -> None:
    shown = as_pinhole(frame_of(BENT))
    rows, columns = np.nonzero(shown[..., 0] > 127)
    box = np.array([[columns.min(), rows.min(), columns.max(), rows.max()]], np.float32)
    boxes = Boxes(corners_px=box, scores=np.array([0.9], np.float32), classes=np.array([0]))
    view = to_camera_image(NetworkView(boxes=boxes, reliabilities=UNMEASURED), BENT)
    assert view is not None
    assert view.votes_for(SQUARE)
    assert view.boxes.corners_px[0] == pytest.approx(SQUARE, abs=6.0)


def test_a_pinholes_image_is_shown_as_it_is() -> None:
    frame = frame_of(replace(BENT, distortion=()))
    assert as_pinhole(frame) is frame.rgb
    assert to_camera_image(None, BENT) is None
