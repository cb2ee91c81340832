"""List the patterns of the commonest commands: what each is for, and what builds its steps."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from vla_deploy.planning.builders import (
    answering,
    giving,
    moving,
    placing,
    steps,
    tidying,
)
from vla_deploy.planning.builders.steps import Builder
from vla_deploy.planning.patterns.slots import (
    ANGLE,
    HAND,
    KIND,
    METRES,
    SECONDS,
    THING,
    THINGS,
    WORDS,
)
from vla_deploy.planning.plan import Priority

_OBJECT: Final = rf"(?P<object>{THINGS})"
_THING: Final = rf"(?P<object>{THING})"
_PLACE: Final = rf"(?P<place>{WORDS})"
_WITH: Final = rf"(?: (?:with|in) {HAND})?"
_INTO: Final = r"(?P<relation>into|inside|in|onto|on top of|on|next to|beside|to)"
_DESTINATION: Final = rf"(?P<destination>{WORDS})"
_TAKE: Final = "(?:pick up|grab|take|get|lift|grasp|hold|collect|take hold of|grab hold of)"
_PUT: Final = "(?:put|place|set|lay|drop|leave|stick|pop)"
_CARRY: Final = "(?:put|place|set|take|bring|carry|move|get)"
_WAY: Final = "(?P<way>forwards?|ahead|straight ahead|backwards?|back)"
_SIDE: Final = "(?P<way>left|right|around|round)"
_LITTLE: Final = "(?P<little>a (?:little|bit|little bit)|slightly)"


class Intent(StrEnum):
    """Group commands by what they are for; what is urgent comes first where the order is free."""

    STOP = "stop"
    ASSIST = "assist"
    NAVIGATION = "navigation"
    MANIPULATION = "manipulation"
    SEARCH = "search"
    QUESTION = "question"
    CLEANING = "cleaning"


PRIORITIES: Final[Mapping[Intent, Priority]] = {
    Intent.STOP: Priority.HIGH,
    Intent.ASSIST: Priority.HIGH,
    Intent.NAVIGATION: Priority.MEDIUM,
    Intent.MANIPULATION: Priority.MEDIUM,
    Intent.SEARCH: Priority.MEDIUM,
    Intent.QUESTION: Priority.MEDIUM,
    Intent.CLEANING: Priority.LOW,
}


@dataclass(frozen=True, slots=True)
class Pattern:
    """Hold one row; a clause that fits `pattern` whole is built by `build`."""

    intent: Intent
    pattern: re.Pattern[str]
    build: Builder


_MOVE, _HOLD, _SEE = Intent.NAVIGATION, Intent.MANIPULATION, Intent.SEARCH
_ASK, _HELP, _TIDY = Intent.QUESTION, Intent.ASSIST, Intent.CLEANING
_ROWS: Final[tuple[tuple[Intent, str, Builder], ...]] = (
    (Intent.STOP, "stop|halt|freeze|stand still", steps.stop),
    # --- go
    (_MOVE, rf"(?:go|drive|move|head|navigate|return|come|roll)(?: back| over)?"
     rf"(?: to| into)? {_PLACE}", steps.go),
    (_MOVE, rf"(?:go|drive|head|come)(?: over)? to {_THING}", steps.approach),
    (_MOVE, r"(?:go|drive|come) back|return", steps.go_back),
    (_MOVE, r"(?:come|go) (?:(?:back|over) )?(?:here|to me)", steps.come),
    (_MOVE, r"dock|recharge|charge(?: yourself)?|go (?:and )?(?:charge|dock)(?: yourself)?",
     steps.dock),
    # --- go straight, turn
    (_MOVE, rf"(?:move|drive|go|roll|come|step)(?: {_LITTLE})? {_WAY}"
     rf"(?:(?: by| for)? (?P<quantity>{METRES}))?", moving.drive),
    (_MOVE, rf"(?:move|drive|go|roll|step) (?P<quantity>{METRES}) {_WAY}", moving.drive),
    (_MOVE, rf"(?:move|drive|go|come) {_WAY} {_LITTLE}|back up", moving.drive),
    (_MOVE, rf"(?:turn|rotate|spin)(?: {_LITTLE})?(?: to the)? {_SIDE}"
     rf"(?:(?: by)? (?P<quantity>{ANGLE}))?", moving.turn),
    (_MOVE, rf"(?:turn|rotate|spin)(?: by)? (?P<quantity>{ANGLE})(?:(?: to the)? {_SIDE})?",
     moving.turn),
    (_MOVE, rf"(?:turn|rotate)(?: to the)? {_SIDE} {_LITTLE}", moving.turn),
    (_MOVE, "(?:turn|spin) (?:all the way )?(?:a?round once|in a circle|all the way a?round)",
     moving.turn_whole),
    # --- look
    (_SEE, "look a?round|have a look a?round", steps.look_around),
    (_SEE, r"look(?: to the| to your)? (?P<what>left|right|up|down|ahead|straight ahead)",
     steps.look),
    (_SEE, rf"look at (?P<what>{THING}|the floor|the ceiling)", steps.look),
    (_SEE, rf"(?:find|look for|search for|locate) {_OBJECT}(?: in (?:the )?{_PLACE})?", steps.find),
    # --- hands
    (_HOLD, rf"(?P<verb>open|close) {HAND}", steps.gripper),
    (_HOLD, r"(?:tuck|fold)(?: in)?(?: your)?(?: (?P<arm>left|right))? arms?(?: in)?", steps.tuck),
    (_HOLD, r"(?:put|set) (?:it|them|that) down", placing.put_down),
    (_HOLD, rf"put (?P<object>{THING}) down|put down {_OBJECT}|drop {_THING}", placing.put_down),
    (_HOLD, rf"{_CARRY} {_THING} back(?: where it was)?", placing.put_back),
    (_HOLD, rf"(?:put|tidy|clear) {_OBJECT} away|put away {_OBJECT}", placing.put_away),
    (_HOLD, rf"{_PUT} {_THING} here", placing.put_here),
    (_HOLD, rf"{_PUT} {_THING} (?P<destination>there|over there)", placing.put_there),
    (_HOLD, r"empty (?:both )?(?:your )?hands", placing.empty_hands),
    (_HOLD, rf"empty {HAND}", placing.empty_hand),
    (_HOLD, rf"keep (?:hold of |holding )?{_THING}", placing.keep),
    # --- give, bring
    (_HOLD, rf"(?:give|hand|pass) (?:me|us) {_OBJECT}", giving.give),
    (_HOLD, rf"(?:give|hand|pass) {_OBJECT} to me|hand over {_OBJECT}|hand {_THING} over",
     giving.give),
    (_HOLD, r"let go(?: of (?P<object>it|that|them))?|release (?P<object>it|that|them)",
     giving.let_go),
    (_HOLD, rf"(?:bring|fetch|get) (?:me|us) {_OBJECT}", steps.bring),
    (_HOLD, rf"(?:bring|take|carry) {_OBJECT} (?:over )?(?:to me|here)|(?:fetch|bring) {_OBJECT}",
     steps.bring),
    (_HOLD, rf"(?:can|could|may) i have {_OBJECT}", giving.give),
    # --- put, take
    (_HOLD, rf"{_PUT} {_OBJECT}(?: down)? {_INTO} {_DESTINATION}", placing.put),
    # What is taken "beside the ball" or "on the table" stands there.
    (_HOLD, rf"{_CARRY} {_OBJECT} (?P<relation>to|into|onto) {_DESTINATION}", placing.put),
    (_HOLD, rf"{_TAKE} {_OBJECT}{_WITH}|(?:pick|lift) {_OBJECT} up", steps.pick),
    # --- tidy
    (_TIDY, r"(?:clean|tidy|clear)(?: up)?", tidying.tidy),
    (_TIDY, rf"(?:clean|tidy|clear)(?: up| off)? {_PLACE}", tidying.tidy),
    (_TIDY, rf"(?:patrol|inspect) {_PLACE}", tidying.patrol),
    # --- say, wait, answer
    (_HELP, r"(?:say|announce) (?P<text>[^,;:]+)|"
     r"(?P<text>hello|hi|good (?:morning|afternoon|evening|night)|goodbye|bye)", steps.speak),
    (_HELP, rf"wait(?: here)?(?:(?: for)? (?P<quantity>{SECONDS}))?", steps.wait),
    (_HELP, r"(?:many )?thanks(?: a lot| so much| for that)?|thank you(?: very much| so much)?|"
     r"good (?:job|robot)", answering.tell_welcome),
    (_HELP, r"how are you(?: doing)?(?: today)?|are you (?:ok|okay|well|ready)",
     answering.tell_ready),
    (_ASK, r"how (?:much|full is your) battery(?: (?:is left|do you have(?: left)?|have you got))?|"
     r"(?:how is|what is|how's) your battery(?: level)?", answering.tell_battery),
    (_HELP, r"help(?: me)?|what can you do|who are you|what are you", answering.tell_abilities),
    (_ASK, rf"where(?: is| are|'s) {_THING}|have you seen {_THING}|"
     rf"where did i (?:leave|put) {_THING}", answering.tell_or_find),
    (_ASK, r"what (?:do|can) you see|what is there", answering.tell_sight),
    (_ASK, rf"what(?:'s| is) on (?:the )?{_PLACE}", answering.tell_sight),
    (_ASK, r"what (?:are you holding|do you hold|do you have in your hands?)",
     answering.tell_hands),
    (_ASK, "where are you", answering.tell_place),
    (_ASK, rf"(?:do you see|is there|are there) (?:any )?{_THING}", answering.tell_whether),
    (_ASK, rf"how many (?P<object>{KIND}s?)(?: are there| do you see)?", answering.tell_number),
)  # fmt: skip


def _compiled(pattern: str) -> re.Pattern[str]:
    """Compile a row in which each alternative may name the same slot."""
    seen: dict[str, int] = {}

    def numbered(found: re.Match[str]) -> str:
        count = seen[found[1]] = seen.get(found[1], 0) + 1
        return f"(?P<{found[1]}{'' if count == 1 else count}>"

    return re.compile(re.sub(r"\(\?P<([a-z]+)>", numbered, pattern))


PATTERNS: Final = tuple(
    Pattern(intent, _compiled(pattern), build) for intent, pattern, build in _ROWS
)
