"""List the rules: what a clause looks like, what it is for, and what builds its steps."""

import re
from typing import Final

from vla_deploy.planning.rules import (
    building,
    cleaning,
    giving,
    moving,
    placing,
    questions,
    returning,
)
from vla_deploy.planning.rules.intents import Intent
from vla_deploy.planning.rules.pattern_parts import (
    ANGLE,
    HAND,
    INTO,
    LITTLE,
    METRES,
    OBJECT,
    PLACE,
    ROLL,
    SAID_OF,
    SECONDS,
    SHARE,
    SIDE,
    WAY,
    Row,
    Rule,
)

_ROWS: Final[tuple[Row, ...]] = (
    *questions.ROWS,
    *giving.ROWS,
    # --- bring
    (Intent.MANIPULATION, r"(?:bring|fetch|get|give|hand|pass|run|grab|lend) (?:me|us)"
     rf"(?: back| over| in| up| down| out)? {OBJECT}",
     building.bring),
    (Intent.MANIPULATION, r"i(?:'d| would)? (?:want|need|like) (?P<object>(?:the|my|that|this|"
     rf"those|these|both|all) .+) to (?:go|be|be put) (?:back )?{INTO} (?P<destination>.+)",
     placing.put),
    (Intent.MANIPULATION, rf"box(?: up)? {OBJECT}", placing.put_away),
    (Intent.MANIPULATION, r"i(?:'d| would)? (?:want|need|like) "
     r"(?P<object>(?:the|my|that|this|those|these|both|all) .+?) (?:to (?:be|go) |put |moved )?"
     rf"(?:back )?{INTO} (?P<destination>.+)", placing.want),
    (Intent.MANIPULATION, rf"(?:bring|carry|take|fetch|get|hand|give|deliver|pass|run|move) "
     rf"{OBJECT} (?:over |in |through |up |out |down )?(?:here(?: (?:to|for) me)?|(?:back )?to "
     rf"me(?: here)?)|(?:bring|fetch|carry) (?P<object2>.+?) (?:through|over|in|along)",
     building.bring),
    (Intent.MANIPULATION, rf"(?:i )?need {OBJECT} (?:over |in )?here(?: (?:to|with|for) me)?|"
     r"(?:come|return|be|run) (?:straight )?back(?: here| to me)? with (?P<object2>.+)",
     building.bring),
    (Intent.MANIPULATION, rf"(?:get|fetch|grab|take|pick up|bring) {OBJECT} for me|"
     r"(?:i )?(?:need|want|would like|'d like) (?P<object2>(?:the|my|a|an|that|this) .+)",
     building.bring),
    (Intent.MANIPULATION, r"i (?:could do with|could use|fancy|'d love|would love|'d like|"
     r"feel like) (?P<object>(?:the|my|a|an|that|this|some) .+)", building.bring),
    (Intent.MANIPULATION, r"i(?:'d)? (?:want|need|would like|like) (?P<object>.+?) back"
     r"(?: (?:again|here))?|i(?:'ll| will) (?:take|have) (?P<object2>.+?)"
     r"(?: back| (?:off|from) you)?", building.bring),
    (Intent.MANIPULATION, rf"fetch {OBJECT}", building.bring),
    (Intent.MANIPULATION, r"(?:(?:can|could|may|might) (?:i|we) (?:please |just |maybe )?"
     r"(?:have|get|borrow|trouble you for|bother you for|ask (?:you )?for)|"
     r"let (?:me|us) (?:have|borrow)|(?:is there )?any chance of(?: getting)?|"
     r"(?:is it|would it be) possible to (?:have|get)|have) "
     r"(?P<object>(?:the|my|a|an|that|this|some|our) .+?|it|them)"
     r"(?: (?:over |in )?here(?: (?:to|with|for) me)?| to me)?",
     building.bring),
    # --- go to
    (Intent.NAVIGATION, r"(?:(?:go|come|drive|head|roll) back|return)(?: here| to (?:me|us|"
     r"where you (?:were|are)(?: now)?))?|(?:and )?back (?:here|to me)", building.go_back),
    (Intent.NAVIGATION, r"(?:go|drive|come|move|navigate|return|walk|head|travel|roll|proceed|get|"
     rf"run)(?: back| over| on| off| out| in| along| down| up| through| across)?(?: over)? (?:to|"
     rf"towards?|into|for) {PLACE}", building.go),
    (Intent.NAVIGATION, rf"(?:off (?:you go|with you)|be off|off|(?:roll|trundle|nip|duck|slip|"
     rf"whizz|trot|march|toddle|zip|pop|scoot|hop|wander|zoom|run|dash|glide|cruise)(?: off| over|"
     rf" along| across)?)(?: back)? (?:to|into|over to|through to|in) {PLACE}", building.go),
    (Intent.NAVIGATION, rf"(?:home(?: you go)?|on|through|up|down|across) to {PLACE}",
     building.go),
    (Intent.NAVIGATION, rf"(?:come (?:and )?)?(?:meet|join|find|see) (?:me|us) (?:in|at|by|over "
     rf"at) {PLACE}|(?:get |right )?back (?:on|onto|to|into|in|at|over to) (?P<place2>(?:the|your|"
     rf"my) .+)|(?:run |go )?(?:wait|stay|stand)(?: for (?:me|us|them|him|her|it))? at "
     rf"(?P<place4>.+)|(?:swing|stop|drop|call|pass) (?:by|in at|by at|round) (?P<place3>.+)",
     building.go),
    (Intent.NAVIGATION, rf"(?:go|get|move|come|drive) (?:up )?close(?:r)? to {PLACE}",
     building.go),
    (Intent.NAVIGATION, rf"(?:take|bring|get) yourself (?:back |off |over |along |out |in )?to "
     rf"{PLACE}|to (?P<place2>the .+)", building.go),
    # --- wait
    (Intent.ASSIST, rf"(?:wait|pause|rest|hold on|stay|hang (?:about|around|on))(?: here| "
     rf"there)?(?: (?:for )?{SECONDS})?",
     building.wait),
    (Intent.NAVIGATION, r"(?:wait|stay|stand|stop)(?: there| for me)? (?:in|by|near|beside|"
     rf"next to|outside) {PLACE}", building.go),
    # --- keep
    (Intent.MANIPULATION, r"(?:keep (?:a )?hold of|keep holding(?: on to)?|keep|hang on to|"
     rf"hang onto|hold on to|hold onto|don't (?:put down|drop|let go of)) {OBJECT}"
     r"(?: in your (?:left |right )?hands?)?", placing.keep),
    # --- put
    (Intent.MANIPULATION, rf"(?:put|set|drop|lay|place|pop|stick|stand|leave|park) {OBJECT} "
     rf"(?:down )?on (?:the|this) (?:table|desk|shelf|surface|one)(?: right| just)? in front of "
     rf"(?:you|me|us)",
     placing.put_here),
    (Intent.MANIPULATION, rf"(?:put|drop|pop|stick|place|throw|set|lay) {OBJECT} in(?:side)?(?: "
     rf"there)?",
     placing.put_into_that),
    (Intent.MANIPULATION, rf"(?:put|set|place|lay|take|bring|return|carry|leave) {OBJECT} "
     r"(?:back )?(?:to )?where (?:it|they|that|you) (?:(?:was|were|came from|belongs?|had been)"
     r"(?: (?:before|earlier))?|(?:found|got|took|had) (?:it|them)(?: from)?)", returning.put_back),
    (Intent.MANIPULATION, rf"(?:put|set|place|lay) back {OBJECT} {INTO} (?P<destination>.+)",
     placing.put),
    (Intent.MANIPULATION, rf"(?:put|set|place|lay|take) {OBJECT} back(?: again)?|"
     r"(?:put|set|place|lay) back (?P<object2>.+)", returning.put_back),
    (Intent.MANIPULATION, rf"(?:put|set|lay|place) {OBJECT} (?:back )?down|"
     r"(?:put|set|lay|place|pop) down (?P<object2>.+?)",
     placing.put_down),
    (Intent.MANIPULATION, r"drop(?: (?P<object>it|that|this|them))?", placing.put_down),
    (Intent.MANIPULATION, r"(?:free|empty) (?:(?:both )?your|both) hands(?: here)?",
     placing.empty_hands),
    (Intent.MANIPULATION, rf"(?:free|empty) {HAND}", placing.empty_hand),
    (Intent.MANIPULATION, r"(?:free|empty) (?:(?:both )?your|both) hands(?: here)? "
     r"(?P<relation>in|into|on|onto) (?P<destination>.+)", placing.empty_hands),
    (Intent.MANIPULATION, rf"(?:tidy|clear|pack) {OBJECT} (?:away|up) {INTO} (?P<destination>.+)",
     placing.put),
    (Intent.MANIPULATION, rf"(?:tidy|clear|pack|clean)(?: up| away)? {OBJECT} "
     r"(?P<relation>in|into|inside) (?P<destination>.+)", placing.put),
    (Intent.MANIPULATION, rf"(?:put|stow|tidy|clear|pack|store|take) {OBJECT} away|"
     r"(?:put away|stow(?: away)?|store|pack away) "
     r"(?P<object2>(?:(?! (?:in|into|inside|on|onto) ).)+)", placing.put_away),
    (Intent.MANIPULATION, rf"(?:put|place|drop|set|throw|lay|move|carry|bring|stow|store|"
     rf"stack|stand|leave|deposit|stick|insert|deliver|return|transfer|transport) {OBJECT} "
     rf"(?:down |away |off )?{INTO} (?P<destination>.+)", placing.put),
    # What is taken or brought so is what stands there already.
    (Intent.MANIPULATION, rf"(?:put|place|drop|set|lay|move|stick|pop|deposit) {OBJECT} "
     rf"(?:down |over |back |in )?(?:right |just )?(?P<relation>{building.BESIDE}) "
     r"(?P<destination>.+)", placing.put),
    (Intent.MANIPULATION, rf"(?:take|bring|carry) {OBJECT} (?:along|with you)(?: with you)?",
     building.pick),
    (Intent.MANIPULATION, r"(?:(?:away|off|down|over|back|out) with (?P<object2>.+?) "
     r"(?P<relation2>in|into|on|onto|to) (?P<destination2>(?:the|my|that|this) .+))|(?:(?:over|"
     r"off|back|up|down) )?(?P<relation>in|into|on|onto|to) (?P<destination>(?:the|my|that|this) "
     r".+?) with (?P<object>(?:the|my|that|this|both|all) .+|it|them)", placing.put),
    (Intent.MANIPULATION, rf"(?:take|carry|run|bring|move) {OBJECT} "
     rf"(?P<relation>(?:(?:{building.WAYS}) )?(?:to|into|onto|"
     r"over to)|back (?:in|on)) (?P<destination>.+)", placing.put),
    (Intent.MANIPULATION, rf"(?:pop|chuck|slip|tuck|dump|plonk|plop|slide|shove|toss|bung|sling|"
     r"park|rest|plant|lodge|prop|plunk|whack|fling) "
     rf"{OBJECT} (?:down |away |back )?(?P<relation>into|inside|in|onto|on top of|on) "
     r"(?P<destination>.+)", placing.put),
    (Intent.MANIPULATION, rf"(?:put|place|take|bring|carry|move|pop|stick|chuck|drop|set|lay|"
     rf"leave) {OBJECT} (?P<destination>(?:over |back )?there)", placing.put_there),
    (Intent.MANIPULATION, rf"(?:leave|keep|put|set|drop|lay|place) {OBJECT} (?:down )?"
     r"(?:(?:right |over )?here(?: on (?:the|this) (?:table|desk|shelf|surface))?|"
     r"on this (?:table|desk|shelf|surface)(?: here)?)", placing.leave_here),
    (Intent.MANIPULATION, rf"{SAID_OF} (?:goes|go|belongs?|lives?|(?:should|must|has to|have to|"
     rf"(?:is|are) to|had better|needs to|need to|ought to|can|wants to) (?:go|be|live|stand|sit|"
     rf"stay|end up|lie)) (?:back )?{INTO} (?P<destination>.+)", placing.put),
    # --- straight and turning
    (Intent.NAVIGATION, rf"(?:move|drive|go|roll|step|come|{ROLL}) (?P<little>{LITTLE} )?{WAY}"
     rf"(?: (?:by |for )?{METRES})?(?P<little2> {LITTLE})?", moving.drive),
    (Intent.NAVIGATION, rf"(?:(?:move|drive|go|roll|step)(?: by)? )?{METRES} {WAY}",
     moving.drive),
    (Intent.NAVIGATION, rf"(?:roll|drive|carry|keep going) (?P<way>on)(?: for| by)? {METRES}",
     moving.drive),
    (Intent.NAVIGATION, rf"(?P<way>back (?:up|off|away)|reverse)(?: (?:by )?{METRES})?"
     rf"(?P<little> {LITTLE})?", moving.drive),
    (Intent.NAVIGATION, r"(?:turn|spin|rotate) (?:a?round once|once a?round|"
     r"(?:all the way|right|completely) a?round(?: once)?|(?:in )?(?:a|one) circle)",
     moving.turn_whole),
    (Intent.NAVIGATION, r"(?:turn|spin|rotate) half(?: ?way)? (?P<way>a?round)", moving.turn),
    (Intent.NAVIGATION, rf"(?:(?:turn|spin|rotate|make|do|take)(?: by)? )?{SHARE} "
     rf"(?:turn|circle|rotation|spin)(?: (?:to )?(?:the |your )?{SIDE})?", moving.turn_share),
    (Intent.NAVIGATION, rf"(?:turn|spin|rotate)(?: by)? {SHARE} (?:to )?(?:the |your )?{SIDE}",
     moving.turn_share),
    (Intent.NAVIGATION, rf"(?:turn|spin|rotate) (?:to )?(?:the |your )?{SIDE}(?: by)? {SHARE}"
     r"(?: turn| circle)?", moving.turn_share),
    (Intent.NAVIGATION, rf"(?:turn|rotate|spin|face|swivel)(?P<little> {LITTLE})?"
     rf"(?: to)?(?: the| your)? ?{SIDE}(?: (?:by )?{ANGLE})?(?P<little2> {LITTLE})?",
     moving.turn),
    (Intent.SEARCH, r"turn your head (?P<what>.+?)(?: for (?:a|one) (?:moment|second|bit|while))?",
     building.look),
    (Intent.NAVIGATION, rf"{ANGLE} (?:to (?:the|your) )?(?P<way>left|right)", moving.turn),
    (Intent.NAVIGATION, rf"(?:turn|rotate|spin|swivel|pivot)(?: by)? {ANGLE}"
     rf"(?: (?:(?:to|on|towards) )?(?:the |your )?{SIDE})?", moving.turn),
    (Intent.NAVIGATION, r"(?:make|take|do) an? (?P<way>left|right)(?: turn)?|do a u-?turn",
     moving.turn),
    # --- arms
    (Intent.MANIPULATION, rf"(?P<verb>open|close|shut) {HAND}", building.gripper),
    (Intent.MANIPULATION, r"(?:tuck|fold)(?: in)?(?: your)?(?: (?P<arm>left|right))? arms?(?: in)?",
     building.tuck),
    (Intent.MANIPULATION, r"(?:move|bring|put) (?:your |the )?(?:(?P<arm>left|right) )?arms? "
     r"(?:to|into|in) (?:the )?(?P<pose>[a-z_ ]+?)(?: pose| position)?", building.pose),
    # --- go
    (Intent.NAVIGATION, rf"(?:go|come|return|drive|head|walk|navigate|move)(?: back)? {PLACE}",
     building.go),
    (Intent.NAVIGATION, rf"(?:visit|approach|make your way to|find your way to|dock at|"
     rf"stand (?:by|at|before)|(?:(?:park|plant|station)(?: yourself)?|(?:place|put) yourself) "
     rf"(?:at|on|in front of|by|beside|next to)|position yourself at) {PLACE}", building.go),
    (Intent.NAVIGATION, r"(?:go )?(?:dock|charge|recharge)(?: yourself| your batter(?:y|ies))?",
     building.dock),
    # --- search
    (Intent.SEARCH, rf"(?:search|check|look (?:in|on|around|through)|scan) {PLACE} for {OBJECT}",
     building.find),
    (Intent.SEARCH, r"(?:check|see|look|find out) (?:if|whether) (?:there(?:'s| is| are)|"
     rf"(?:you can|you|we have|we've got)(?: see| find| spot)?) (?:any |an? |some )?{OBJECT}"
     r"(?: (?:some|any)where)?(?: (?:in|around) (?:the|this|our) (?:flat|house|apartment|home))?",
     building.find),
    (Intent.SEARCH, rf"(?:find out|find me|find|search for|locate|look for|seek|hunt for|"
     rf"track down|spot|detect|show me|point out|go (?:and )?find|(?:have a )?look around for|"
     rf"check) {OBJECT}(?: to me)?", building.find),
    (Intent.SEARCH, r"look around|have a look around|scan (?:the )?(?:room|area|surroundings)",
     building.look_around),
    (Intent.SEARCH, rf"(?:look around|scan|check(?: on)?) (?:in |at |on )?{PLACE}",
     building.look_around),
    (Intent.SEARCH, r"(?:look|glance|(?:have|take) a (?:\w+ )?look) (?P<side>up|down|left|right) "
     r"(?:at|to|towards?|on) (?P<what>.+)", building.look),
    (Intent.SEARCH, r"(?:look|(?:have|take) a (?:wee |quick |good |close |closer |little )?look|"
     r"gaze|glance)(?: at| to| towards?)? (?P<what>.+?)(?: for me)?", building.look),
    # --- clean
    (Intent.CLEANING, r"(?:clean|tidy|clear)(?: things)?(?: up)?|clear (?:things )?away",
     cleaning.tidy),
    (Intent.CLEANING, rf"(?:clean|tidy|clear)(?: up| off)? {PLACE}", cleaning.tidy),
    (Intent.CLEANING, r"(?:patrol|visit|inspect|tour|(?:time for |do |make |have )?(?:an? |your |"
     r"the )?(?:\w+ )?(?:rounds?|tour|loop|lap|walk))\b[^:]*: ?(?:first )?(?P<place>.+)",
     cleaning.visit),
    (Intent.CLEANING, r"(?:patrol|visit|inspect|tour) (?:the |my |our )?"
     r"(?:flat|house|apartment|home|rooms?|place) (?:and )?(?:first )?(?P<place>.+)",
     cleaning.visit),
    (Intent.CLEANING, r"(?:patrol|inspect|sweep(?: through)?|cover(?: the floor (?:of|in))?|"
     r"drive (?:all )?over(?: the floor (?:of|in))?) (?P<place>.+?)(?: floor)?", cleaning.patrol),
    # --- pick
    (Intent.MANIPULATION, rf"(?:get|take|fish|dig|pull|pick|lift|fetch|bring|remove|retrieve|grab|"
     rf"scoop|collect) {OBJECT} (?:back )?(?:up )?(?:out(?: of| from)|from inside) (?P<source>.+)",
     building.pick_from),
    (Intent.MANIPULATION, rf"bring {OBJECT}", building.bring),
    (Intent.MANIPULATION, r"(?:get|take|fish|dig|pull|pick|lift|fetch|scoop) (?P<object>.+?) "
     r"(?:back )?(?:out(?: of (?:it|there))?|off (?:it|there|that))", building.pick),
    (Intent.MANIPULATION, rf"(?:pick|lift|take up)(?: up)? {OBJECT}(?: up| off)?", building.pick),
    (Intent.MANIPULATION, r"(?:(?:grab|take|grasp|get|collect|hold|pick up|put) )?(?:a|an|one) "
     r"(?P<object>.+?) in(?:to)? (?:each|either|both)(?: of your)?(?: hands?| fists?| grippers?)?",
     building.pick_two),
    (Intent.MANIPULATION, r"(?:have|hold) (?P<object>it|them|that) in your hands?|"
     r"(?P<object2>(?:the|my|that|this) .+) in(?:to)? your hand", building.pick),
    (Intent.MANIPULATION, rf"(?:grab|take|grasp|get|collect|hold|raise|seize|catch|remove|nab|snag|"
     rf"snatch|swipe|clutch|nick)"
     rf"(?: (?:a )?hold of)? {OBJECT}", building.pick),
    # --- the rest
    (Intent.ASSIST, r"(?:(?:say|announce|repeat after me)[:,]?|tell [a-z]+(?= that))(?: that)? "
     r"(?P<text>.+)|(?:tell|let) (?:(?:the|my|our) )?(?:kids?|children|boys?|girls?|family|guests?|"
     r"everyone|everybody|them|him|her|wife|husband|mum|mom|dad)(?: know)?(?: that)? "
     r"(?P<text2>(?:the |my |that |it|i|we|there|she|he|they|[a-z]+'s |[a-z]+ is ).+)",
     building.speak),
    (Intent.ASSIST, r"(?P<text>hello|hi|good morning|good evening|good night)(?: there)?",
     building.speak),
)  # fmt: skip

RULES: Final[tuple[Rule, ...]] = tuple(
    Rule(intent=intent, pattern=re.compile(pattern), build=build)
    for intent, pattern, build in _ROWS
)
