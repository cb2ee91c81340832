"""Say how sure an answer is: by the model's own doubt, and by what is odd about it."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.inference.manifest import Certainty
from vla_deploy.planning.command_parser.grammar import IMPLIED, Step
from vla_deploy.planning.command_parser.wording import copied_spans
from vla_deploy.world.vocabulary import COLOURS, OBJECT_CLASSES, SYNONYMS

# Said before the right words: what was said before them does not count any more.
_TAKEN_BACK: Final = frozenset(
    {
        "no", "not", "don't", "dont", "never", "actually", "sorry", "wait", "mean", "meant",
        "rather", "scratch", "instead", "correction", "forget", "without", "better",
    }
)  # fmt: skip
# Kinds of things that mean something else as often.
_OFTEN_OTHER: Final = frozenset({"can", "object", "book", "something", "thing"})
_TELLING: Final = frozenset({*OBJECT_CLASSES, *SYNONYMS, *COLOURS}) - _OFTEN_OTHER
# Words of a command that need no place in an answer: small words, courtesies, verbs. Every other
# word that no step has copied was left out, and the person is asked.
_SMALL: Final = (
    "the a an my your our his her their its this that these those some any it them him there here "
    "of to in on at by with from for into onto over up down out off back along near next beside "
    "behind front inside top around about through across between and then also too as so well "
    "just now right please thanks thank kindly i me we us you he she they i'm i'd i'll i've we're "
    "you're it's that's there's can could would will shall am is are be have has had do does did "
    "need want like what where's who which how where let's one ones thing things bit little"
)
_COURTESY: Final = (
    "robot butler hey hi hello ok okay oh um uh er erm hmm alright good great nice kind dear love "
    "mate friend sir favour favor moment minute second sec quick quickly slowly carefully gently "
    "yes yeah sure lovely mind possible possibly maybe perhaps chance cheers ta straight again "
    "today first finally able grateful glad appreciate so's though really"
)
_VERBS: Final = (
    "go come drive move head roll navigate return travel walk run visit approach make way "
    "pick grab take get lift grasp hold collect fetch catch reach keep bring carry deliver hand "
    "give pass put place set lay drop leave stick pop store stow stand throw toss tidy clear clean "
    "find look search locate seek hunt spot check see seen know tell show say announce repeat "
    "turn spin rotate face glance watch open close shut release let tuck fold rest wait stay pause "
    "stop help use try start"
)
FILLERS: Final = frozenset(f"{_SMALL} {_COURTESY} {_VERBS}".split())
"""They say nothing that a step could leave out; what changes a command's scope is none of them."""
_SAID_BY_STEP: Final[Mapping[str, frozenset[str]]] = {
    "pose": frozenset({"arm", "arms", "pose", "position", "posture"}),
}
"""Words that a step says by what it does, without a copy of them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Oddities:
    """Count what is odd: words never shown and not copied, words left out, words put together.

    `left_out` are colours and kinds of things that were said and are in no step, `jumps` words
    between those that were copied as one, `uncovered` all words that no step has copied and that
    are no fillers.
    """

    strange: int = 0
    left_out: int = 0
    jumps: int = 0
    uncovered: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Return those together by which doubt is weighed."""
        return self.strange + self.left_out + self.jumps


def oddities_of(steps: Sequence[Step], command: Sequence[str], known: Collection[str]) -> Oddities:
    """Compare an answer with the words that it was made of."""
    used: set[int] = set()
    copied: set[str] = set()
    jumps = 0
    for value, span in copied_spans(steps, command):
        words = value.split()
        copied.update(words)
        used.update(() if span is None else span.places)
        jumps += span.jumps if span is not None else int(value not in IMPLIED) * len(words)
    rest = [word for at, word in enumerate(command) if at not in used]
    is_corrected = any(word in _TAKEN_BACK for word in rest)
    said = copied.union(
        FILLERS,
        *(_SAID_BY_STEP.get(step["do"], ()) for step in steps),
        (step["arm"] for step in steps if "arm" in step),
    )
    return Oddities(
        strange=sum(word not in known and not word.isdecimal() for word in rest),
        left_out=0
        if is_corrected
        else sum(word in _TELLING and word not in copied for word in rest),
        jumps=0 if is_corrected else jumps,
        uncovered=tuple(word for word in rest if word not in said),
    )


def features_of(chosen: Sequence[float], oddities: Oddities) -> Mapping[str, float]:
    """Return what confidence is made of: doubt of the least sure token, mean doubt, oddities."""
    return {
        "least": min(chosen, default=0.0),
        "mean": sum(chosen) / len(chosen) if chosen else 0.0,
        "strange": float(oddities.count),
    }


def confidence_of(features: Mapping[str, float], weights: Certainty) -> float:
    """Return how likely an answer is right, 0 to 1."""
    score = (
        weights.bias
        + weights.least * features["least"]
        + weights.mean * features["mean"]
        + weights.strange * features["strange"]
    )
    return 1.0 / (1.0 + math.exp(-max(-50.0, min(50.0, score))))
