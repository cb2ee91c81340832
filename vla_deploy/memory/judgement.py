"""Read what a person says of the last command: "that was wrong", "that was right"."""

import re
from dataclasses import dataclass
from typing import Final

from vla_deploy.memory.episode import EpisodeOutcome

MOST_CHARACTERS: Final = 200
"""Of the reason that is kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """Hold what a person says came of a command, and why."""

    outcome: EpisodeOutcome
    why: str = ""


# "That is wrong" objects to what goes on: `planning/patterns/steering.py`.
_THAT: Final = r"(?:no,? |oh,? |sorry,? |but )*(?:that|this|it|what you did) was"
_SAID: Final = (
    (
        EpisodeOutcome.FAILED,
        rf"(?:{_THAT} (?:all |quite |completely )?(?:wrong|a mistake|not (?:right|correct)|"
        r"not what i (?:meant|wanted|said|asked(?: you)? for))|"
        r"you (?:did|got|have done) (?:that|it|this) wrong)",
    ),
    (
        EpisodeOutcome.SUCCEEDED,
        rf"(?:{_THAT} (?:all |quite |just )?(?:right|correct|good|well done|what i wanted)|"
        r"you (?:did|got|have done) (?:that|it|this) (?:right|well))",
    ),
)
_PATTERNS: Final = tuple(
    (outcome, re.compile(rf"{said}(?: after all)?{tail}", re.IGNORECASE))
    for outcome, said in _SAID
    for tail in ("", r"[,:;.]? (?:because|since) (?P<why>.+)", r"[:;.] (?P<why>.+)")
)


def read_judgement(text: str) -> Judgement | None:
    """Return what a text says of the last command, None where it says something else."""
    said = " ".join(text.replace("\u2019", "'").split()).strip(" .!")
    for outcome, pattern in _PATTERNS:
        found = pattern.fullmatch(said)
        if found is not None:
            why = str(found.groupdict().get("why") or "")
            return Judgement(outcome=outcome, why=why[:MOST_CHARACTERS])
    return None
