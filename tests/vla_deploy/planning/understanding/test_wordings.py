import pytest

from vla_deploy.planning.understanding.wordings import reworded

FURNITURE = {"desk": "desk", "side table": "side_table", "book shelf": "shelf"}


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("the side table's green can", "green can on the side table"),
        ("the shelf's second bowl", "second bowl on the shelf"),
        ("the book i was reading", "the book"),
        ("the book i was reading on the desk", "the book on the desk"),
        ("the can that my wife left on the desk", "the can on the desk"),
        ("the phone that's charging in the kitchen", "the phone in the kitchen"),
        ("that favourite red cup of mine", "that red cup"),
        ("the bowl over by the side table", "the bowl on the side table"),
        ("the bowl by the green can", "the bowl next to the green can"),
        ("something to read", "a book"),
        ("the side tables green can", "green can on the side table"),
        ("my desk\u2019s lamp", "lamp on the desk"),
        ("the bottle that isn't empty", "the bottle that is not empty"),
        ("the one that's green", "the one that is green"),
        ("a non-white can", "a can that is not white"),
        ("the grey-coloured phone", "the grey phone"),
        ("the notebook with the pink cover", "pink the notebook"),
        ("the ball of yellow colour", "the ball yellow"),
        ("the can furthest away from you", "the can farthest to you"),
        ("the most distant bowl", "the farthest bowl"),
        ("the phone up on the shelf", "the phone on the shelf"),
        ("that remote on the desk there", "that remote on the desk"),
        ("this bowl over here", "this bowl"),
        ("the keys back out of the box", "the keys out of the box"),
        ("the bottle that is more small", "the bottle that is smaller"),
        ("whichever cup isn't on the desk", "the cup that is not on the desk"),
        ("something lying on the desk", "the thing on the desk"),
        ("the black thing you have in your left hand", "what you have in your left hand"),
        ("the phone that you're holding in your hand", "the phone"),
        ("the phone in your right hand", "the phone"),
        ("the box with the keys", "the box"),
    ],
)
def test_roundabout_words_become_plain(said: str, plain: str) -> None:
    assert reworded(said, FURNITURE) == plain


@pytest.mark.parametrize(
    "said",
    [
        "the bottle with the red lid",  # a lid tells nothing of the bottle
        "the desks on the left",
        "the red cup nobody wants moved",
        "the red one i mean the blue one",
        "the cup that we are not using",
        "anna's cup",  # nor does a person of where it is
        "the ball there",  # where, only a finger tells
        "the cup back there against the wall",
    ],
)
def test_what_may_mean_something_else_stays(said: str) -> None:
    assert reworded(said, FURNITURE) == said
