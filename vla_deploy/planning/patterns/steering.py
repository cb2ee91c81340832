"""Recognise words that steer what goes on instead of asking for something.

Some only mean: stop what you are doing. Others object to it, or hold a plan until a word is said:
"when I say so", "not before I call".
"""

import re
from typing import Final

from vla_deploy.client.command_record import MOST_CHARACTERS
from vla_deploy.planning.patterns.phrase import courtesy_off
from vla_deploy.planning.scope import IDIOMS

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
_ALONE: Final = r"(?!.* (?:and|then|but|instead)\b)"
_STOP_DOING: Final = re.compile(
    rf"(?:stop|quit|cease) (?!(?:any|some|every|no)thing)[a-z]{{2,}}ing\b{_ALONE}.*"
)
_DO_NOT: Final = (
    "(?:do not|don't|dont|not the|you (?:must not|mustn't|should not|shouldn't|may not))"
)
_NO_THING: Final = r"(?:no|nope|wrong) (?:the|my|your|that|an?)\b"
# "Don't stop" is no objection; "don't worry" and "don't drop it" are idioms.
_DENIES: Final = re.compile(
    rf"(?:i said )?(?:{_DO_NOT}\b(?! (?:stop|you)\b)|(?:stop|halt|freeze)\b|{_NO_THING}).*"
)
_OBJECTS: Final = re.compile(
    rf"{_ALONE}{_DENIES.pattern}|no(?: no)*|nope|"
    r"not (?:that|this|it|there|like that|now)(?: one)?|leave (?:it|that|them)(?: alone| be)?|"
    r"(?:that's |that is )?(?:the )?(?:wrong(?: one)?|not (?:it|right))|"
    r"(?:wait|hold on|hang on|pause)(?: a (?:second|moment|minute|bit))?"
)
_MOMENT: Final = r"(?: (?:for )?(?:a|one|just a) (?:second|sec|moment|minute|bit))?"
_PAUSES: Final = re.compile(rf"(?:wait|hold on|hang on|pause|stand by){_MOMENT}(?: there)?")
_RESUMES: Final = re.compile(
    r"(?:resume|continue|carry on|keep going|go on|go ahead|proceed)(?: (?:now|with (?:it|that)))?"
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
    return any(bare) and all(
        part in STOP_PHRASES or _STOP_DOING.fullmatch(part) for part in bare if part
    )


def pauses(text: str) -> bool:
    """Return whether words mean: come to rest, and go on later from there."""
    return _is_all(text, _PAUSES)


def resumes(text: str) -> bool:
    """Return whether words mean: go on with what was paused."""
    return _is_all(text, _RESUMES)


def _is_all(text: str, pattern: re.Pattern[str]) -> bool:
    said = " ".join(text[:MOST_CHARACTERS].lower().replace(",", " ").split())
    bare = [courtesy_off(part) for part in _SENTENCE.split(said)]
    return any(bare) and all(pattern.fullmatch(part) for part in bare if part)


def objects(text: str) -> bool:
    """Return whether words begin by an objection: "no!", "wait", "don't pick it up", "no, that"."""
    pieces = _objecting(text)
    return denies(text) or (bool(pieces) and _OBJECTS.fullmatch(pieces[0]) is not None)


def denies(text: str) -> bool:
    """Return whether a command begins by what is not to be done: "stop this", "don't do that"."""
    pieces = _objecting(text)
    return bool(pieces) and _DENIES.fullmatch(pieces[0]) is not None


def only_objects(text: str) -> bool:
    """Return whether there is nothing in such words besides that could be done."""
    pieces = _objecting(text)
    return bool(pieces) and all(map(_OBJECTS.fullmatch, pieces))


def _objecting(text: str) -> list[str]:
    said = IDIOMS.sub(" ", text.lower().replace("\u2019", "'"))
    bare = (courtesy_off(part) for part in _SENTENCE.split(said[:MOST_CHARACTERS]))
    without = (
        re.sub(rf"^(?!{_NO_THING})(?:(?:no|oh|and|but|hey) )+(?=\w)", "", part) for part in bare
    )
    return [part for part in without if part]


def _urged_off(text: str) -> str:
    words = text.split()
    while words and " ".join(words) not in STOP_PHRASES and words[0] in _URGING:
        words = words[1:]
    while words and " ".join(words) not in STOP_PHRASES and words[-1] in {*_URGING, "stop"}:
        words = words[:-1]
    return " ".join(words)


# --- words by which a plan waits for a word, and that word ----------------------------------------

_WORD: Final = (
    r"i (?:say (?:so|go|now|when|the word)|tell you(?: to| so)?|give (?:you )?the (?:word|sign|"
    r"signal|go-ahead)|call(?: you)?|ask you(?: to)?)"
)
_WHEN: Final = (
    r"(?:but )?(?:only )?(?:when(?:ever)?|as soon as|the (?:moment|instant|minute|second)|once|"
    r"after|not (?:before|until|till)) " + _WORD
)
_ORDERS: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        # "When I tell you to go to bed, ..." waits for something else.
        rf"(?:please,? )?{_WHEN}(?:,? then|[,:]|(?<! to)) (?P<rest>(?!to ).+)",
        rf"(?:please )?wait (?:until|till) {_WORD}(?:,? and(?: then)?|,? then|,) (?P<rest>.+)",
        rf"(?P<rest>.+?),? {_WHEN}",
    )
)


def awaiting(text: str) -> str | None:
    """Return what a command wants done at a word, None for a command that waits for none."""
    said = " ".join(text.split()).strip(" .!")
    found = (order.fullmatch(said) for order in _ORDERS)
    return next((one["rest"] for one in found if one), None)


# A mere "yes", "okay" or "right" is said to other people, too, and for an hour.
_BEGINS: Final = re.compile(r"(?:now )?(?:go|go ahead|go on|do it|start|begin)(?: now)?|now")
_AROUND: Final = re.compile(
    r"[,.!]|\b(?:yes|yeah|yep|sure|ok|okay|right|alright|please|then|hey|robot|butler)\b"
)


def is_word(text: str) -> bool:
    """Return whether an utterance is the word that begins a held plan."""
    said = " ".join(_AROUND.sub(" ", text.lower()).split())
    return _BEGINS.fullmatch(said) is not None
