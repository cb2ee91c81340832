import pytest

from vla_deploy.planning.understanding.names import Likeness, closest, edit_distance, phonetic_key
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
    ("one", "other"),
    [("phone", "fone"), ("keys", "quiz"), ("cup", "kup"), ("box", "bocks"), ("bottle", "botel"),
     ("write", "right"), ("kitchen", "kichen")],
)  # fmt: skip
def test_words_that_sound_alike_share_a_key(one: str, other: str) -> None:
    assert phonetic_key(one) == phonetic_key(other)


@pytest.mark.parametrize(
    ("word", "known", "likeness", "is_sure"),
    [
        ("cup", ("cup",), Likeness.SAME, True),
        ("quays", ("keys",), Likeness.SOUNDS_SAME, True),
        ("bell", ("ball", "bowl"), Likeness.SOUNDS_ALIKE, False),
    ],
)
def test_a_word_that_is_not_known_is_matched_to_what_it_is_like(
    word: str, known: tuple[str, ...], likeness: Likeness, is_sure: bool
) -> None:
    match = closest(word, KNOWN)
    assert match is not None
    assert (match.known, match.likeness, match.is_sure) == (known, likeness, is_sure)


@pytest.mark.parametrize("word", ["dinosaur", "moon", "cat", "dog", "knife", "gun", "stairs"])
def test_other_words_are_like_nothing(word: str) -> None:
    assert closest(word, KNOWN) is None
