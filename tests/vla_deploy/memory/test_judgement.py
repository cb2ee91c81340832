"""What is a judgement of the last command, and what only sounds like one."""

import pytest

from vla_deploy.memory.episode import EpisodeOutcome
from vla_deploy.memory.judgement import read_judgement

WRONG, RIGHT = EpisodeOutcome.FAILED, EpisodeOutcome.SUCCEEDED


@pytest.mark.parametrize(
    ("text", "outcome", "why"),
    [
        ("That was wrong.", WRONG, ""),
        ("no, that was wrong because you took the blue one", WRONG, "you took the blue one"),
        ("That was not what I meant: the other box!", WRONG, "the other box"),
        ("you did that wrong", WRONG, ""),
        ("it was right after all", RIGHT, ""),
        ("you got it right", RIGHT, ""),
        # Objections to what goes on, and commands, are none.
        ("that is wrong", None, ""),
        ("wrong", None, ""),
        ("pick up what was wrong", None, ""),
        ("that was wrong, go to the kitchen", None, ""),
        ("", None, ""),
    ],
)
def test_a_text_is_read_as_a_judgement(text: str, outcome: EpisodeOutcome, why: str) -> None:
    found = read_judgement(text)
    assert (found and found.outcome, found.why if found else "") == (outcome, why)
