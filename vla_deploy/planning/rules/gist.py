"""Find what a command comes down to: what asks for something, without what is told beside it.

"We're done with the film, so the remote can go in the box" asks for one thing, and "my phone's on
the table, could you run and get it" for another, of which the first half tells what and where it
is. Rules know few ways to tell things, and people know many: whatever has a subject and asks for
nothing is taken for one. What forbids, sets a condition or passes on somebody's words is none.
"""

import re
from collections.abc import Sequence
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.references import words_of
from vla_deploy.planning.rules.building import is_one
from vla_deploy.planning.rules.clauses import MOST_LETTERS, plain, segments
from vla_deploy.planning.rules.fits import known_fit
from vla_deploy.planning.rules.lending import KIND, NAMED, POINTS, kinds_told, things_told
from vla_deploy.planning.rules.recalling import points_back
from vla_deploy.planning.rules.unsaying import unsays
from vla_deploy.planning.rules.verbs import any_verb
from vla_deploy.planning.understanding.known_words import is_kind, single
from vla_deploy.planning.understanding.phrases import ORDINALS, PRONOUNS, SIDES
from vla_deploy.world.vocabulary import COLOURS

_DOING: Final = any_verb("search", "clean", "follow", "switch", "start", "lift", "grab", "carry")
_SO: Final = re.compile(
    r"[,:;]? (?:and )?so (?=(?:please |just |kindly )*"
    rf"(?:would|could|can|will|i'd|i would|i want|i need|the|my|that|{_DOING})\b)|: "
)
_SUBJECT: Final = re.compile(
    r"(?:(?:and|but|because|since|as|for|now|oh|well|ah|today|tonight|also|so|only|though) )*"
    r"(?:(?:i|we|you|he|she|it|they|there|that|this|these|those|nobody|somebody|someone|everybody|"
    r"everyone|who|what|which|why|how come|mr|mrs|ms|dr)\b.*"
    r"|(?:the|my|our|your|his|her|a|an|some|all|both|[a-z]+'s) .*"
    r"(?:'s|'re|'ve|'ll|\b(?:is|are|was|were|am|has|have|had|will|would|can|could|needs?|wants?|"
    r"got|gets?|goes|comes?|came|went|left|keeps?|likes?|looks?|makes?|says?|lives?|belongs?|"
    r"\w+ed|\w+ing))\b.*)"
)
# Any other subject, where its verb tells that it is one: "assembly starts at nine".
_FINITE: Final = re.compile(
    rf"(?!(?:{_DOING}|please|do|don't|let|make|use|go|wipe|wash|play|call|cook|switch|follow|try)\b)"
    r"\w+(?: \w+){0,3}?(?:'s| (?:is|are|was|were|am|has|have|had|will|starts?|begins?|ends?|comes?|"
    r"needs?|wants?|likes?|looks?|gets?|rings?|rests?|waits?|tips?))\b.*"
)
# What is chosen from, or how much is coming.
_OF_SEVERAL: Final = re.compile(
    r"(?:of|from|out of|among|(?:can you |do you )?see|choose|select) (?:all )?(?:the|those|"
    r"these) .+|(?:one|two|three|a (?:few|couple of)) (?:\w+ )?(?:jobs?|things?|tasks?|errands?|"
    r"favou?rs?)\b.*"
)
_MOST_EXCLAIMED: Final = 3
_NOUN_FOLLOWS: Final = frozenset({"the", "a", "an", "my", "your", "our"})
# What the robot is not to do.
_FORBIDS: Final = re.compile(
    r"\b(?:must(?! (?:be|have)\b)|shall|wait|again)\b|"
    r"\byou\b.*\b(?:(?:do|must|should|need|sha)n't|not)\b|\b(?:(?:do|must|should)n't|not)\b.*\byou\b"
)
_MATTERS: Final = frozenset(
    {
        "no", "not", "never", "nothing", "none", "without", "except", "instead", "rather", "only",
        "but", "or", "avoid", "if", "when", "whenever", "until", "till", "unless", "once",
        "before", "after", "while", "later", "tomorrow", "tonight", "today", "every", "each",
        "always", "again", "twice", "times", "second", "seconds", "minute", "minutes", "hour",
        "hours", "said", "say", "says", "tell", "told", "ask", "stop", "halt", "freeze", "wait",
        "hold", "cancel", "leave", "keep", "stay", "pause", "both", "all", "other", "another",
        "same", "one", "ones", "too", "also", "actually", "sorry", "meant", "mean", "rest",
        "forward", "forwards", "back", "backward", "backwards", "up", "down", "around", "round",
        "hand", "hands", "careful", "help",
    }
)  # fmt: skip
_ONE: Final = re.compile(
    r"\b(?P<which>(?:the|that|my) (?:[\w-]+ )?)one\b|\b(?P<than>the \w+(?:er|est))"
    r"(?: of (?:the two|them))?$"
)


def gist_of(request: Request) -> str:
    """Return what of a command asks for something; "" where it is all, or nothing is."""
    if len(request.text) > MOST_LETTERS:
        return ""
    asked, told = list[str](), list[str]()
    for part in segments(_SO.sub(", ", plain(request.text))):
        if points_back(part) or known_fit(part, request) is not None:
            asked.append(part)
        elif _is_exclaimed(part, request) or _is_told(part) or is_one(part, request):
            told.append(part)
        else:
            return ""
    if not asked or not (told or points_back(asked[0])):
        return ""
    return ", ".join([_with_what_is_told(asked[0], told, request), *asked[1:]])


def _is_told(part: str) -> bool:
    tells = _SUBJECT.fullmatch(part) or _OF_SEVERAL.fullmatch(part) or _FINITE.fullmatch(part)
    return tells is not None and not unsays(part) and _FORBIDS.search(part) is None


def _is_exclaimed(part: str, request: Request) -> bool:
    """Tell whether a part is a short cry that names nothing that the robot knows."""
    words = words_of(part)
    places = {word for name in request.world.places for word in name.split()}
    is_short = len(words) <= _MOST_EXCLAIMED and not _NOUN_FOLLOWS & set(part.split())
    return is_short and not any(_matters(word, places) for word in words)


def _matters(word: str, places: set[str]) -> bool:
    """Tell whether a word may say what is to be done, or that it is not."""
    named = word in places or word in COLOURS or is_kind(single(word)) or word in SIDES
    points = word in ORDINALS or PRONOUNS.get(word) in ("there", "here", "them")
    is_no = word.endswith("n't") or word.isdigit()
    return named or points or is_no or word in _MATTERS or re.fullmatch(_DOING, word) is not None


def _with_what_is_told(asked: str, told: Sequence[str], request: Request) -> str:
    """Return what is asked with the thing that was told of in the place of "it", or of "one"."""
    things = things_told(told, request)
    points = POINTS.search(asked)
    if points and things and not NAMED.search(asked[: points.start()]):
        whole = (
            things
            if points[0] in ("them", "they", "those") or "of them" in points[0]
            else things[-1:]
        )
        return f"{asked[: points.start()]}{' and '.join(whole)}{asked[points.end() :]}"
    kinds = kinds_told(told)
    one = _ONE.search(asked)
    if one is None or len(kinds) != 1 or KIND.search(asked):
        return asked
    which = one["which"] or f"{one['than']} "
    return f"{asked[: one.start()]}{which}{kinds.pop()}{asked[one.end() :]}"
