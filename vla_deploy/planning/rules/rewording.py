"""Put roundabout ways of commanding into plain ones, before a command is taken apart.

off to the kitchen with you               -> go to the kitchen
use your left hand and take the book      -> take the book with your left hand
make sure that the can ends up in the box -> put the can in the box

One table, row after row: what is found from the beginning of a word, and what takes its place.
"""

import re
from typing import Final

from vla_deploy.planning.rules.passives import in_active_voice
from vla_deploy.planning.rules.short_forms import ROWS as SHORT_FORMS
from vla_deploy.world.vocabulary import COLOURS, CONTAINERS, KIND_WORDS

_COLOUR: Final = "|".join(COLOURS)
NO_OCCASION: Final = (
    r"(?! (?:long |awful |big )?(?:night|shift|day|walk|meal|trip|call|film|game)\b)"
)
"""Behind "after that": "after that night shift" is no order of things."""
_ROWS: Final[tuple[tuple[str, str], ...]] = (
    ("help me look$", "look for it"),
    (
        rf"((?:the|my) (?:\w+ )?)({KIND_WORDS}) (?:goes|belongs|is to go) (in|on|into|onto) "
        rf"([^,;.!?]+?)(?:,| and|, and) (the \w+) one (in|on|into|onto) (?=the |my )",
        r"put \1\2 \3 \4, put \5 \2 \6 ",
    ),
    (
        r"(what(?:ever)?(?:'s| is| you have| you've got)) in (?:the|your) (left|right)"
        r"(?: one| arm)?(?! hand| gripper| box| bowl)\b",
        r"\1 in your \2 hand",
    ),
    (
        "(?:turn|spin)(?: right| all the way| yourself)? (?:a?round|about),?"
        "(?: and| to| so(?: that)?)?"
        "(?: you(?:'re| are)?)? fac(?:e|ing) the (?:other|opposite) (?:way|side|direction)",
        "turn around",
    ),
    ("face the (?:other|opposite) (?:way|side|direction)", "turn around"),
    (
        r"((?:take|get|fetch|pick|grab|find)\b[^,;.!?]*?),? (?:and )?"
        r"once you(?:'ve| have) got (?:it|them)",
        r"\1 and then",
    ),
    (
        r"(?:carry|bring|take|fetch|run) ([^,;.!?]+?) (?:in|inside|through|over|across|along|out|"
        r"round|up|down|back) and (put|place|set|leave|drop|stick|pop) (?:it|them)(?: down)? "
        r"(?=(?:in|into|on|onto|to|at|by|next)\b)",
        r"\2 \1 ",
    ),
    (
        rf"(?<!to )(?<!on )(the|that) (\w{{3,}}(?:er|est)|first|second|third|last|left(?:most)?|"
        rf"right(?:most)?|middle)(?: one)? (?:of|out of|among) (?:the|those|these) "
        rf"(?:two |three |four |five )?"
        rf"({KIND_WORDS})(?:e?s)",
        r"\1 \2 \3",
    ),
    (
        rf"^((?:of|from|out of|among) (?:all )?(?:the|those|these) (?:two |three |four |five )?"
        rf"(?:{KIND_WORDS})e?s) (?=(?:i|take|pick|get|bring|give|grab|lift)\b)",
        r"\1, ",
    ),
    (
        r"^(?:(?:of|from|out of|among) )?(?:all )?(?:(?:the|those|these) )?(?:two|three|four|five)"
        rf" ({KIND_WORDS})e?s(?: there| here|(?: on| in| at) the [^,;.!?]+?)?, "
        rf"([^;.!?]*?)\b(the (?:\w+er|\w+est|{_COLOUR}|middle|left|right|first|second|third|last)) "
        r"one\b",
        r"\2\3 \1",
    ),
    (
        rf"^not (?:the|that|my) (?:\w+ )*?({KIND_WORDS})(?: [^,;.!?]*)?, (?:but |it's |i mean )?"
        r"(the \w+) one\b",
        r"\2 \1",
    ),
    (r"^not (?:the|that|my) \w+ one, (?=the |my |that )", ""),
    (r"(?:pick|take|get|grab) (?:that|this) in(?:to)? your hand", "pick it up"),
    (r"i(?: want|'d like| need| would like) you (?:holding|to be holding) ", "hold "),
    (
        r"((?:the|that|this|my) [^,]+?) (?:is|are) (?:the ones?|what)(?: that)? "
        r"(?:i'd like|i want|i need|i would like)(?: you)? to "
        r"((?:pick|take|bring|fetch|lift|grab|hold|get|find)(?: up)?)(?=$|[,.!?])",
        r"\2 \1",
    ),
    (
        r"^(?:one|two|three|an?|a (?:few|couple of)) (?:\w+ )?(?:jobs?|things?|tasks?|errands?|"
        r"favou?rs?)\b[^:,.]*: ",
        "",
    ),
    (
        r"i(?: want|'d like| need| would like) you (?:to be )?(?:waiting |standing |sitting )?"
        r"(?:at|in|by) (?=(?:the|my|your)\b)",
        "go to ",
    ),
    (r"(open [^,;.!?]*?) (?:nice and )?wide", r"\1"),
    (
        r"(?:what(?:ever)?|the (?:thing|one)(?: that)?) (?:you(?:'ve| have)(?: got)?|"
        r"you(?:'re| are) (?:holding|carrying)|you hold|you carry|is) in (?:your|the) (left|right)"
        r"(?: (?:hand|arm|gripper))?",
        r"what is in your \1 hand",
    ),
    (
        r"(the|that|this|my) ((?:\w+ )?\w+) (?:that )?(?:you(?:'re| are) (?:carrying|holding)|"
        r"you (?:hold|carry|have))(?: there)?(?= (?:goes|belongs|should|needs|can|is|to|on|in)\b)",
        r"\1 \2 you are holding",
    ),
    (r"give (?:me|us) (?=(?:a|an|one) (?:quarter|half|full|complete|whole) (?:turn|spin))", "do "),
    (r"(?:tip|tilt|bend|lean) your (?:head|neck|face) back", "look up"),
    (r"(?:raise|lift) your (?:head|eyes|gaze|face)(?: up)?", "look up"),
    (r"(?:lower|drop) your (?:head|eyes|gaze|face)(?: down)?", "look down"),
    (
        r"(?:tip|tilt|bend|lean|point|aim|move|swing) your (?:head|neck|face|eyes|camera|gaze) "
        r"(?=(?:up|down|left|right|to)\b)",
        "look ",
    ),
    (
        r"(?:spin|turn|swing)(?: right)? (?:a?round|about),? so (?:that )?you(?:'re| are) "
        r"(?:looking|facing) (?:behind you|backwards?|away|the (?:other|opposite) "
        r"(?:way|direction|side))",
        "turn around",
    ),
    (
        r",? so (?:that )?you(?:'re| are) (?:looking|facing) (?:behind you|backwards?|away|"
        r"the (?:other|opposite) (?:way|direction|side)|where you came from)$",
        "",
    ),
    (r"show me how you(?:'d| would| can| could)? (?=[a-z])", ""),
    (
        r"^(?:and )?(?:just )?(?:a )?((?:little |wee |tiny )?(?:bit|tad|touch)) "
        r"(?=more|further|farther)",
        r"a \1 ",
    ),
    (
        r"(the [^,]+?) is where (the [^,]+?) (?:should|ought to) (?:be|go)",
        r"\2 goes to \1",
    ),
    (r"(?:finish|end)(?: up)?(?: back)?(?: here)? (?:at|in|by) (?=(?:the|my|your)\b)", "go to "),
    (
        rf"((?:in|into|inside) (?:the|that|my) (?:\w+ )?({'|'.join(sorted(CONTAINERS))}))\b(.*?) "
        r"(in|into|inside) the (\w+) one",
        r"\1\3 \4 the \5 \2",
    ),
    (r"to (?:me|us)(?: here)? (?:in|at|by|on) (?=(?:the|my|our)\b)", "to "),
    (
        r"(?:whichever|whatever) ((?:\w+ )?\w+) (?:is|are|lies|stands|sits) "
        r"(?=(?:closest|nearest|farthest|furthest|next)\b)",
        r"the \1 that is ",
    ),
    (
        r"((?:come|look|go|turn|open|close|lift|tilt)\b[^,;.!?]*?) (?:for )?(?:a|one|half a) "
        r"(?:minute|moment|second|sec|tick|mo)(?=$|[,.!?])",
        r"\1",
    ),
    (
        r"in (?:the|your) (left|right)(?: hand)?((?:,| and\b)[^.;!?]+) in (?:the|your) "
        r"(left|right)(?: hand)?$",
        r"in your \1 hand\2 in your \3 hand",
    ),
    (
        r"((?:what's|the (?:thing|one)) in your "
        r"(?:left|right))(?! (?:hand|arm|gripper|claw))",
        r"\1 hand",
    ),
    (r"help me (?:to )?(?=(?:find|look|search)\b)", ""),
    (r"(?:shift|get|move|take|haul|drag|bring) yourself (?:\w+ )?(?:in)?to ", "go to "),
    (r"(?:come (?:and )?)?keep me company (?:in|at) (?=(?:the|my|your)\b)", "go to "),
    (
        r"^(?:with|using|use) (?:your|the) (left|right) (hand|arm)(?: now| please| for this(?: "
        r"one)?)?,? (?:and |to )?([^,.;]+)",
        r"\3 with your \1 \2",
    ),
    (r"(?:do|make) an? (?:one[- ]eighty|180)", "turn around"),
    (r"(?:turn|swing|spin) yourself about", "turn around"),
    (r"make (?:me|us) (?=an? )", "do "),
    (r"open up (?=(?:your|the|both)\b)", "open "),
    (r"(put|take|tidy|clear) me (away|up|down)\b", r"\1 \2"),
    (
        r"(?:see to it|make sure|ensure)(?: that)? ((?:the|my|it|that|this|both|all|they)"
        r"(?: (?!\bis\b|\bare\b)[\w']+){0,6}?) (?:is|are|ends? up|goes|gets?) "
        r"(?:put )?(in|into|on|onto) ",
        r"put \1 \2 ",
    ),
    (r"you(?:'re| are) (?:needed|wanted) (?:over )?(?:at|in|by) ", "go to "),
    (r"i(?: want|'d like| need| would like) you over (?:at|in|by) (?=(?:the|my|your)\b)", "go to "),
    (
        rf",? after (?:which|that|this){NO_OCCASION},? "
        r"(?:i want you to |you should |you can |please )?(?=[a-z])",
        ", then ",
    ),
    (r"let(?:'s| us) (?:begin|start) with ([^,]+), which (?=goes|belongs|should)", r"\1 "),
    (
        rf"(?:(?<=, )|(?<=: )|(?<=and )|^)(?=(?:(?:{_COLOUR}|big|small) (?:{KIND_WORDS})|"
        rf"(?!can\b)(?:{KIND_WORDS}))s? (?:goes|go|ought|needs?|should|belongs?|has to|wants?|"
        rf"into|onto|back)\b)",
        "the ",
    ),
    (r"(lift|pick|get|take|grab) ([^,;.!?]+?) up off (?=(?:the|that|this|my)\b)", r"\1 \2 off "),
    (
        r"((?:pick|lift|take|get|grab|remove|fetch)\b[^,;.!?]*?) off (?:of )?(?=(?:the|that|this|"
        r"my)\b)",
        r"\1 from ",
    ),
    (r"off to ([^,;.!?]+?) with you", r"go to \1"),
    (
        r"(?:let's |let us )?get rid of ([^,;.!?]+)[,;:.]+ (?:just )?(leave|put|drop) (?:it|them)",
        r"\2 \1",
    ),
    (r"i(?:'d| would) (?:rather|prefer to) (?:have|see)", "i want"),
    (r",? until you(?:'re| are) (?:looking|facing) (?=(?:up|down|left|right)\b)", " "),
    (
        r"^(the|that|my) ([^,;.!?]+?) you (?:can|may|should|could|ought to) "
        r"(put down|put away|take|leave)((?: [^,;.!?]*)?)",
        r"\3 \1 \2\4",
    ),
    (
        r"(?:tell me|check|see|find out|say) (?:if|whether) ((?:the|my|a|your) [^,]+?) (is|are) "
        r"(?=(?:still )?(?:in|on|at|inside)\b)",
        r"\2 \1 ",
    ),
    (
        r"(?:get|take|bring|put) yourself back on charge|^back on charge",
        "back to your charging station",
    ),
)
_TABLE: Final = tuple(
    (re.compile(rf"(?:\b|(?<=\s)){pattern}"), instead)
    for pattern, instead in (*SHORT_FORMS, *_ROWS)
)


def reworded(text: str) -> str:
    """Return a command in lower case in plain words."""
    for pattern, instead in _TABLE:
        text = pattern.sub(instead, text)
    return in_active_voice(text)
