"""What is to be done to a thing is a command to do it; what has been done to it is none."""

import pytest

from vla_deploy.planning.rules.passives import in_active_voice


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("the yellow bowl needs finding", "find the yellow bowl"),
        ("it has to be lifted", "lift it"),
        ("they need to be put away", "put them away"),
    ],
)  # fmt: skip
def test_what_is_to_be_done_is_done(said: str, meant: str) -> None:
    assert in_active_voice(said) == meant


@pytest.mark.parametrize(
    "said",
    [
        "the keys were left on the table",
        "don't you think the cup is broken",
        "he said the cup should be put away",
    ],
)
def test_what_has_happened_or_must_not_is_left_as_it_was_said(said: str) -> None:
    assert in_active_voice(said) == said
