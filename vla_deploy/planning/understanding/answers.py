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

from vla_deploy.planning.understanding import answer_words
from vla_deploy.planning.understanding.answer_remarks import picked_beside
from vla_deploy.planning.understanding.conversation import Candidate, Conversation, Question
from vla_deploy.planning.understanding.known_words import known_words
from vla_deploy.planning.understanding.phrases import NUMBERS, SIDES
from vla_deploy.planning.understanding.questions import MOST_CHOICES, either, from_side
from vla_deploy.planning.understanding.wordings import in_plain_words
from vla_deploy.world.vocabulary import ARTICLES

Candidates = tuple[Candidate, ...]


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
    said = " ".join(answer_words.WORD.findall(text.lower()))
    if answer_words.NO_WORDS.fullmatch(said):
        return Verdict.NO, None
    if not question.candidates:
        return (Verdict.YES if answer_words.YES_WORDS.fullmatch(said) else Verdict.ANEW), None
    if answer_words.ANY_WORDS.fullmatch(said):
        return Verdict.CHOSEN, question.candidates[0]
    if answer_words.ALL_WORDS.fullmatch(said):
        return Verdict.UNCLEAR, None
    agrees = answer_words.YES_WORDS.fullmatch(said) is not None
    if agrees and len(question.candidates) == 1:
        return Verdict.CHOSEN, question.candidates[0]
    verdict, chosen = _judged(question.candidates, in_plain_words(text.lower()))
    if verdict is Verdict.ANEW:
        verdict, chosen = _beside_remarks(question.candidates, text.lower())
    # "right" is the one on the right where there is one; of several a yes picks none.
    return (Verdict.UNCLEAR if agrees and verdict is Verdict.ANEW else verdict), chosen


def _guessed(question: Question, text: str) -> Candidate | None:
    said = " ".join(answer_words.WORD.findall(in_plain_words(text.lower())))
    if not question.candidates or answer_words.NEGATES.search(said) or text.strip().endswith("?"):
        return None
    known = _known(question.candidates) | answer_words.COMPARING
    words = _telling(question.candidates, said)
    told = [word for word in words if word in known]
    if not told or any(word in known_words() - ARTICLES for word in words if word not in known):
        return None
    fitting = [one for one in question.candidates if one.features.issuperset(told)]
    return fitting[0] if len(fitting) == 1 else None


def _beside_remarks(candidates: Candidates, text: str) -> tuple[Verdict, Candidate | None]:
    """Let what some pieces of an answer pick count, if the others only tell."""
    chosen = picked_beside(
        answer_words.PIECE.split(text), lambda piece: _judged(candidates, piece)[1]
    )
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
    for piece in answer_words.PIECE.split(text):
        said = " ".join(answer_words.WORD.findall(piece))
        if answer_words.SURPRISE.fullmatch(said) and said not in SIDES:
            continue
        found = answer_words.NOT.fullmatch(said)
        if found is None:
            rest.append(said)
            continue
        named = [_telling(candidates, one) for one in answer_words.OR.split(found["not"])]
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
    called = (said, answer_words.TO.sub("", said))
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
    if not (_known(candidates) | answer_words.COMPARING).issuperset(words):
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
    said = answer_words.FROM_SIDE.sub(lambda found: from_side(found[1], found[2]), said)
    return [
        word
        for word in said.split()
        if word not in answer_words.SILENT or word in known - answer_words.FILL
    ]


def _place_of(candidates: Candidates, said: str, words: list[str]) -> int | None:
    """Return the place in the row that "the second" or "number two" names, or None."""
    number = re.fullmatch(r"(?:the )?(?:number|option) (\w+)", said)
    if number:
        return NUMBERS.get(number[1])
    apart = [word for word in words if not all(word in one.features for one in candidates)]
    return answer_words.PLACES.get(apart[0]) if len(apart) == 1 else None
