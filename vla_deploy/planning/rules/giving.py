"""Give what a hand holds to who asks for it: "hand me the phone", "I'll take that cup", "let go".

What is not in a hand is brought, as ever: who wants it may not have a hand free yet.
"""

from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.rules import building
from vla_deploy.planning.rules.building import Groups, Step, arm_in, parts_of
from vla_deploy.planning.rules.intents import Intent
from vla_deploy.planning.rules.pattern_parts import OBJECT, Row
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, fitting
from vla_deploy.planning.understanding.phrases import IT, PRONOUNS
from vla_deploy.planning.understanding.setting import Setting

_FROM_YOU: Final = r"(?: (?:off|from) (?:you|your hands?)| back| now| then| here)*"


def give(groups: Groups, request: Request) -> list[Step]:
    """Hand over each thing that is in a hand; bring what is not."""
    parts = parts_of(groups["object"])
    if not all(_is_in_hand(part, request) for part in parts):
        return building.bring(groups, request)
    return [step for part in parts for step in let_go({**groups, "object": part}, request)]


def let_go(groups: Groups, request: Request) -> list[Step]:
    """Hand over what is held; with one thing in hand its name tells nothing more."""
    named = {"object": groups.get("object", IT)} if len(_held(request)) > 1 else {}
    return [("hand_over", {**named, **arm_in(groups)})]


def _held(request: Request) -> list[str]:
    return [kind for kind in request.world.holding.values() if kind]


def _is_in_hand(text: str, request: Request) -> bool:
    """Tell whether a text means something that is held."""
    if PRONOUNS.get(text) == IT:
        return bool(_held(request))
    setting = Setting(request)
    try:
        read = read_expression(text, setting.furniture)
        found = fitting(read, Use.PUT, setting)
    except UnknownObject:
        return False
    is_held = read.query.kind in _held(request)
    is_plain = not (read.query.colour or read.query.relation or read.support)
    return any(one.held_by for one in found) or (is_held and (is_plain or not found))


ROWS: Final[tuple[Row, ...]] = (
    (Intent.MANIPULATION, rf"(?:give|hand|pass|lend) (?:me|us)(?: back| over)? {OBJECT}"
     rf"{_FROM_YOU}", give),
    (Intent.MANIPULATION, rf"(?:hand|pass|give) {OBJECT} (?:(?:over|across|here|back)(?: here)?"
     r"(?: to (?:me|us))?|to (?:me|us))|(?:hand|pass|give) over (?P<object2>.+)", give),
    (Intent.MANIPULATION, rf"(?:i(?:'ll| will| can)|let me|let us) (?:take|have|grab) {OBJECT}"
     rf"{_FROM_YOU}|(?:can|could|may|might) i (?:please |just )*(?:have|take|get) "
     rf"(?P<object2>.+?){_FROM_YOU}", give),
    (Intent.MANIPULATION, r"(?:you (?:can|may) )?(?:let go(?: of)?|release|let loose(?: of)?)"
     r"(?: (?P<object>it|that|this|them))?", let_go),
    (Intent.MANIPULATION, rf"(?:you (?:can|may) )?(?:let go of|release|let loose of) {OBJECT}",
     let_go),
)  # fmt: skip
