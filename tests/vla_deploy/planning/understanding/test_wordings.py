import pytest

from vla_deploy.planning.understanding.wordings import reworded

FURNITURE = {"desk": "desk", "side table": "side_table", "book shelf": "shelf"}


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("the side table's green can", "green can on the side table"),
        ("the book i was reading on the desk", "the book on the desk"),
        ("the phone that's charging in the kitchen", "the phone in the kitchen"),
        ("the bowl over by the side table", "the bowl on the side table"),
        ("the bottle that isn't empty", "the bottle that is not empty"),
        ("the grey-coloured phone", "the grey phone"),
        ("the can furthest away from you", "the can farthest to you"),
        ("that remote on the desk there", "that remote on the desk"),
        ("the bottle that is more small", "the bottle that is smaller"),
        ("the black thing you have in your left hand", "what you have in your left hand"),
        ("the box with the keys", "the box"),
    ],
)
def test_roundabout_words_become_plain(said: str, plain: str) -> None:
    assert reworded(said, FURNITURE) == plain


@pytest.mark.parametrize(
    "said",
    [
        "the bottle with the red lid",  # a lid tells nothing of the bottle
        "the red one i mean the blue one",
        "the cup back there against the wall",
    ],
)
def test_what_may_mean_something_else_stays(said: str) -> None:
    assert reworded(said, FURNITURE) == said
