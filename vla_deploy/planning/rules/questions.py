"""List the rules for questions, and for what is no motion: looked at before all others."""

from typing import Final

from vla_deploy.planning.rules import building, telling
from vla_deploy.planning.rules.intents import Intent
from vla_deploy.planning.rules.pattern_parts import OBJECT, PLACE, Row

ROWS: Final[tuple[Row, ...]] = (
    # --- stop
    (Intent.STOP, r"(?:stop|halt|freeze|stand still)(?: moving| there)?", building.stop),
    # --- questions
    (Intent.QUESTION, r"what (?:do|can) you see|what is there|what's there|what is around(?: you)?|"
     r"describe (?:the (?:scene|room)|what you see)|tell me what you see|what is in front of you|"
     r"what objects (?:do you see|are there)", telling.tell_sight),
    (Intent.QUESTION, rf"what(?:'s| is| do you see| can you see)(?: there)? (?:on|at) {PLACE}",
     telling.tell_sight),
    (Intent.QUESTION, rf"(?:which|what) {OBJECT} (?:is|are|stands?|lies?)(?: there)? "
     rf"(?P<where>(?:on|in|at) .+)", telling.tell_which),
    (Intent.QUESTION, r"what (?:are you holding|do you (?:hold|have)|have you got)"
     r"(?: in your hands?)?|what(?:'s| is) in your (?:left |right )?hands?|"
     r"(?:are you holding|do you (?:hold|have)) (?:anything|something)(?: in your hands?)?",
     telling.tell_hands),
    (Intent.QUESTION, r"where are you|where am i|which room (?:are you|is this)(?: in)?",
     telling.tell_place),
    (Intent.QUESTION, rf"(?:do you (?:happen to |by any chance )?(?:know|remember|recall) |any "
     rf"idea |(?:can|could) you (?:tell me|remember) |tell me |i wonder |i forgot )?where (?:i|we|"
     rf"you|somebody|someone|he|she|they)(?:'ve| have|'s| has|'d| had)? (?:left|put|leave|dropped|"
     rf"laid) {OBJECT}(?: last night| this morning| yesterday| earlier| before)?",
     telling.tell_or_find),
    (Intent.QUESTION, rf"(?:where is|where are|where's|where did (?:i|you) (?:put|leave)|have you "
     rf"seen|you have(?:n't| not)(?: by any chance)? seen|(?:do you (?:happen to |by any chance "
     rf")?know|(?:have you (?:got )?|do you have |got )?(?:any|an?|the (?:faintest|slightest)) "
     rf"(?:idea|notion|clue)|tell me|i wonder|find out|see) where|what (?:have|has|did) (?:[a-z]+ "
     rf"){{1,3}}?(?:done|do) with|where (?:have|had|did) (?:i|we|you|they) (?:left|leave|put)) "
     rf"{OBJECT}(?: is| are|(?:'s| has| have)? gone|(?:'s| has| have)? got to| went| ended up| "
     rf"might be| could be)?(?: anywhere| somewhere)?(?: have you)?",
     telling.tell_or_find),
    (Intent.QUESTION, r"(?:(?:do|did) you (?:happen to )?know |any idea |tell me )?"
     rf"what(?:'s| has)? (?:become|became|happened|gone) (?:of|to|with) {OBJECT}",
     telling.tell_or_find),
    (Intent.QUESTION, rf"(?:do you see|is there|are there|see|(?:have|do) (?:we|you|i) (?:got|"
     rf"have)) (?:any |an? )?{OBJECT}(?: there| here| anywhere)?", telling.tell_whether),
    (Intent.QUESTION, rf"did (?:i|we|you) (?:leave|put|forget|drop) {OBJECT} (?:in |over |around "
     rf")?(?:here|somewhere|anywhere)(?: with me)?(?: last night| this morning| yesterday| "
     rf"earlier)?",
     telling.tell_or_find),
    (Intent.QUESTION, rf"where (?:did|do|have|has) {OBJECT} (?:end(?:ed)? up|go|gone|g[eo]t to)",
     telling.tell_or_find),
    (Intent.QUESTION, rf"how many {OBJECT}(?: are there| do you see| can you see| are here)?"
     r"(?: here| there)?", telling.tell_number),
    (Intent.QUESTION, r"(?:is|are) (?P<object>(?:the|my|your|a) .+ (?:on|in|by|next to) .+)",
     telling.tell_whether),
    # --- assist
    (Intent.ASSIST, r"help(?: me)?|i need (?:some |your )?help|assist(?: me)?|help out|"
     r"what (?:can|could) you do(?: for me)?|who are you|what are you|how can you help(?: me)?",
     telling.tell_abilities),
    (Intent.ASSIST, r"(?:hold|take) (?:this|that) from me|hold this", building.hold),
    (Intent.SEARCH, r"have a (?:\w+ )?(?:look|scout|search|hunt|rummage|nosey|gander|check)"
     rf"(?: a?round| about)? for {OBJECT}|(?:hunt|track|chase) down (?P<object2>.+?)|"
     r"(?:hunt|track|chase) (?P<object3>.+?) down", building.find),
)  # fmt: skip
