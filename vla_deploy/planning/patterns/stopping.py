"""Recognise a command that only means: stop what you are doing."""

import re
from typing import Final

from vla_deploy.planning.patterns.phrase import courtesy_off
from vla_deploy.planning.plan import MOST_CHARACTERS

STOP_PHRASES: Final = frozenset(
    {
        "stop", "halt", "freeze", "cancel", "abort", "whoa", "enough", "emergency stop",
        "stop it", "stop that", "stop there", "stop right there", "stop moving", "stop all",
        "stop everything", "stop what you are doing", "stop what you're doing",
        "stop what youre doing", "hold it",
        "don't move", "do not move", "dont move", "stand still", "hold still", "cancel it",
        "cancel that", "cancel everything", "abort mission", "never mind", "nevermind", "forget it",
    }
)  # fmt: skip
# "Stop driving to the kitchen", but not "stop looking and come here".
_STOP_DOING: Final = re.compile(
    r"(?:stop|quit|cease) (?!(?:any|some|every|no)thing)[a-z]{2,}ing\b"
    r"(?!.* (?:and|then|but|instead)\b).*"
)
_SENTENCE: Final = re.compile(r"[.!?;,]+")
_URGING: Final = frozenset(
    {"and", "but", "no", "oh", "hey", "please", "robot", "butler", "just", "now", "wait", "i",
     "said", "say", "then", "immediately", "at", "once", "right"}
)  # fmt: skip


def is_stop(text: str) -> bool:
    """Return whether a command means: stop what you are doing."""
    if len(text) > MOST_CHARACTERS:
        return False
    bare = [_urged_off(courtesy_off(part)) for part in _SENTENCE.split(text)]
    return any(bare) and all(map(_is_stop, filter(None, bare)))


def _is_stop(said: str) -> bool:
    return said in STOP_PHRASES or _STOP_DOING.fullmatch(said) is not None


def _urged_off(text: str) -> str:
    words = text.split()
    while words and " ".join(words) not in STOP_PHRASES and words[0] in _URGING:
        words = words[1:]
    while words and " ".join(words) not in STOP_PHRASES and words[-1] in {*_URGING, "stop"}:
        words = words[:-1]
    return " ".join(words)
