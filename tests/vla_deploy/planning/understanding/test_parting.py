import pytest

from vla_deploy.planning.understanding.parting import Parted, Place, parted


@pytest.mark.parametrize(
    ("said", "own", "place"),
    [
        ("the second mug from the left", "mug", Place(number=2, side="left")),
        ("the first from the right remote", "remote", Place(number=1, side="right")),
        ("the last can on the right", "can", Place(number=1, side="right")),
        ("first the green ball", "first the green ball", None),
        ("the can on the left", "the can on the left", None),
    ],
)
def test_a_place_in_a_row_is_parted_from_the_thing(
    said: str, own: str, place: Place | None
) -> None:
    assert parted(said) == Parted(own=own, place=place)


@pytest.mark.parametrize(
    ("said", "own", "besides"),
    [
        ("a bottle that is not green", "a bottle", ("green",)),
        ("all balls except for the pink or the white one", "all balls",
         ("the pink", "the white one")),
        ("the remote", "the remote", ()),
    ],
)  # fmt: skip
def test_what_it_is_not_is_parted_from_the_thing(
    said: str, own: str, besides: tuple[str, ...]
) -> None:
    assert parted(said) == Parted(own=own, besides=besides)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ("the taller of the two bottles",
         Parted(own="the taller bottles", is_one_of=True, among=2)),
        ("the can nearest to the bowl",
         Parted(own="the can", order="nearest", near="the bowl")),
        ("the nearest can", Parted(own="the nearest can")),
    ],
)  # fmt: skip
def test_what_it_is_compared_with_is_parted_from_the_thing(said: str, expected: Parted) -> None:
    assert parted(said) == expected


@pytest.mark.parametrize(
    ("said", "own", "between"),
    [
        ("the can between the cup and the bowl", "the can", ("the cup", "the bowl")),
        ("the one that is in between the cup & a red book", "the one", ("the cup", "a red book")),
        ("the thing standing between my phone and it", "the thing", ("my phone", "it")),
    ],
)
def test_what_a_thing_is_between_is_parted_from_it(
    said: str, own: str, between: tuple[str, str]
) -> None:
    assert parted(said) == Parted(own=own, between=between)
