"""Take out the commas that are only a breath: nothing ends behind "the", "to", or "the red".

A recogniser writes one wherever a speaker pauses.
"""

import re
from typing import Final

from vla_deploy.planning.understanding.phrases import EXTREMES, ORDINALS
from vla_deploy.world.vocabulary import COLOURS, KIND_WORDS

_UNFINISHED: Final = (
    "the|a|an|my|your|our|his|her|its|to|into|in|inside|on|onto|from|of|with|by|for|at|and|or|"
    "then|but|than|near|under|behind|beside|is|are|was|both|all|every|each|next to"
)
_VERBS: Final = (
    "bring|give|get|fetch|pick|take|put|grab|find|collect|lift|place|drop|carry|hand|pass|open|"
    "close|pick up|put down|get me|look for|look at|go to|bring me|give me|fetch me|hand me|"
    "pass me|tell me|tell"
)
_TELLS: Final = "|".join((*COLOURS, *EXTREMES, *ORDINALS, "big", "small", "tall", "other", "grey"))
# A comma goes with what follows it, or stands behind `own`, which nothing ends with.
_ROWS: Final = (
    rf"\b(?P<own>{_UNFINISHED}),+ ?(?=[a-z])",
    rf"(?:^|(?<= ))(?P<own>{_VERBS}),+ ?(?=(?:the|a|an|my|your|that|this|me|it|all|both)\b)",
    rf"\b(?P<own>{_TELLS}),+ ?(?=(?:{KIND_WORDS}|thing|one)s?\b)",
    r"\b(?P<own>kitchen|coffee|side|bedside|bed),+ ?(?=table\b)",
    r"\b(?P<own>left|right),+ ?(?=(?:hand|arm|gripper)\b)",
    r"\b(?P<own>(?:after|once|when) you),+ ?(?=[a-z])",
    r"\b(?P<own>no|wait|sorry),+ ?(?=(?:no|wait|sorry)\b)",
    r"(?P<own>),+ ?(?=(?:in|into|inside|on|onto|from|out of|off|with|next to|beside|near|"
    r"through) "
    r"(?:the|my|your|a|that)\b)",
    r"(?P<own>),+ ?(?=(?:that|which) (?:is|are|was)\b)",
    r"(?<=[a-z])(?P<own>),(?=[a-z])",
    r"(?P<own>\b(?:bring|take|carry|move|put|get|fetch|return|deliver) "
    r"(?:the|my|that|it|a|your)\b(?:(?!\b(?:to|in|on|into|onto|and|then)\b)[a-z' ])*),+ ?"
    r"(?=to (?:the|my|me|your)\b)",
)
_BREATHS: Final = tuple(re.compile(pattern) for pattern in _ROWS)


def without_breaths(text: str) -> str:
    """Return a text in small letters without commas where no thought can end."""
    for pattern in _BREATHS:
        text = pattern.sub(r"\g<own> ", text)
    return text
