import pytest

from vla_deploy.planning.understanding.names import closest, edit_distance
from vla_deploy.world.vocabulary import COLOURS, OBJECT_CLASSES

KNOWN = (*OBJECT_CLASSES, *COLOURS, "kitchen", "bedroom", "coffee")


@pytest.mark.parametrize(
    ("one", "other", "distance"),
    [("cup", "cup", 0), ("", "cup", 3), ("botle", "bottle", 1), ("kitchne", "kitchen", 1),
     ("cup", "ball", 4), ("abc", "ca", 3)],
)  # fmt: skip
def test_edit_distance_counts_a_swap_of_neighbours_as_one(
    one: str, other: str, distance: int
) -> None:
    assert edit_distance(one, other) == edit_distance(other, one) == distance


@pytest.mark.parametrize(
    ("word", "known", "is_sure"),
    [
        ("cup", ("cup",), True),
        ("quays", ("keys",), True),
        ("kitchne", ("kitchen",), True),
        ("cap", ("cup",), False),
        ("bell", ("ball",), False),
    ],
)
def test_a_word_that_is_not_known_is_matched_to_what_it_is_like(
    word: str, known: tuple[str, ...], is_sure: bool
) -> None:
    match = closest(word, KNOWN)
    assert match is not None
    assert (match.known, match.is_sure) == (known, is_sure)


@pytest.mark.parametrize("word", ["dinosaur", "moon", "cat", "dog", "knife", "gun", "stairs"])
def test_other_words_are_like_nothing(word: str) -> None:
    assert closest(word, KNOWN) is None
