"""Refuse an answer that passes over what turns a command round: "rather than", "if", "no".

The model copies what it knows and has no field for such words, so a step made of the rest may do
the very thing that was not to be done. Reading that back would hide the word as well.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.command_parser.spans import copied_spans
from vla_deploy.planning.errors import CannotBeDone

# These only talk or stand; whatever was meant, nothing is moved by mistake.
_HARMLESS: Final = frozenset(
    {"say", "ask", "where", "wait", "stop", "nothing", "impossible", "unknown"}
)
_COPIED: Final = "~"
_BEGIN: Final = r"^(?:(?:please|butler|robot|hey|ok|okay|well|so|and|but|oh|no|sorry) )*"
_HOUR: Final = r"(?:one|two|three|four|five|six|seven|eight|nine|ten|eleven|twelve|noon|\d+)"
_SOME: Final = (
    rf"(?:an?|about|another|half|few|some|couple|the|{_HOUR}|fifteen|twenty|thirty|forty) "
)
_PERSON: Final = r"(?:i|we|he|she|they|someone|somebody|anyone|anybody|everyone|everybody|people)"
_WHO_IS: Final = (
    r"(?:i'm|i am|i was|i'll|i've|we're|we are|we were|we'll|we've|he's|he is|he was|she's|she is|"
    r"she was|they're|they are|they were)"
)
_DO: Final = r"(?:go|drive|move|bring|pick|take|put|find|fetch|get|place|grab|carry|turn)\b"
_DOING: Final = (
    r"(?:going|driving|moving|bringing|picking|taking|putting|finding|fetching|carrying|off)\b"
)
_DONE: Final = r"(?:went|drove|moved|brought|picked|took|put|found|placed|grabbed|carried|been)\b"
# What may stand before an "if" that asks to see whether something is so, or is polite.
_TO_SEE: Final = (
    "see", "check", "hear", "test", "look", "know", "wonder", "wondering", "appreciate it",
    "appreciate", "glad", "happy", "grateful", "tell me", "nice", "great", "good", "kind",
    "helpful", "lovely", "mind", "chance",
)  # fmt: skip
_TELLS: Final = "it tells or asks of something, instead of telling me to do it"
_WHEN: Final = "I do things at once, not at another time"
_ELSE: Final = "it is somebody else's words"
MOST_TELLING: Final = 9
"""In a sentence of more words a command may stand behind what tells, and is asked for."""
_IF: Final = "".join(rf"(?<!\b{word} )" for word in _TO_SEE) + (
    r"\bif (?!(?:i|we|he|she|they|it)\b.*\bso\b|you\b|"
    r"that's\b|it's (?:not|no)\b|i may\b|.*\bpossible\b)"
)
_SAID: Final[Mapping[str, tuple[str, ...]]] = {
    "it leaves something out": (
        r"\b(?:except|excepting|apart from|aside from|other than|rather than|instead of)\b",
        r"\b(?:any|anything|anywhere|every|everything|everywhere|all|somewhere)\b.*\bbut\b",
    ),
    "it says what not to do": (
        r"\b(?:avoid|avoiding|refrain|refuse|refusing|beware|dare|hands off|off limits)\b",
        rf"{_BEGIN}(?:do not|don't|dont|never)\b"
        r"(?! (?:forget|hesitate|worry|rush|hurry|drop|spill|break)\b)",
        rf"{_BEGIN}no \w+ing\b",
        rf"{_BEGIN}(?:forget|pretend|offer|promise|threaten) to\b",
        r"\bwithout (?:\w+ing )?(?:through |into |near )?(?:(?:the|a|an|my|your|our)\b|~)",
        r"(?<!\bi )(?<!\bwe )\b(?:stop|quit|cease) \w+ing\b|\bbut (?:stop|wait|halt)\b",
        r"\bleave (?:\w+ )*~(?: ~)* (?:where|alone|as)\b",
        r"\bcan't let\b|\b(?:wrong|terrible|stupid|bad|sad|annoyed|dangerous|pity|shame|"
        r"disaster)\b.*\bif you\b",
        r"\bnever\b|\b(?:must|should|can|could|may)(?:n't| not|not) be\b",
        r"\bmake sure\b.*(?:n't|\bnot|\bnever)\b",
        r"\b(?:forbidden|not allowed|by you)\b|\bno wait\b|\b(?:stopped|quit) \w+ing\b",
        r"\b(?:me|us|take|bring|up|put|fetch|get|grab) no ~",
    ),
    "I do things at once, not later, again and again, or under a condition": (
        _IF,
        r"\bas soon as (?!possible|you)|\bwhenever (?!you\b)",
        r"\b(?:unless|as long as|provided)\b",
        rf"{_BEGIN}(?:when|once|in case) (?:{_PERSON}|the|it|it's)\b",
        r"(?<!\blook )(?<!\bgo )\b(?:after|before) ~$",
        r"\b(?:tomorrow|someday|remind|reminder|twice|thrice|times)\b|^tonight\b",
        r"^(?!.*\bso (?:that )?(?:i|we)\b).*\blater(?: today)?$",
        r"\b(?:in|after|within|every) (?:\w+ ){0,3}(?:minutes?|seconds?|hours?|days?)$",
        rf"\b(?:in|after|every) {_SOME}(?:\w+ )?(?:minutes?|seconds?|hours?|days?)\b",
        rf"\bat (?:half past |quarter (?:past|to) )?{_HOUR}(?: o'clock)?$",
    ),
    _WHEN: (
        rf"\bafter (?:{_PERSON}|dinner|lunch|breakfast)\b|\btonight$",
        r"\bevery (?:single )?(?:night|day|morning|evening|week|hour|time)\b",
    ),
    "it is taken back": (
        r"^(?!.*\bback\b).*\bchanged my mind\b",
        r"\b(?:joking|kidding|didn't mean|i(?:'ve)? found it|i'll do (?:it|that)|can wait|"
        r"talking to you)\b",
    ),
    _ELSE: (
        r"\b(?:he|she|they|mum|dad|boss) (?:says?|said|tells?|goes|shouts?|shouted)\b|\bi told\b",
        r"\b(?:he|she|they) (?:thinks?|thought|claims?|believes?|insists?|reckons?)\b",
        r"\bsaid (?:my|the|he|she|our)\b|\bso (?:i|he|she|we|they) did\b",
        r"\bmy (?:wife|husband|mother|father|mum|dad|son|daughter|sister|brother) "
        r"(?:says?|claims?|thinks?|insists?)\b",
    ),
    "it says what not to do as well": (
        r"\b(?:but|and) (?:please )?(?:do not|don't|dont|never) "
        r"(?!drop|spill|break|bump|forget|worry|hurry|rush|lose|wake|hit|crash|fall|run|be)\w+",
    ),
    "my rules hold whatever is said": (
        r"\b(?:ignore|disregard|forget|override|overrule|bypass|disable|switch off|turn off)\b.*"
        r"\b(?:instructions?|rules?|orders?|limits?|limiters?|safety|safeties|checks?|restrictions?)\b",
    ),
    "I choose my speed myself": (r"\bper (?:second|minute|hour)\b",),
    _TELLS: (
        r"\byou (?:might|could|would|should|must) have (?!me\b|us\b|to\b|the\b|my\b|a\b)",
        rf"{_BEGIN}(?:have|has|had) (?:you|i|we|he|she|they) (?!seen|noticed|found)",
        rf"{_BEGIN}(?:did|was|were) (?:you|i|we|he|she|they) (?!see|notice|find)",
        rf"{_BEGIN}(?:when (?:will|would|do|did|are)|why|what if|what happens)\b",
        rf"{_BEGIN}how (?:do|did|can|would|will) (?:you|i|we) {_DO}",
        rf"{_BEGIN}(?:do you want|are you allowed) to {_DO}",
        rf"{_BEGIN}(?:should|does|did|was|were) (?:the\b|my\b|our\b|~)",
        r"\bshould have (?:gone|been)\b",
        rf"{_BEGIN}(?:are you|you are|you're|you were) {_DOING}",
        rf"{_BEGIN}(?:i|we|he|she|they)(?: have| had| did| just)? {_DONE}",
        rf"{_BEGIN}(?:i|he|she|they)(?: will| shall)? {_DO}",
        rf"{_BEGIN}{_WHO_IS} (?:just |only |not )?(?:{_DO}|{_DOING}|{_DONE})",
        r"^(?:i'm|i am|we're|we are) (?:in|at|on) (?:the )?~$",
        r"~ (?:went|fell) (?:in|on|to|into|onto)\b",
        r"\b(?:he|she|they|wife|husband|mother|father|mom|dad|boss) (?:told|asked|said)\b",
        rf"{_BEGIN}(?:tell|ask) (?!me\b|us\b|yourself\b)\w+ to\b",
    ),
}
# What mostly tells why, or speaks to somebody else, beside a command: its answer is read back.
_ASKED: Final = (
    r"\b(?:has|have|had) (?:\w+ )?been\b",
    r"\b(?:was|were|got|is|are|will be) (?:put|taken|brought|moved|placed|carried)\b",
    r"\b(?:he|she|they|wife|husband|mother|father|mom|dad|boss) wants\b",
    rf"\b(?:while|when|once|in case) (?:{_PERSON}|the|it|it's)\b",
    r"\b(?:until|till) (?!i |eye |you\b)|\btonight\b|\bif (?:i|we|he|she|they|it)\b",
    rf"\bbefore (?:{_PERSON}|dinner|lunch|breakfast)\b",
    r"\b(?:son|sonny|kids|children|guys|girls|boys|sit|(?:good|here|bad) (?:dog|boy|girl))\b",
)
_NOT_WHERE: Final = r"(?<!\bi )\b(?:leave|leaving|exit|vacate|away from|out of|clear of)"
# The same for some steps alone: "leave the cup on the table" puts it there.
_SAID_OF: Final = (
    ("go", "it says where not to be", rf"{_NOT_WHERE} (?:the |my |our |your )?~"),
    ("put", "it says where not to be", r"\baway from\b"),
    ("move", "that is farther than I drive", r"\b(?:kilomet(?:re|er)s?|kms?|miles?|blocks?)\b"),
    ("move", "I drive straight ahead, not to or from something", r"\btowards? (?!me\b|us\b)"),
    # What is heard of "no way".
    ("wait", "it tells of something, instead of telling me to do it", rf"{_BEGIN}know\b"),
)
# Sides that a sentence names, and steps have: "turn right and left" is two of them.
_SIDE: Final = re.compile(
    r"\bleft\b|(?<!all )\bright\b(?! now| away| there| here| then| in| on| at| up| over)"
)
_SIDEWAYS: Final = frozenset({"turn", "look", "move"})


@dataclass(frozen=True, slots=True)
class _Rule:
    """Hold what no answer with such a step may pass over, by why; "" stands for any step."""

    step: str
    why: str
    said: re.Pattern[str]


_RULES: Final = (
    *(_Rule("", why, re.compile(one)) for why, patterns in _SAID.items() for one in patterns),
    *(_Rule(step, why, re.compile(one)) for step, why, one in _SAID_OF),
)

_MAY_STAND_BEFORE: Final = frozenset({_TELLS, _WHEN, _ELSE})
# What is read back of some steps alone: "go to the table with the keys", "drive to the left".
_ASKED_OF: Final = (
    ("put", rf"{_BEGIN}(?:go|drive|head|roll|come)\b.*\bwith\b"),
    ("pick", rf"{_BEGIN}(?:go|drive|head|roll|come)\b.*\bwith\b"),
    ("move", r"\bto (?:the|your|my) (?:left|right)\b"),
    ("open", r"\b(?:over|above)\b"),
    ("turn", r"\b(?:all the way|complete(?:ly)?|whole|full|circle)\b"),
)
_DOUBTS: Final = (
    *(_Rule("", "", re.compile(one)) for one in _ASKED),
    *(_Rule(step, "", re.compile(one)) for step, one in _ASKED_OF),
    *(rule for rule in _RULES if rule.why in _MAY_STAND_BEFORE),
)


def is_doubtful(steps: Sequence[Step], command: Sequence[str]) -> bool:
    """Tell whether an answer that moves something passes over what may tell of it instead."""
    named = {step["do"] for step in steps}
    if named <= _HARMLESS:
        return False
    rest = _rest(steps, command)
    return any(rule.said.search(rest) for rule in _DOUBTS if rule.step in ("", *named))


def refuse_passed_over(steps: Sequence[Step], command: Sequence[str]) -> None:
    """Refuse an answer that passes over what changes its meaning, mostly if it moves something.

    Raises:
        CannotBeDone: it does; says over what.
    """
    named = {step["do"] for step in steps}
    moving, rest = named - _HARMLESS, _rest(steps, command)
    for rule in _RULES:
        concerned = rule.step in named if rule.step else bool(moving)
        if len(command) > MOST_TELLING and rule.why in _MAY_STAND_BEFORE:
            continue  # it is asked for
        found = rule.said.search(rest) if concerned else None
        if found:
            said = _shown(found, rest, command)
            raise CannotBeDone(f'I would pass over "{said}": {rule.why}; say just what to do now')
    if moving and moving <= _SIDEWAYS and len(_SIDE.findall(rest)) > len(steps):
        raise CannotBeDone("more sides were named than I understood; say one after the other")


def _rest(steps: Sequence[Step], command: Sequence[str]) -> str:
    """Return the command with a sign in the place of each word that a step has copied."""
    spans = [span for _, span in copied_spans(steps, command) if span is not None]
    copied = {place for span in spans for place in span.places}
    return " ".join(_COPIED if at in copied else word for at, word in enumerate(command))


def _shown(found: re.Match[str], rest: str, command: Sequence[str]) -> str:
    """Return the words of the command that a pattern found."""
    first = rest[: found.start()].count(" ")
    return " ".join(command[first : first + len(found[0].split())])
