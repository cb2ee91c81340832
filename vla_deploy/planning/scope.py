"""Find the words of a command that change its scope, and see that no plan leaves one of them out.

One mechanism for every back end: a proposal says which of these words it covers. Of a plan that
moves anything and covers less the person is asked, with the words that it leaves out; where they
may turn the command round, it is declined.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from enum import StrEnum
from typing import Final

from vla_deploy.planning.errors import CannotBeDone
from vla_deploy.planning.interfaces import PlanRequest, Proposal
from vla_deploy.plans.catalogue import MOTIONLESS
from vla_deploy.plans.plan import Plan


class ScopeGroup(StrEnum):
    """Group the words by what they do to a command."""

    NEGATION = "negation"
    EXCEPTION = "exception"
    CONDITION = "condition"
    ALTERNATIVE = "alternative"
    QUANTITY = "quantity"


WORDS: Final[Mapping[ScopeGroup, frozenset[str]]] = {
    ScopeGroup.NEGATION: frozenset(
        {"not", "never", "no", "none", "nobody", "nothing", "nowhere", "without", "cannot", "avoid",
         "refrain", "neither", "nor", "forbidden"}
    ),
    ScopeGroup.EXCEPTION: frozenset(
        {"but", "except", "excepting", "excluding", "only", "instead", "rather", "besides", "apart",
         "aside", "than"}
    ),
    ScopeGroup.CONDITION: frozenset(
        {"if", "unless", "until", "till", "when", "whenever", "once", "before", "after", "while",
         "whether", "provided", "later", "tomorrow", "tonight", "afterwards", "every", "always",
         "o'clock", "noon", "midnight"}
    ),
    ScopeGroup.ALTERNATIVE: frozenset({"or", "either", "otherwise"}),
    ScopeGroup.QUANTITY: frozenset(
        {"all", "both", "each", "another", "again", "twice", "times", "everything"}
    ),
}  # fmt: skip
_GROUP: Final = {word: group for group, words in WORDS.items() for word in words}
IDIOMS: Final = re.compile(
    r"\b(?:if you(?:'d| would| could| can| please| don't| do not| like| want| wouldn't| have)"
    r"(?: not)?(?: (?:mind|please|like|a (?:moment|minute|second)|time))?|"
    r"if (?:possible|that's (?:ok|okay|all right))|no (?:problem|rush|hurry|worries)|"
    r"(?:don't|do not) (?:worry|rush|hurry|forget(?: to)?|drop (?:it|them|that))(?! about)|"
    r"when(?:ever)? you (?:can|have (?:a |the )?(?:moment|minute|second|time)|are (?:ready|free))|"
    r"all right|all the way|at once|once more|right away|as soon as (?:possible|you can)|"
    r"put (?:\w+ ){1,4}away|away with)\b"
)
"""What asks nicely, or says how, with such words in it."""
_PHRASES: Final = (
    (re.compile(r"\b(?:away from|clear of|hands off|(?:stay|keep|get|go) out of)\b"), " avoid "),
    (re.compile(r"\b(?:as long as|in case|as soon as)\b"), " if "),
    (re.compile(r"\b(?:in|within|after) (?:\w+ ){1,3}(?:minutes?|hours?|seconds?)\b"), " later "),
)
"""Some words together, and the one that does the same."""
_NOT: Final = re.compile(r"n't$|^dont$|^doesnt$|^cant$|^wont$|^isnt$")
_WORD: Final = re.compile(r"[a-z']+")
_CALLED: Final = re.compile(r"^\s*(?P<name>[a-z]+),\s")
_NOT_NAMES: Final = frozenset(
    {"robot", "butler", "please", "hey", "hello", "hi", "ok", "okay", "well", "so", "now", "no",
     "yes", "yeah", "right", "oh", "ah", "um", "uh", "er", "listen", "sorry", "thanks", "great",
     "good", "fine", "first", "then", "next", "actually", "also", "and", "wait", "look", "quick",
     "love", "dear", "darling", "mate", "sweetheart", "honey", "buddy", "pal", "friend", "finally",
     "today", "here", "alright", "perfect", "lovely", "stop", "left", "again", "one", "kitchen",
     "bedroom", "cup", "ball", "book", "bottle", "phone", "keys", "box", "bowl", "can", "remote"}
)  # fmt: skip
_DENIED: Final = re.compile(
    r"^(?:(?:please|robot|butler|hey|ok|okay|and|but|well|so|you|just|oh)[, ]+)*"
    r"(?:(?:do|must|should|can|could|may|need|will|would|shall)(?:n't| not)|dont|never|"
    r"no [a-z]+ing|not\b|avoid|refrain|stay|keep|hands off|nobody|nothing|neither)\b"
)
"""How a command begins that says what not to do."""


def scope_words(text: str) -> tuple[str, ...]:
    """Return the words of a command that change its scope, in their order, idioms left out."""
    said = _plain(text)
    called = _CALLED.match(said)
    name = called["name"] if called and called["name"] not in _NOT_NAMES else ""
    said = IDIOMS.sub(" ", said)
    for phrase, word in _PHRASES:
        said = phrase.sub(word, said)
    words = [word for word in _WORD.findall(said) if group_of(word) is not None]
    return (name, *words) if name else tuple(words)


def _plain(text: str) -> str:
    return text.lower().replace("’", "'")


def group_of(word: str) -> ScopeGroup | None:
    """Return what a word does to a command, None for nothing."""
    return ScopeGroup.NEGATION if _NOT.search(word) else _GROUP.get(word)


def negates(text: str) -> bool:
    """Return whether a word of a command turns it round."""
    return any(group_of(word) is ScopeGroup.NEGATION for word in scope_words(text))


def guarded(proposal: Proposal, request: PlanRequest) -> Proposal:
    """Return a proposal with the words that it leaves out, so that the person is asked.

    Raises:
        CannotBeDone: without them it may be the very thing that was not to be done.
    """
    covers = proposal.covers
    if covers is None or not moves_anything(proposal.plan):
        return proposal
    left_out = tuple(word for word in scope_words(request.text) if word not in covers)
    if not left_out:
        return proposal
    denies = any(group_of(word) is ScopeGroup.NEGATION for word in left_out)
    if denies and not proposal.knows_grammar and _DENIED.match(_plain(request.text)):
        raise CannotBeDone(f"I would leave out {quoted(left_out)}; say just what to do now")
    return replace(proposal, left_out=(*proposal.left_out, *left_out))


def moves_anything(plan: Plan) -> bool:
    """Return whether a plan moves more than the head."""
    return any(action.skill not in {*MOTIONLESS, "look_at"} for action in plan.actions)


def quoted(words: Iterable[str]) -> str:
    """Return words as one quotes them, each once."""
    return " and ".join(f'"{word}"' for word in dict.fromkeys(words))
