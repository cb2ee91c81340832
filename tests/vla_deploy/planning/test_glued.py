import pytest

from vla_deploy.planning.glued import parted

PLACES = ("kitchen", "entrance", "coffee table")


@pytest.mark.parametrize(
    ("heard", "said"),
    [
        ("go to theentrance please", "go to the entrance please"),
        ("fish the keysout of the box", "fish the keys out of the box"),
        ("pointout the red can", "point out the red can"),
        ("take thered cup to mykitchen", "take the red cup to my kitchen"),
    ],
)
def test_words_that_were_run_into_one_are_parted(heard: str, said: str) -> None:
    assert parted(heard, PLACES) == said


@pytest.mark.parametrize("text", ["go to the kitchen", "outside", "another cup", "the theatre"])
def test_other_words_stay_whole(text: str) -> None:
    assert parted(text, PLACES) == text
