"""What is remembered, in sentences."""

import pytest

from vla_deploy.memory import Episode, EpisodeOutcome, LastSeen
from vla_deploy.memory.episode import ago, place_words, sentence_of


@pytest.mark.parametrize(
    ("elapsed_s", "words"),
    [
        (-5.0, "just now"),
        (59.0, "just now"),
        (60.0, "1 minute ago"),
        (7199.0, "1 hour ago"),
        (7200.0, "2 hours ago"),
        (86_400.0 * 400, "400 days ago"),
    ],
)
def test_how_long_ago_something_was(elapsed_s: float, words: str) -> None:
    assert ago(elapsed_s) == words


def test_an_episode_in_a_sentence() -> None:
    failed = Episode(
        told_s=0.0, command="go", outcome=EpisodeOutcome.FAILED, error="the way is blocked"
    )
    said = sentence_of(failed, 120.0)
    assert said == '2 minutes ago I was told "go" and it failed: the way is blocked.'


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("coffee_table", "I saw the grey keys at the coffee table, 1 hour ago."),
        ("floor near kitchen", "I saw the grey keys on the floor near the kitchen, 1 hour ago."),
    ],
)
def test_where_a_thing_was(place: str, words: str) -> None:
    keys = LastSeen(
        run_id="r",
        thing_id="keys_1",
        kind="keys",
        colour="grey",
        place=place,
        position_m=(0.0, 0.0, 0.0),
        seen_s=0.0,
    )
    assert place_words(keys, 3600.0) == words
