from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.naming.class_weighting import Voice
from vla_deploy.perception.naming.object_name import ClassVote

UNMEASURED = (Voice(class_name="cup"), Voice(class_name="ball"))
MEASURED = tuple(
    Voice(class_name=name, precision=0.7, recall=recall)
    for name, recall in (("cup", 0.6), ("ball", 0.4), ("cup", 0.5))
)


def view(*rows: tuple[tuple[float, ...], float, int], voices: tuple[Voice, ...]) -> NetworkView:
    return NetworkView(
        boxes=Boxes(
            corners_px=np.array([row[0] for row in rows], np.float32).reshape(-1, 4),
            scores=np.array([row[1] for row in rows], np.float32),
            classes=np.array([row[2] for row in rows], np.intp),
        ),
        voices=voices,
    )


def test_a_place_has_a_word_of_each_class_that_fills_the_same_box_the_surest_first() -> None:
    seen = view(
        ((0, 0, 100, 100), 0.9, 1),
        ((12, 10, 30, 40), 0.8, 0),
        ((10, 10, 30, 40), 0.25, 1),
        ((11, 10, 30, 40), 0.2, 2),
        voices=MEASURED,
    )
    cup, ball = (ClassVote(class_name="cup", chance=0.7), ClassVote(class_name="ball", chance=0.35))
    assert seen.words_for((10, 10, 30, 40)) == [cup, ball]
    assert seen.words_for((60, 10, 90, 40)) == []


def test_an_image_in_which_nothing_was_found_has_no_word() -> None:
    assert view(voices=UNMEASURED).words_for((0, 0, 20, 20)) == []


def test_sure_words_have_a_place_each_and_leave_weak_ones_out() -> None:
    seen = view(
        ((0, 0, 100, 100), 0.9, 1),
        ((1, 0, 100, 100), 0.8, 0),
        ((200, 0, 300, 100), 0.3, 1),
        ((50, 0, 150, 100), 0.4, 0),
        voices=MEASURED,
    )
    sure = replace(seen, sure_score=0.35)
    assert [word.class_name for _, word in sure.sure_words({"cup", "ball"})] == ["ball", "cup"]
    assert [place[0] for place, _ in sure.sure_words({"cup"})] == [1, 50]
    assert len([*seen.sure_words({"ball"})]) == 2


def test_silence_tells_as_much_as_the_network_finds_of_a_class_and_nothing_of_what_is_tiny() -> (
    None
):
    seen = view(voices=MEASURED)
    assert seen.silence((0, 0, 30, 12), "cup") == 0.6
    assert seen.silence((0, 0, 30, 12), "ball") == 0.4
    assert seen.silence((0, 0, 9, 9), "cup") == 0.0
    assert view(voices=UNMEASURED).silence((0, 0, 30, 12), "cup") == 0.0


def test_silence_says_nothing_of_a_class_that_the_network_does_not_know() -> None:
    assert view(voices=MEASURED).silence((0, 0, 30, 12), "box") == 0.0


@pytest.mark.parametrize("score", [0.4, 1.0])
def test_a_model_that_nobody_measured_names_nothing_by_itself(score: float) -> None:
    (word,) = view(((0, 0, 20, 20), score, 0), voices=UNMEASURED).words_for((0, 0, 20, 20))
    assert word.chance <= 0.5
