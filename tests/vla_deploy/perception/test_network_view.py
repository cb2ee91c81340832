import numpy as np
import pytest

from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.naming import Word
from vla_deploy.perception.network_view import NetworkView
from vla_deploy.perception.voices import Voice

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


def test_a_place_has_the_surest_word_of_those_that_fill_the_same_box() -> None:
    seen = view(
        ((0, 0, 100, 100), 0.9, 1),
        ((12, 10, 30, 40), 0.8, 0),
        ((10, 10, 30, 40), 0.4, 1),
        voices=MEASURED,
    )
    assert seen.word_for((10, 10, 30, 40)) == Word(class_name="cup", chance=0.7)
    assert seen.word_for((60, 10, 90, 40)) is None


def test_an_image_in_which_nothing_was_found_has_no_word() -> None:
    assert view(voices=UNMEASURED).word_for((0, 0, 20, 20)) is None


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
    word = view(((0, 0, 20, 20), score, 0), voices=UNMEASURED).word_for((0, 0, 20, 20))
    assert word is not None
    assert word.chance <= 0.5
