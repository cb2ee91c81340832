"""Take what is said next as the answer to a question: "the red one", "left", "the second", "no".

expired, or words of something else   -> a command of its own
never mind, neither                   -> the waiting command is dropped
yes, for a question of yes or no      -> it goes on
words that one candidate alone has    -> that one
not the red one                       -> the one that is left
words that several have, or none      -> not clear: ask once more
"""

import re
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from vla_deploy.planning.understanding.answer_remarks import picked_beside
from vla_deploy.planning.understanding.conversation import Candidate, Conversation, Question
from vla_deploy.planning.understanding.known_words import known_words
from vla_deploy.planning.understanding.phrases import (
    EXTREMES,
    NUMBERS,
    ORDER_WORDS,
    ORDINALS,
    SIDES,
)
from vla_deploy.planning.understanding.questions import MOST_CHOICES, either, from_side
from vla_deploy.planning.understanding.wordings import in_plain_words
from vla_deploy.world.query import ORDERS
from vla_deploy.world.vocabulary import ARTICLES


class Verdict(StrEnum):
    """Say what an utterance is to a question."""

    YES = "yes"
    NO = "no"
    CHOSEN = "chosen"
    UNCLEAR = "unclear"
    ANEW = "anew"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """Say how an utterance goes on: `text` is what to plan, by `conversation`.

    `chosen` is the candidate that was picked. With the verdicts NO and UNCLEAR nothing is planned.
    """

    verdict: Verdict
    text: str
    conversation: Conversation
    chosen: Candidate | None = None


NO_WORDS: Final = re.compile(
    r"(?:no|nope|nah|never ?mind|forget (?:it|about it|that)|cancel|neither|none|nothing|"
    r"don'?t|do not|leave it|no thanks?|no thank you|"
    r"(?:none|neither|not any|nor any) of (?:them|those|these|the (?:two|three|four))|"
    r"neither (?:one|the one nor the other))(?: (?:one|please|thanks|thank you))*"
)
YES_WORDS: Final = re.compile(
    r"(?:yes|yeah|yep|yup|sure|ok|okay|right|correct|exactly|of course|please do|do it|do that|"
    r"go ahead|go on|confirm(?:ed)?|affirmative|that'?s right|that is right)"
    r"(?: (?:please|do it|do that|do|go ahead|that one|that'?s right))*"
)
ANY_WORDS: Final = re.compile(
    r"(?:either|any|whichever|any one|anyone|i don'?t care|doesn'?t matter|"
    r"it doesn'?t matter|you choose|your choice|whatever)(?: (?:one|of them|will do|is fine))*"
)
# Several, where one was asked for: no other command, and nothing that could be gone on with.
ALL_WORDS: Final = re.compile(
    r"(?:both|all|each|every one)(?: (?:of (?:them|those|these)|two|three))*"
)
# Places in the row of the candidates, from 1.
PLACES: Final = {**ORDINALS, "former": 1, "latter": 2}
# What says nothing of which one is meant.
_SILENT: Final = frozenset(
    {
        "the", "a", "an", "one", "ones", "please", "i", "mean", "meant", "want", "take", "pick",
        "it", "is", "its", "that", "this", "thing", "on", "in", "at", "to", "of", "with", "my",
        "your", "side", "and", "uh", "um", "er", "well", "just", "give", "me", "bring", "use",
        "from", "yes", "no", "rather", "other", "are", "which", "there", "over",
        "that's", "it's", "said", "oh", "sorry", "ah", "hm", "hmm", "actually", "thanks", "thank",
        "you", "cheers", "ta", "mate", "dear", "love", "one's", "i'd", "like", "would",
        "think", "was", "thinking", "meaning", "talking", "about", "then", "guess", "suppose",
        "two", "three", "those", "these", "should", "have", "had", "aye", "erm", "probably",
        "maybe", "course", "duh", "obviously", "if", "make", "there's", "isn't",
        "aren't", "question",
        "good", "for", "them", "we", "only", "let's", "pet", "alright",
    }
)  # fmt: skip
# Words of the questions themselves.
_FILL: Final = frozenset({"the", "one", "on", "in", "a", "an"})
Candidates = tuple[Candidate, ...]
WORD: Final = re.compile(r"[a-z0-9_']+")
_TO: Final = re.compile(
    r"^(?:(?:go |back |over )*(?:to|into|in|at|on|onto|by) )?(?:(?:the|my|your) )?"
)
_PIECE: Final = re.compile(r"\s*(?:[,;.!?]|\s-+\s)\s*")
_NOT: Final = re.compile(
    r"(?:no )?(?P<any>(?:any|either|anything|whichever)(?: one| of them)? )?(?:the one )?"
    r"(?:but not|but|not|except|other than|apart from|(?:that |which )?is(?:n'?t| not)|"
    r"(?:you can )?(?:leave|keep|hang on to|hold on to)|"
    r"i (?:don'?t|do not) (?:want|mean)) (?P<not>.+?)(?: alone| where it is)?(?: but (?P<rest>.+))?"
)
# What people say when they are asked, before they answer.
_SURPRISE: Final = re.compile(
    r"(?:oh |ah |well |hm )*"
    r"(?:there(?:'s| is| are| were)|you(?:'ve| have)(?: got)?|i see|are there) "
    r"(?:two|three|four|several|both|more(?: than one)?)(?: of (?:them|those|these))?(?: there)?|"
    r"(?:(?:is|are) not|isn't|aren't|wasn't|haven't|hasn't) (?:there|it|they|you|we|i)|"
    r"(?:(?:oh|ah|well|hm|good (?:question|point)|fair (?:enough|point)|my mistake|right|sorry)"
    r"\b ?)+"
)
_NEGATES: Final = re.compile(
    r"\b(?:not|no|never|neither|nor|but|except|what|where|why|how|who|avoid|beside|besides|instead|"
    r"without|hardly|forget|hate|dislike|wrong|out|if|when|later|tomorrow|do you|are "
    r"you)\b|n't\b|^(?:is|are|was|does|did)\b"
)
_OR: Final = re.compile(r" (?:or|nor|and)(?: not)? ")
# Words of an answer even where they tell no candidate from the others.
_COMPARING: Final = frozenset({*EXTREMES, *SIDES, *ORDERS, *ORDER_WORDS, *ORDINALS, "furthest"})
_FROM_SIDE: Final = re.compile(
    rf"\b({'|'.join(ORDINALS)})(?: one)?(?: counting| counted)? (?:from|on) (?:the )?(left|right)\b"
)


def reply(conversation: Conversation, text: str, now_ns: int) -> Reply:
    """Read an utterance in the light of the question that waits, if one does."""
    question = conversation.question
    free = conversation.settled()
    if question is None or not question.is_open(now_ns):
        return Reply(verdict=Verdict.ANEW, text=text, conversation=free)
    verdict, chosen = judge_answer(question, text)
    if verdict is Verdict.ANEW:
        return Reply(verdict=verdict, text=text, conversation=free)
    if verdict is Verdict.UNCLEAR:
        again = replace(conversation, question=replace(narrowed(question, text), asked_ns=now_ns))
        return Reply(verdict=verdict, text=question.command_text, conversation=again)
    return _going_on(conversation, question, verdict, chosen)


def guess(conversation: Conversation, text: str) -> Reply | None:
    """Return the reply that picks the one candidate which an answer calls, whatever else it says.

    "The green, my oil". None where a word of it could mean another thing. Ask first whether it is a
    command.
    """
    question = conversation.question
    chosen = None if question is None else _guessed(question, text)
    if question is None or chosen is None:
        return None
    return _going_on(conversation, question, Verdict.CHOSEN, chosen)


def _going_on(
    conversation: Conversation, question: Question, verdict: Verdict, chosen: Candidate | None
) -> Reply:
    """Return the reply by which the waiting command goes on, with what it settles."""
    choices = dict(question.choices)
    if chosen is not None:
        choices[question.expression] = chosen.name
    return Reply(
        verdict=verdict,
        text=question.command_text,
        conversation=conversation.settled(choices),
        chosen=chosen,
    )


def judge_answer(question: Question, text: str) -> tuple[Verdict, Candidate | None]:
    """Return what an utterance is to a question, and the candidate that it picks."""
    said = " ".join(WORD.findall(text.lower()))
    if NO_WORDS.fullmatch(said):
        return Verdict.NO, None
    if not question.candidates:
        return (Verdict.YES if YES_WORDS.fullmatch(said) else Verdict.ANEW), None
    if ANY_WORDS.fullmatch(said):
        return Verdict.CHOSEN, question.candidates[0]
    if ALL_WORDS.fullmatch(said):
        return Verdict.UNCLEAR, None
    agrees = YES_WORDS.fullmatch(said) is not None
    if agrees and len(question.candidates) == 1:
        return Verdict.CHOSEN, question.candidates[0]
    verdict, chosen = _judged(question.candidates, in_plain_words(text.lower()))
    if verdict is Verdict.ANEW:
        verdict, chosen = _beside_remarks(question.candidates, text.lower())
    # "right" is the one on the right where there is one; of several a yes picks none.
    return (Verdict.UNCLEAR if agrees and verdict is Verdict.ANEW else verdict), chosen


def _guessed(question: Question, text: str) -> Candidate | None:
    said = " ".join(WORD.findall(in_plain_words(text.lower())))
    if not question.candidates or _NEGATES.search(said) or text.strip().endswith("?"):
        return None
    known = _known(question.candidates) | _COMPARING
    words = _telling(question.candidates, said)
    told = [word for word in words if word in known]
    if not told or any(word in known_words() - ARTICLES for word in words if word not in known):
        return None
    fitting = [one for one in question.candidates if one.features.issuperset(told)]
    return fitting[0] if len(fitting) == 1 else None


def _beside_remarks(candidates: Candidates, text: str) -> tuple[Verdict, Candidate | None]:
    """Let what some pieces of an answer pick count, if the others only tell."""
    chosen = picked_beside(_PIECE.split(text), lambda piece: _judged(candidates, piece)[1])
    return (Verdict.ANEW if chosen is None else Verdict.CHOSEN), chosen


def _judged(candidates: Candidates, text: str) -> tuple[Verdict, Candidate | None]:
    """Take what is said not to be meant from the candidates; let the rest pick one of those left.

    Where it is said to be any of them, it is the first.
    """
    remaining = _remaining(candidates, text)
    if isinstance(remaining, Verdict):
        return remaining, None
    left, said, any_will_do = remaining
    if len(left) == len(candidates):
        return _picked(candidates, said)
    if not left:
        return Verdict.NO, None
    if _telling(candidates, said):
        return _picked(left, said)
    is_clear = any_will_do or len(left) == 1
    return (Verdict.CHOSEN, left[0]) if is_clear else (Verdict.UNCLEAR, None)


def _remaining(candidates: Candidates, text: str) -> tuple[Candidates, str, bool] | Verdict:
    """Return the candidates that are not ruled out, what is said besides, and if any will do.

    Return what the whole is instead where something unknown is ruled out.
    """
    left, rest, any_will_do = list(candidates), list[str](), False
    for piece in _PIECE.split(text):
        said = " ".join(WORD.findall(piece))
        if _SURPRISE.fullmatch(said) and said not in SIDES:
            continue
        found = _NOT.fullmatch(said)
        if found is None:
            rest.append(said)
            continue
        named = [_telling(candidates, one) for one in _OR.split(found["not"])]
        if not all(words and _known(candidates).issuperset(words) for words in named):
            return Verdict.ANEW if all(named) else Verdict.UNCLEAR
        left = [one for one in left if not any(one.features.issuperset(it) for it in named)]
        rest.append(found["rest"] or "")
        any_will_do = any_will_do or bool(found["any"])
    return tuple(left), " ".join(part for part in rest if part), any_will_do


def narrowed(question: Question, text: str) -> Question:
    """Return the question without the candidates that an answer rules out, where several are left.

    "not the blue one", to "the red one, the blue one or the white one?" -> "the red one or the
    white one?".
    """
    remaining = _remaining(question.candidates, text.lower())
    if isinstance(remaining, Verdict) or len(remaining[0]) < 2:
        return question
    left = remaining[0]
    before, after = (
        either([one.words for one in some[:MOST_CHOICES]]) for some in (question.candidates, left)
    )
    return replace(question, text=question.text.replace(before, after), candidates=left)


def _picked(candidates: Candidates, said: str) -> tuple[Verdict, Candidate | None]:
    called = (said, _TO.sub("", said))
    by_name = [one for one in candidates if one.name in called or _spoken(one) in called]
    if len(by_name) == 1:
        return Verdict.CHOSEN, by_name[0]
    words = _telling(candidates, said)
    place = _place_of(candidates, said, words)
    if place is not None:
        in_row = place <= len(candidates)
        at = place - 1 if place > 0 else place
        return (Verdict.CHOSEN, candidates[at]) if in_row else (Verdict.UNCLEAR, None)
    if not words:
        return Verdict.UNCLEAR, None
    if not (_known(candidates) | _COMPARING).issuperset(words):
        return Verdict.ANEW, None
    fitting = [one for one in candidates if one.features.issuperset(words)]
    return (Verdict.CHOSEN, fitting[0]) if len(fitting) == 1 else (Verdict.UNCLEAR, None)


def _spoken(candidate: Candidate) -> str:
    return candidate.name.replace("_", " ")


def _known(candidates: Candidates) -> frozenset[str]:
    return frozenset[str]().union(*(one.features for one in candidates))


def _telling(candidates: Candidates, said: str) -> list[str]:
    """Return the words of an answer that may tell candidates apart."""
    known = _known(candidates)
    said = _FROM_SIDE.sub(lambda found: from_side(found[1], found[2]), said)
    return [word for word in said.split() if word not in _SILENT or word in known - _FILL]


def _place_of(candidates: Candidates, said: str, words: list[str]) -> int | None:
    """Return the place in the row that "the second" or "number two" names, or None."""
    number = re.fullmatch(r"(?:the )?(?:number|option) (\w+)", said)
    if number:
        return NUMBERS.get(number[1])
    apart = [word for word in words if not all(word in one.features for one in candidates)]
    return PLACES.get(apart[0]) if len(apart) == 1 else None
