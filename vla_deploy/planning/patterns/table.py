"""List the patterns of the commonest commands: how each is said, and which step it is.

What may stand in their slots are names that the robot knows, and nothing else: so no word that
changes what a sentence means can hide in one.
"""

import re
from collections.abc import Mapping
from typing import Final

from vla_deploy.planning.understanding.quantities import NUMBER
from vla_deploy.world.vocabulary import COLOURS, KIND_WORDS

_ARTICLE: Final = "(?:the|a|an|my|your|that|this|some|our)"
_LOOK: Final = (
    f"(?:{'|'.join(COLOURS)}|gray|violet|small|little|big|large|nearest|closest|smallest|biggest|"
    "smaller|bigger|tall|short|other|left|right)"
)
_KIND: Final = f"(?:{KIND_WORDS}|remote control|mobile phone|cell phone)"
_ONE: Final = (
    rf"(?:{_ARTICLE} )?(?:{_LOOK} ){{0,3}}{_KIND}|(?:the|that|this) (?:{_LOOK} ){{1,2}}one|"
    "it|that|this|that one|this one|them|those|these"
)
NAMED: Final = re.compile(rf"\b(?:{_ARTICLE} )?(?:{_LOOK} ){{0,3}}{_KIND}\b")
"""What names a thing, anywhere in a text."""
# A word for a thing that the robot has not learnt: grounding asks what it is.
_UNKNOWN: Final = (
    rf"(?:the|a|an|my|that|this) (?:{_LOOK} ){{0,2}}"
    r"(?!one\b|same\b|rest\b|other\b|left\b|right\b|whole\b)[a-z]{3,}"
)
_STANDS: Final = (
    rf" (?:on|in|next to|beside) (?:the|my|your|our) (?:{_LOOK} ){{0,2}}[a-z]+(?: table)?"
)
_SEVERAL: Final = rf"(?:both|all)(?: of)?(?: the| my| our)? (?:{_LOOK} )?{_KIND}s?|everything"
_KNOWN: Final = rf"(?:{_ONE}|everything)(?:{_STANDS})?|{_SEVERAL}"
_BARE: Final = rf"(?:{_ONE}|{_SEVERAL}|{_UNKNOWN})"
"""A thing that is told by its look alone."""
THING: Final = rf"(?:{_KNOWN}|{_UNKNOWN})"
_SEVERAL_THINGS: Final = rf"{THING}(?:(?:,| and|, and) {THING})*"
WORDS: Final = r"[a-z][a-z']*(?: [a-z']+){0,4}?"
_METRES: Final = rf"{NUMBER}(?: of a| an?)? ?(?:m|met(?:er|re)s?|cm|centimet(?:er|re)s?)"
_ANGLE: Final = rf"{NUMBER} ?(?:degrees?|deg|°|rad|radians?)"
_SECONDS: Final = rf"{NUMBER}(?: of a| an?)? ?(?:seconds?|secs?|s|minutes?|mins?|moment)"
_SOMEBODY: Final = "him|her|them|(?:that|the) (?:person|man|woman|boy|girl)"
_HAND: Final = r"(?:your |the )?(?:(?P<arm>left|right) )?(?:hand|gripper|hands|grippers)"
_IS_THING: Final = re.compile(_KNOWN)
_THINGS: Final = rf"(?P<what>{_SEVERAL_THINGS})"
_THING: Final = rf"(?P<what>{THING})"
# What is moved where: a thing that is told by where it stands leaves it open what goes where.
_MOVED: Final = rf"(?P<what>{_BARE}(?:(?:,| and|, and) {_BARE})*)"
_WHERE: Final = rf"(?P<where>{WORDS})"
# "The stretched out pose", or "the pose stretched out".
_POSE: Final = (
    rf"(?:(?:the|your|a) )?(?:(?P<name>{WORDS}) (?:pose|posture|position)|"
    rf"(?:pose|posture|position) (?P<name>{WORDS}))"
)
# Not "turn on the spot".
_DEVICE: Final = r"(?!(?:the )?spot\b)(?P<device>[a-z][a-z']*(?:,? [a-z']+){0,7}?)"
_INTO: Final = r"(?P<how>into|inside|in|onto|on top of|on|next to|beside|to)"
_TAKE: Final = "(?:pick up|grab|take|get|lift|hold)"
_PUT: Final = "(?:put|place|set|lay|drop|leave)"
_CARRY: Final = "(?:put|place|set|take|bring|carry|move|get)"
_GO: Final = "(?:go|drive|move|roll|come)"
_WAY: Final = "(?P<way>forwards?|ahead|straight ahead|backwards?|back)"
_SIDE: Final = "(?P<way>left|right|around|round)"
_LITTLE: Final = "a (?:little|bit|little bit)"

# A clause that fits a row whole is a step to do; its named groups are fields, beside those given.
_ROWS: Final[tuple[tuple[str, str, Mapping[str, str]], ...]] = (
    ("stop|halt|freeze|stand still", "stop", {}),
    # --- go, turn
    ("(?:go|drive|come) back|return", "go", {"where": "back"}),
    (r"(?:come|go) (?:(?:back|over) )?(?:here|to me)", "go", {"where": "here"}),
    (rf"(?:follow|come (?:along )?(?:with|after)) (?:me|us|{_SOMEBODY})"
     rf"(?: for (?P<by>{_SECONDS}))?", "follow", {}),
    (r"dock|(?:go (?:and |to )?)?(?:re)?charge(?: yourself| your battery)?|go (?:and )?dock", "go",
     {"where": "charging station"}),
    (rf"(?:{_GO}|step) {_WAY}(?:(?: by)? (?P<by>{_METRES}|{_LITTLE}))?", "move", {}),
    (rf"(?:turn|rotate|spin)(?: to the)? {_SIDE}(?:(?: by)? (?P<by>{_ANGLE}|{_LITTLE}))?",
     "turn", {}),
    (rf"(?:turn|rotate|spin)(?: by)? (?P<by>{_ANGLE})(?: (?:to the )?{_SIDE})?", "turn", {}),
    (rf"(?:{_GO}|return)(?: back)? (?:in)?to {_POSE}|"
     rf"(?:bring|move|put|get|take|return) (?:your|the|both(?: your)?)(?: (?P<arm>left|right))? "
     rf"(?:arms?|hands?)(?: back)? (?:in)?to {_POSE}", "pose", {}),
    (rf"(?:{_GO}|head|navigate|return)(?: back| over)?(?: to| into)? {_WHERE}", "go", {}),
    ("(?:turn|spin) (?:a?round once|in a circle)", "turn", {"by": "360 degrees"}),
    # --- switch devices of the home; what is no device of it is refused by name
    (rf"(?:turn|switch) (?P<way>on|off) {_DEVICE}|(?:turn|switch|put) {_DEVICE} (?P<way>on|off)",
     "switch", {}),
    # --- look
    ("look a?round", "look", {"way": "around"}),
    (r"look(?: to the)? (?P<way>left|right|up|down|ahead)", "look", {}),
    (rf"look at {_THING}", "look", {}),
    (rf"(?:inspect|examine) {_THING}|look at {_THING} from (?:two|both|all) sides", "inspect", {}),
    (rf"(?:find|look for|search for|locate) {_THINGS}(?: in (?:the )?(?P<from>{WORDS}))?",
     "find", {}),
    # --- hands
    (rf"open {_HAND}", "open", {}),
    (rf"close {_HAND}", "close", {}),
    (r"tuck(?: in)?(?: your)?(?: (?P<arm>left|right))? arms?(?: in)?", "pose", {"name": "tuck"}),
    (rf"{_PUT} {_THING} down|put down {_THINGS}|drop {_THING}|"
     rf"(?:put|tidy|clear) {_THINGS} away|put away {_THINGS}", "put", {}),
    (rf"{_CARRY} {_THING} back", "put", {"where": "back"}),
    # It may know no more than that there is something.
    (r"(?:free|empty) (?:your|the)(?: (?P<arm>left|right))? (?:hand|gripper)", "put", {}),
    # --- give, bring
    (rf"(?:give|hand|pass|bring|fetch|get) me {_THINGS}|(?:give|hand) {_THINGS} to me|"
     rf"(?:bring|take|carry) {_THINGS} (?:over )?(?:to me|here)|(?:fetch|bring) {_THINGS}|"
     rf"(?:can|could) i have {_THINGS}|hand over {_THINGS}|hand {_THING} over", "bring", {}),
    (r"let go(?: of (?:it|that|them))?", "give", {}),
    # --- put, take
    (rf"{_PUT} {_MOVED}(?: down)? {_INTO} {_WHERE}", "put", {}),
    # What is taken "beside the ball" or "on the table" stands there.
    (rf"{_CARRY} {_MOVED} (?P<how>to|into|onto) {_WHERE}", "put", {}),
    (rf"{_TAKE} {_THINGS}(?: with {_HAND})?|(?:pick|lift) {_THINGS} up", "pick", {}),
    # --- tidy
    (rf"(?:clean|tidy|clear)(?: up)?(?: {_WHERE})?", "tidy", {}),
    (rf"(?:clean|sweep|vacuum|hoover|mop) (?:the )?floor (?:of|in) {_WHERE}|"
     rf"(?:sweep|vacuum|hoover|mop)(?: up)? {_WHERE}", "sweep", {}),
    (rf"(?:set|lay) (?:the table|(?P<where>the {WORDS} table))(?: for (?P<by>me|us|one|two))?",
     "set", {}),
    (rf"(?:guard|watch|(?:keep|stand) (?:watch|guard)(?: (?:at|in|over|of|on))?)"
     rf"(?: here| (?P<where>the {WORDS}))?(?: for (?P<by>{_SECONDS}))?", "guard", {}),
    (rf"patrol {_WHERE}(?:(?:,| and|, and) (?P<then>{WORDS}))?", "patrol", {}),
    # --- say, wait, answer
    (r"say (?P<text>[^,;:]+)|(?P<text>hello|hi|good (?:morning|evening)|goodbye|bye)", "say", {}),
    (rf"wait(?: here)?(?:(?: for)? (?P<by>{_SECONDS}))?", "wait", {}),
    (r"how (?:full is (?:your|the)|much|low is your) battery(?: do you have(?: left)?| is left)?|"
     r"how is your battery(?: level)?|what(?:'s| is) your battery(?: level| charge)?|"
     r"(?:is your battery (?:full|low|empty)|are you charging)|battery (?:level|status)",
     "ask", {"about": "battery"}),
    (r"(?:many )?thanks(?: a lot)?|thank you(?: very much)?|good (?:job|robot)", "ask",
     {"about": "thanks"}),
    (r"how are you(?: doing)?(?: today)?|are you (?:ok|okay|well|ready)", "ask",
     {"about": "ready"}),
    (r"help(?: me)?|what can you do|who are you", "ask", {"about": "able"}),
    (rf"(?:is|are) {_DEVICE} (?:on|off)(?: now)?", "ask", {"about": "device"}),
    (rf"where(?: is| are|'s) {_THING}|have you seen {_THING}", "where", {}),
    (rf"what (?:do|can) you see|what(?:'s| is) on (?:the )?{_WHERE}", "ask", {"about": "seeing"}),
    (r"what (?:are you holding|do you hold|do you have in your hands?)", "ask",
     {"about": "holding"}),
    ("where are you", "ask", {"about": "place"}),
    (rf"(?:do you see|is there|are there) (?:any )?{_THING}", "ask", {"about": "whether"}),
)  # fmt: skip


def _compiled(pattern: str) -> re.Pattern[str]:
    """Compile a row in which each alternative may name the same slot."""
    seen: dict[str, int] = {}

    def numbered(found: re.Match[str]) -> str:
        count = seen[found[1]] = seen.get(found[1], 0) + 1
        return f"(?P<{found[1]}{'' if count == 1 else count}>"

    return re.compile(re.sub(r"\(\?P<([a-z]+)>", numbered, pattern))


PATTERNS: Final = tuple((_compiled(pattern), {"do": do, **given}) for pattern, do, given in _ROWS)


def is_thing(text: str) -> bool:
    """Return whether a text names a thing in words that the robot knows."""
    return _IS_THING.fullmatch(text) is not None
