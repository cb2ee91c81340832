import pytest

from vla_deploy.planning.understanding.parting import Parted, Place, parted


@pytest.mark.parametrize(
    ("said", "own", "place"),
    [
        ("the second mug from the left", "mug", Place(number=2, side="left")),
        ("third bottle from right", "bottle", Place(number=3, side="right")),
        ("the bowl that is second from the left", "the bowl", Place(number=2, side="left")),
        ("the first from the right remote", "remote", Place(number=1, side="right")),
        ("the 2nd can along from the left hand side", "can", Place(number=2, side="left")),
        ("from the left the fourth ball", "ball", Place(number=4, side="left")),
        ("the last can on the right", "can", Place(number=1, side="right")),
        ("the last can from the left", "can", Place(number=-1, side="left")),
        ("the second ball from my left", "ball", Place(number=2, side="left", by_speaker=True)),
        ("the third red cup in the row", "red cup", Place(number=3)),
        ("phone number two", "phone", Place(number=2)),
        ("the second", "one", Place(number=2)),
        ("first the green ball", "first the green ball", None),
        ("the can on the left", "the can on the left", None),
        ("the second can to the left of the bowl", "can to the left of the bowl", Place(number=2)),
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
        ("the bowl which is not on the side table", "the bowl", ("on the side table",)),
        ("any can but the grey one", "any can", ("the grey one",)),
        ("all balls except for the pink or the white one", "all balls",
         ("the pink", "the white one")),
        ("something other than the phone", "something", ("the phone",)),
        ("the can but not the red one", "the can", ("the red one",)),
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
        ("the green one of those balls", Parted(own="the green balls", is_one_of=True)),
        ("the set of keys", Parted(own="the set of keys")),
        ("the can nearest to the bowl",
         Parted(own="the can", order="nearest", near="the bowl")),
        ("the one farthest from my phone",
         Parted(own="the one", order="farthest", near="my phone")),
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
