"""Take a sentence apart: politeness off, a stop recognised, one clause for each thing to do."""

import re
from typing import Final

from vla_deploy.planning.references import words_of
from vla_deploy.planning.rules.figures import in_figures

MOST_LETTERS: Final = 400
# More clauses than that are no command that rules should answer.
MOST_CLAUSES: Final = 12
STOP_WORDS: Final = frozenset(
    {
        "stop", "halt", "freeze", "cancel", "abort", "stop now", "stop it", "stop moving",
        "stop there", "stop right there", "stop everything", "stop all", "never mind", "nevermind",
        "dont move", "do not move", "stand still", "hold still", "hold it", "emergency stop",
        "stop stop", "stop stop stop", "no stop", "whoa", "wait stop", "cancel it", "abort mission",
        "stop what you are doing", "stop what youre doing", "cancel everything", "stop at once",
        "stop immediately", "halt now", "freeze now", "enough",
    }
)  # fmt: skip
_POLITE_BEFORE: Final = re.compile(
    r"^(?:please|could you|can you|would you|will you|robot|butler|hey butler|hey robot|"
    r"okay butler|ok butler|hello butler|hi butler|hey|ok|okay|now|just|kindly|i want you to|"
    r"i would like you to|i'd like you to|i need you to|you should|you need to|you have to|you can|"
    r"let's|lets|let us|go ahead and|first(?: of all)?|would you mind|do me a favou?r and|"
    r"be so kind (?:and|as to)|be a dear and|how about you|how about|what about|"
    r"i was wondering if you (?:could|would)|i wonder if you (?:could|would)|"
    r"i'd (?:appreciate it|be (?:glad|happy|grateful)) if you(?:'d| would| could)|"
    r"i would (?:appreciate it|be (?:glad|happy|grateful)) if you(?:'d| would| could)|"
    r"what i (?:want|need) is for you to|possibly|so|well|quickly|maybe|perhaps|"
    r"go (?:and )?(?=(?:get|fetch|grab|pick|find|look|search|bring|take|put|tidy|clean|wait)\b)|"
    r"see if you can|go (?:and )?(?=(?:stand|park)\b)|try to|try and|start to|next|finally|also|"
    r"plus)\b[, ]*"
)
_POLITE_AFTER: Final = re.compile(
    r"[, ]*\b(?:please|thanks|thank you|now|right now|if you can|if you could|will you|"
    r"would you|could you|butler|robot|quickly|immediately|at once|instead|somewhere|anywhere|"
    r"for us)$|[.!?, ]+$"
)
# What likens a clause to another one, and says nothing where it can stand alone.
_ECHO: Final = re.compile(r"[, ]*\b(?:again|too|also|as well|likewise|once more|(?<!the )first)$")
_SPLIT: Final = re.compile(
    r"\s*(?:[,;.!?]?\s*\b(?:and then|and after that|after that|afterwards|then|and)\b|[,;]|[.!?]\s)"
    r"\s*"
)
# What people say while they think, and words said twice.
_FILLER: Final = re.compile(
    r",?\s*\b(?:um+|uh+|er+m?|hmm+|you know|like,|let me (?:think|see)(?=,)|"
    r"(?:what's|what is|what was|what are) (?:it|that|they|its name)(?: called)?(?: again)?(?=,)|"
    r"how do you (?:say|call it)|what do you call it|whatsit|whatchamacallit)"
    r"(?=[\s,.!?]|$),?\s*"
)
# How people run words together.
_FORMS: Final[tuple[tuple[re.Pattern[str], str], ...]] = tuple(
    (re.compile(rf"\b{pattern}\b"), full)
    for pattern, full in (
        ("gimme", "give me"), ("lemme have", "give me"), ("wanna", "want to"),
        ("gotta", "have to"), ("gonna", "going to"), ("outta", "out of"), ("'em", "them"),
    )
)  # fmt: skip
_TWICE: Final = re.compile(r"\b(\w+)(?: \1\b)+")
# Whole parts of a sentence that ask for nothing.
_COURTESY: Final = re.compile(
    r"(?:hello|hi|hey|good (?:morning|day|afternoon|evening))(?: there| robot| butler)?|"
    r"excuse me|pardon(?: me)?|thanks(?: .*)?|thank you(?: .*)?|cheers|please|"
    r"(?:if|when|whenever) you(?: don't mind|'re ready| are ready| have (?:a|the) (?:\w+))|"
    r"if it(?:'s| is) not too much trouble|if possible|you know what|listen"
)
# At the beginning these ask for nothing either; later on they are a side, and something to do.
_OPENING: Final = re.compile(r"right(?: then)?|look")
# Before these the speaker has changed his mind about what he has just said.
_REPAIR: Final = re.compile(
    r"(?:no,? wait|wait,? no|oh no|no|sorry|i (?:mean|meant|said)|or rather|rather|"
    r"actually(?:,? no)?|correction|make (?:that|it)|that is)\b"
)


def is_stop(text: str) -> bool:
    """Tell whether a command means: stop what you are doing."""
    if len(text) > MOST_LETTERS:
        return False
    said = " ".join(words_of(polite_off(text).replace("'", "")))
    urged = _URGED.sub("", said)
    is_halt = urged in _STOPS and urged.startswith(_HALTS)
    return said in _STOPS or is_halt or _STOP_DOING.fullmatch(urged) is not None


# What people say before it who want it now; "no, never mind" may still answer a question.
_URGED: Final = re.compile(r"^(?:(?:and|then|but|no|wait|oh|hey|i (?:said|say)|just|now) )+")
# "Stop driving to the kitchen", but not "stop looking and come here".
_STOP_DOING: Final = re.compile(
    r"(?:stop|quit|cease) (?!(?:any|some|every|no)thing)[a-z]{2,}ing\b"
    r"(?!.* (?:and|then|but|instead)\b).*"
)
_HALTS: Final = ("stop", "halt", "freeze", "dont move", "do not move", "hold still", "stand still")
_STOPS: Final = frozenset(" ".join(words_of(spoken)) for spoken in STOP_WORDS) | {"stop that"}


def polite_off(text: str) -> str:
    """Return a command in lower case without what only asks nicely, or likens it to another."""
    return _without(plain(text), (_POLITE_BEFORE, _POLITE_AFTER, _ECHO))


def courtesy_off(text: str) -> str:
    """Return a command in lower case without what only asks nicely; "again" and "too" stay."""
    return _without(plain(text), (_POLITE_BEFORE, _POLITE_AFTER))


def plain(text: str) -> str:
    """Return a text in lower case without hesitation, with words in full that were run together."""
    text = " ".join(_FILLER.sub(" ", text.lower().replace("\u2019", "'")).split())
    for pattern, full in _FORMS:
        text = pattern.sub(full, text)
    return in_figures(_TWICE.sub(r"\1", text))


def _without(text: str, patterns: tuple[re.Pattern[str], ...]) -> str:
    """Return a text without what any pattern finds in it, as long as words are left."""
    while True:
        before = text
        for pattern in patterns:
            text = pattern.sub("", text).strip() or text
        if text == before:
            return text


def segments(text: str) -> list[str]:
    """Return what stands between the conjunctions of a sentence, courtesies left out."""
    parts = [polite_off(part) for part in _SPLIT.split(text) if part.strip(" .!?,")]
    if len(parts) > 1 and _OPENING.fullmatch(parts[0]):
        parts = parts[1:]
    return [part for part in parts if not _COURTESY.fullmatch(part)] or parts


def repaired(part: str) -> str | None:
    """Return what a part says in the place of the one before ("" for what only begins to).

    None where it says something of its own.
    """
    changed = False
    while found := _REPAIR.match(part):
        part, changed = part[found.end() :].strip(" ,"), True
    return part if changed else None
