"""Declare which keys the `[key_words]` table of a manifest has, and what it must fit."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from vla_deploy.robots.schema import (
    NUMBER,
    OPTIONAL_TABLE,
    POSITIVE,
    TABLE,
    TEXT,
    RobotFileFault,
    Shape,
    ValueCheck,
    check_record,
    is_number,
)

KEY_WORDS: Final = "key_words"
THRESHOLDS: Final = ("low", "normal", "high")
"""How easily a word is taken for said: high alarms at the slightest."""

_THRESHOLD: Final = ValueCheck(
    expected="a number above 0 and up to 1", holds=lambda value: is_number(value) and 0 < value <= 1
)
_SPOTTING: Shape = {
    "features": TEXT,
    "words": ValueCheck(
        expected="a list of words in small letters, none twice",
        holds=lambda value: (
            isinstance(value, list)
            and value != []
            and all(isinstance(one, str) and one.isalpha() and one.islower() for one in value)
            and len(set(value)) == len(value)
        ),
    ),
    "smoothing_frames": ValueCheck(
        expected="an integer in 1..50",
        holds=lambda value: (
            isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 50
        ),
    ),
    "refractory_s": POSITIVE,
    "thresholds": TABLE,
    "measured": OPTIONAL_TABLE,
}
_MEASURED: Shape = {"missed_ratio": NUMBER, "false_alarms_per_hour": NUMBER, "delay_p95_s": NUMBER}


def key_words_faults(key_words: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find every key of the table that is unknown, missing or wrong."""
    yield from check_record(key_words, KEY_WORDS, _SPOTTING)
    thresholds = key_words.get("thresholds")
    if isinstance(thresholds, dict):
        shape = dict.fromkeys(THRESHOLDS, _THRESHOLD)
        yield from check_record(thresholds, f"{KEY_WORDS}.thresholds", shape)
    if isinstance(key_words.get("measured"), dict):
        yield from check_record(key_words["measured"], f"{KEY_WORDS}.measured", _MEASURED)


def key_words_cross_faults(document: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find a spotter without its table, and one whose scores are not those of its words."""
    if document["role"] == KEY_WORDS and KEY_WORDS not in document:
        yield RobotFileFault(
            key=KEY_WORDS, got="nothing", expected="a table, as the role is key_words"
        )
    if KEY_WORDS not in document:
        return
    wanted = 1 + len(document[KEY_WORDS]["words"])
    shapes = [record["shape"] for record in document["outputs"]]
    if len(shapes) != 1 or len(shapes[0]) != 3 or shapes[0][1] != wanted:
        expected = f"one of shape [1, {wanted}, moments], none and each word"
        yield RobotFileFault(key="outputs", got=f"shapes {shapes}", expected=expected)
