"""Take out of a command what only states something, and give the rest what it lends to it.

"I left my phone in the bedroom, could you fetch it?" tells what "it" is, and where to go first.
"Not on the table, put it in the box" tells only where not.
"""

import re
from collections.abc import Sequence
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.references import words_of
from vla_deploy.planning.rules.building import Groups, is_one, is_seen, parts_of
from vla_deploy.planning.rules.clauses import repaired
from vla_deploy.planning.rules.fits import known_fit
from vla_deploy.planning.rules.lending import (
    NAMED,
    POINTS,
    kind_lent,
    left_alone_off,
    place_of_people,
    things_told,
)
from vla_deploy.planning.rules.unsaying import unsays
from vla_deploy.planning.understanding.expression import Scope
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.phrases import THEM
from vla_deploy.planning.understanding.setting import Setting

_THING: Final = r"(?P<thing>(?:my|the|our) .+?)"
_SAID: Final[tuple[re.Pattern[str], ...]] = tuple(
    re.compile(pattern)
    for pattern in (
        r"i (?:just |still |simply )?(?:can't|cannot|can not|couldn't|could not) (?:seem to )?"
        rf"(?:find|see|spot|remember where i (?:put|left)) {_THING}(?: anywhere)?",
        rf"i(?:'ve| have| seem to have| must have| think i(?:'ve)?)? (?:lost|mislaid|misplaced) "
        rf"{_THING}",
        rf"i(?:'ve| have| must have| seem to have| think i(?:'ve)?)? (?:left|forgot|forgotten|put)"
        rf" {_THING} (?:away )?(?:in|on|at|by) (?P<place>.+?)(?: by (?:mistake|accident)| again)?",
        r"i (?:don't|do not|can't|cannot) (?:see|find|spot) (?P<thing>(?:any|an?|the|my|our) .+?)"
        r"(?: anywhere)?",
        r"(?:somewhere )?(?:in|on|at) (?P<place>.+?),? (?:somewhere )?(?:there(?:'s| is| should be|"
        r" must be)|(?:is|should be|must be)) (?P<thing>(?:an?|my|our|some) .+)",
        rf"did (?:i|we) (?:leave|put|forget|drop) {_THING} (?:in|on|at) (?P<place>.+?)"
        r"(?: (?:last night|this morning|yesterday|earlier))?",
        r"(?:(?:do|can) you )?see (?P<thing>(?:my|the|our|that|those|these) .+?)"
        r"(?: (?:over )?there)?",
        rf"{_THING}(?:'s| is| are| must be| should be|(?: have| has)? ended up| seems? to be|(?: "
        rf"were| was|'ve been| have been| has been|(?: have| has)? got) left) (?:still |lying |"
        rf"sitting |over )?(?:in|on|at) (?P<place>.+?)(?: again)?",
        rf"(?:someone|somebody|we|he|she|they)(?:'ve| have|'s| has)? (?:left|put|dropped) {_THING} "
        r"(?:in|on|at|by) (?P<place>.+)",
        r"there(?:'s| is| should be| must be| might be| ought to be) "
        r"(?P<thing>(?:an?|the|my|some) (?:(?! (?:in|on|at) ).)+?)(?: (?:somewhere|lying|standing)"
        r"(?: around)?)?(?: in (?:this|the) (?:apartment|flat|house|home|place|room))?",
        rf"{_THING} (?:shouldn't|should not|doesn't|does not|can't|cannot|mustn't|must not) "
        r"(?:be|belong|stay|go|stand|lie|sit|live)\b.*",
    )
)
# What is said beside a command, and neither asks for anything nor lends it anything.
_BESIDE: Final = re.compile(
    r"(?:and |because |since |but |so )?(?:(?:i|we) (?:had|saw|used) (?:it|them)\b.*|"
    r"(?:now )?(?:it|they|that)(?:'s| is|'re| are) (?:gone|missing|lost|in the way|dirty|empty|"
    r"not needed)\b.*|"
    r"(?:it|that|they) (?:can't|cannot|shouldn't|should not|doesn't|does not|don't) "
    r"(?:be|stay|belong|live|go|stand|lie)\b.*|"
    r"i think (?:it|they)(?:'s|'re| is| are)\b.*|you (?:really )?can't miss (?:it|them)|"
    r"i(?:'m| am) (?:so |very |really |a bit )?"
    r"(?:thirsty|tired|hungry|cold|late|in a hurry|busy)\b.*|"
    r"(?:now )?i (?:just |really )?(?:can't|cannot|don't) .*\bremember\b.*|"
    r"(?:just )?(?:keep|hold)(?: on to)? (?:it|them) (?:in your (?:hands?|claws?|grippers?)|"
    r"there|for me)(?: (?:while|until|till|so) .*)?|"
    r"(?:because|since|as|seeing (?:as|that)|given that|now that|which) "
    r"(?:i|we|he|she|they|it|there|that|is|are|means|my|the)\b(?!.*\b(?:if|unless|not)\b|.*n't\b).*|"
    r"(?:seeing (?:as|that)|given that|now that|since|as) you(?:'ve|'re| have| are)\b"
    r"(?!.*\b(?:if|unless|not)\b).*|"
    r"before (?:i|we|my|the|somebody|someone|he|she|they|anyone|anybody)\b(?!.*\byou\b).*|"
    r"taking care\b.*|(?:be|being) careful\b.*|mind (?:you don't|it doesn't)\b.*|"
    r"without (?:spilling|dropping|breaking|waking)\b.*|"
    r"not (?:lying|sitting|standing|left|hanging)\b.*|"
    r"i (?:need|want) to (?:read|drink|leave|call|go)\b.*|"
    r"i (?:don't|do not) (?:care|like|want|wish) to be\b.*|"
    r"(?:i (?:want|would like)|let's|let me) (?:to )?(?:see|hear|check|test|watch|know) "
    r"(?:if|whether|how)\b.*)"
)
_IT_IS_AT: Final = re.compile(
    r"(?:it|they)(?:'s|'re|'ll be| is| are| will be| should be| must be| might be| may be)"
    r"(?: still| probably)? "
    r"(?:lying |standing )?(?:in|on|at|by|beside|near|next to) (?P<place>.+?)(?: somewhere)?"
)
_BELONGS: Final = re.compile(
    r"(?:the|my|our|this|that|these|those|it|they)\b.* (?:belongs?|lives?|goes|go) (?:in|on|at|to) "
)
_PUT_THERE: Final = re.compile(
    r"(?:so |please )*(?:put|pop|stick|place|set|take|drop|bring|move|leave) (?:it|them|that one) "
    r"(?:back |down )*(?:(?:in |on |over )?there|on it|in it|where (?:it|they) belongs?)"
)
# Somebody's doings and states; not what one wants, forbids, or puts under a condition.
_REMARK: Final = re.compile(
    r"(?:and |but |because |since |as )?(?:i|we|he|she|they|you|it|there|that|nobody|somebody|"
    r"someone|can't|cannot|couldn't|haven't|(?:my|your|our) \w+|the (?:\w+ )?\w+(?= (?:is|are|was|"
    r"were|has|have|will|comes?|needs)\b|'s\b))"
    r"(?:'(?:m|ve|ll|re|s|d))?\b(?!.*\b(?:must|should|shall|can you|"
    r"need|needs|want|wants|wish|like|please|if|unless|until|when|whenever|after|before|later|"
    r"tomorrow|tonight|don't|do not|not to|never|leave|instead|rather)\b).*"
)
_CARRIED: Final = re.compile(
    r"(?:bring|take|carry|move|deliver|put|transport|run|return)\b.* (?:to|into|onto|in|on) .+"
)
# "Into the box with it": what goes before is no other thing.
_WITH_IT: Final = re.compile(
    r"(?:(?:off|over|back|away) )?(?:in|into|on|onto|to) .+ with (?:it|them)"
)
_NOT_THERE: Final = re.compile(r"(?:and |but )?not (?:in|into|on|onto|to|at) (?P<place>.+)")
_NOT_THAT: Final = re.compile(r"(?:no )?not (?P<thing>(?:the|that|this|my) .+|that|this|it)")


def begins_with_statement(text: str) -> bool:
    """Tell whether a command begins with what only states something."""
    first = re.split(r"[,;.!?]", text, maxsplit=1)[0]
    return any(pattern.fullmatch(first) for pattern in _SAID)


def statements_off(parts: Sequence[str], request: Request) -> list[str]:
    """Return the parts of a command that ask for something, with what the others lend them."""
    told = kind_lent(place_of_people(_said_once(_found_where_told(list(parts), request)), request))
    asking = [part for part in told if not _BESIDE.fullmatch(part)] or told
    asking = _told_off(_not_that_off(_not_there_off(asking, request), request), request)
    return _remarks_off(left_alone_off(asking, request), request)


def _remarks_off(parts: list[str], request: Request) -> list[str]:
    """Leave out what only tells of somebody or something, beside what asks for something.

    The one thing that it names is what a pronoun of the rest means.
    """
    asking = [part for part in parts if not _is_remark(part) or known_fit(part, request)]
    points = POINTS.search(asking[0]) if asking else None
    is_told_where = points is not None and _WITH_IT.fullmatch(asking[0]) is not None
    if points is None or (NAMED.search(asking[0][: points.start()]) and not is_told_where):
        return asking or parts
    named = things_told([part for part in parts if part not in asking], request)
    if len(named) > 1:
        return parts
    return [POINTS.sub(named[0], asking[0], count=1), *asking[1:]] if named else asking


def _is_remark(part: str) -> bool:
    is_told = _REMARK.fullmatch(part) is not None and repaired(part) is None
    is_told = is_told and not any(pattern.fullmatch(part) for pattern in _SAID)
    return is_told and not unsays(part)


def _found_where_told(parts: list[str], request: Request) -> list[str]:
    """Go first to where a thing is said to be ("fetch it, it should be in the hall") if unseen."""
    for at in range(1, len(parts)):
        found = _IT_IS_AT.fullmatch(parts[at])
        fit = known_fit(parts[at - 1], request) if found else None
        if found is None or fit is None or "object" not in fit.groups:
            continue
        seen = is_seen(fit.groups["object"], request)
        first = [] if seen or not is_one(found["place"], request) else [f"go to {found['place']}"]
        return [*parts[: at - 1], *first, parts[at - 1], *parts[at + 1 :]]
    return parts


def _said_once(parts: list[str]) -> list[str]:
    """Leave out "put it there" behind "the cup belongs on the table": that says it already."""
    return [
        part
        for at, part in enumerate(parts)
        if not (at and _PUT_THERE.fullmatch(part) and _is_put(parts[at - 1]))
    ]


def _is_put(part: str) -> bool:
    return _BELONGS.match(part) is not None or _CARRIED.fullmatch(part) is not None


def _told_off(parts: list[str], request: Request) -> list[str]:
    """Let what a statement is about take the place of the pronoun behind it."""
    if len(parts) < 2:
        return parts
    found = next((one for pattern in _SAID if (one := pattern.fullmatch(parts[0]))), None)
    if found is None or not POINTS.search(parts[1]) or not is_one(found["thing"], request):
        return parts
    place = found.groupdict().get("place")
    if place is not None and not is_one(place, request):
        return parts
    asked = POINTS.sub(found["thing"], parts[1], count=1)
    return [*([f"go to {place}"] if place else []), asked, *parts[2:]]


def _not_there_off(parts: list[str], request: Request) -> list[str]:
    """Leave out where not, beside a part that says where."""
    for at, part in enumerate(parts):
        found = _NOT_THERE.fullmatch(part)
        if found is None or len(parts) < 2 or not is_one(found["place"], request):
            continue
        fit = known_fit(parts[at - 1 if at else 1], request)
        groups: Groups = {} if fit is None else fit.groups
        said = groups.get("destination", groups.get("place", ""))
        if said and words_of(said) != words_of(found["place"]) and _is_of_one(groups, request):
            return parts[:at] + parts[at + 1 :]
    return parts


def _not_that_off(parts: list[str], request: Request) -> list[str]:
    """Let "not the red one, the blue one" be a correction; never where that may mean both."""
    found = _NOT_THAT.fullmatch(parts[0]) if len(parts) > 1 else None
    if found is None:
        return parts
    fit = known_fit(parts[1], request)
    groups: Groups = {"object": parts[1]} if fit is None else fit.groups
    if not _is_of_one(groups, request):
        return parts
    return [f"no {parts[1]}" if fit is None else parts[1], *parts[2:]]


def _is_of_one(groups: Groups, request: Request) -> bool:
    """Tell whether a clause is about things that are named one by one."""
    text = groups.get("object", "")
    try:
        read = [read_expression(one, Setting(request).furniture) for one in parts_of(text)]
    except UnknownObject:
        return is_one(text, request)
    return all(one.scope is Scope.ONE and one.pronoun != THEM for one in read)
