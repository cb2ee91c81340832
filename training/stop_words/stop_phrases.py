"""Say in which phrases a stop word is spoken for the training."""

from typing import Final

ALONE: Final = ("{w}", "{w}!", "{w}.", "{w}?")
AT_THE_END: Final = (
    "please {w}",
    "robot {w}",
    "robot, {w}!",
    "hey robot {w}",
    "now {w}",
    "okay {w}",
    "no, {w}",
    "just {w}",
    "butler {w}",
    "you must {w}",
    "you have to {w}",
    "I want you to {w}",
    "I said {w}",
    "robot, please {w}",
    "all right, {w}",
    "go on and {w}",
    "{w}, {w}, {w}!",
    "{w} {w}",
)
AT_THE_START: Final = (
    "{w} now",
    "{w}, please",
    "{w} right there",
    "{w} right now",
    "{w} at once",
    "{w} immediately",
    "{w} robot",
    "robot {w} now",
    "please {w} right now",
)
GOES_ON: Final = (
    "{w} before you break something",
    "{w} before it falls",
    "{w} before anybody gets hurt",
    "{w} or it will fall over",
    "{w} where you are",
    "{w} when you get to the door",
    "{w} and wait for me",
    "{w} there is somebody behind you",
    "{w} because the baby is asleep",
    "you must {w} before you get there",
    "robot {w} or you will run into me",
)
"""In one breath with what comes next."""
STOP_AT_THE_END: Final = ("emergency {w}", "full {w}", "all {w}", "bus {w}", "do not {w}")
ONLY_STOP: Final = (
    "emergency {w} now",
    "{w} it",
    "{w} that",
    "{w} moving",
    "{w} the robot",
    "{w} the arm",
    "{w} driving",
    "{w} everything",
    "{w} what you are doing",
    "robot {w} moving",
    "would you {w} that please",
    "you have to {w} here",
)


def stop_phrases(word: str) -> tuple[tuple[str, bool], ...]:
    """Return the phrases with one word, each with whether the word comes last."""
    is_stop = word == "stop"
    last = (*ALONE, *AT_THE_END, *(STOP_AT_THE_END if is_stop else ()))
    others = (*AT_THE_START, *GOES_ON, *(ONLY_STOP if is_stop else ()))
    return (
        *((text.format(w=word), True) for text in last),
        *((text.format(w=word), False) for text in others),
    )
