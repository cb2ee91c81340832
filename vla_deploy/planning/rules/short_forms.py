"""List what people run together, slip in, or say by habit, each with the plain words for it.

gimme the keys   where on earth are me keys   that can go in the box   about a foot
"""

from typing import Final

from vla_deploy.world.vocabulary import COLOURS, KIND_WORDS

_COLOUR: Final = "|".join(COLOURS)
_BEGIN: Final = r"(?:^|(?<=, )|(?<=and ))"

ROWS: Final[tuple[tuple[str, str], ...]] = (
    ("gimme", "give me"),
    (r"(i|he|she|they)(?:'ve|'s| have| has) (?:gone|been) and ", r"\1 have "),
    ("lemme have", "give me"),
    (
        r"(?:have|take) a (?:good |quick |proper )?look (?:a?round|about|through) "
        r"(?:(?:the|my|our) )?(?:whole )?(?:place|flat|house|home|apartment|rooms?) for (?=\w)",
        "look for ",
    ),
    (r"(bring|get|fetch) (me|us) ((?:the|my) \w+(?: \w+)?) back(?=$|[,.!?]| and\b)", r"\1 \2 \3"),
    (
        r"(?:get|take|bring|move|park|haul|drag|shift) yourself "
        r"(?:(?:back|over|on|up|down|out|off) )*(?:to|on|onto|in|into|at|by|next to|near) "
        r"(?=(?:the|that|your|my)\b)",
        "go to ",
    ),
    (r"(?:wants?|needs?|has|have|ought) to go (?=(?:in|into|on|onto|back)\b)", "should go "),
    (r"both them (?=[a-z]+s\b)", "both the "),
    (r" where (?:i|we)(?:'ll| will| can) (?:see|find|reach) (?:it|them)(?=$|[,.!?]| and\b)", ""),
    (r"nah,? (?=[a-z])", "no, "),
    (r"(?<=[a-z] )(?:only|just) (?=(?:the|my|that|those|these)\b)", ""),
    ("wanna", "want to"),
    ("gotta", "have to"),
    ("gonna", "going to"),
    ("outta", "out of"),
    ("'em", "them"),
    ("whereabouts(?= (?:is|are)\\b)", "where"),
    (r"thae\b", "those"),
    (r"(?:the|them) both of them|the (?:two|three|both) of them", "them"),
    (r"(?<=[a-z] )(it|them) me$", r"\1 to me"),
    (r"where've", "where have"),
    (r",? here (?=(?:on|in|at) (?:the|this|that)\b)", " "),
    (r", while (?=(?:the|my|that|this|both)\b)", ", and "),
    (r"from (?=(?:beside|next to|by|near|under|behind) )", ""),
    (r"(nearest|closest) (?=(?:the|my|your|that|this)\b)", r"\1 to "),
    (r"ma(?= (?:keys|phone|remote|book|cup|bottle|ball|can|bowl)\b)", "my"),
    (r"(mr|mrs|ms|dr)\. ", r"\1 "),
    (
        rf"(?:his|her|their|our) (?=(?:(?!the\b|an?\b|my\b|your\b)[a-z]+ )?(?:{KIND_WORDS}|bedside|"
        r"nightstand|table|bed|bedroom|room|kitchen|desk|side|coffee|charger)s?\b)",
        "the ",
    ),
    (
        r"(?<=[a-z] )(?:cos|cuz|coz|'cause|because) (?=(?:i|we|he|she|they|it|my|the|there)\b)",
        ", because ",
    ),
    (r"where'd\b", "where did"),
    (r"both of (?:those|these)(?=$|[,.!?]| (?:on|in|to|away|down|up|into|over)\b)", "both of them"),
    (r"that(?:'s| is) (?:lying |standing |sitting )?on (?:it|there)", "on it"),
    (r"like (?=(?:an? (?:foot|metre|meter|step)|\d|two|three)\b)", ""),
    (r"(?:about|roughly|around) (?=an? (?:foot|metre|meter|step)\b)", ""),
    (r"on the ((?:\w+ )table) in front of (?:you|me|us)", r"on the \1"),
    (
        r"(?:on earth|in the world|the (?:hell|heck|devil|blazes)|in (?:the name of )?"
        r"(?:god|heaven)(?:'s name)?) (?=(?:is|are|did|have|has|do)\b)",
        "",
    ),
    (
        r"(?:be (?:a|an) (?:dear|love|star|angel|pal|good \w+)|be so (?:kind|good)|"
        r"do me a favou?r) and (?=[a-z])",
        "",
    ),
    (r"(?:and )?while you(?:'re| are) (?:at it|there|up),? ", ""),
    (r",? for (?:tonight|today|the night|the moment|the time being|now)(?=$|[,.!?]| and\b)", ""),
    (
        r"(?:about|roughly|approximately|around|some) (?=(?:\d|one|two|three|four|five|ten|fifteen|"
        r"twenty|thirty|forty|fifty|sixty|ninety|half a|a (?:half|quarter|foot|metre|meter))\b"
        r"[^,]*\b(?:degrees?|m|met(?:er|re)s?|cm|centimet(?:er|re)s?|feet|foot|inch(?:es)?|steps?)\b)",
        "",
    ),
    (r"^(?:listen,? )?(?:service|attention|listen|(?:new |next )?(?:job|task|order)s?): ", ""),
    (r",? (?:like )?all the way (?:a?round)(?=$|[.!?,])", ""),
    (r"for my (?:video|photo|picture|story|channel)", ""),
    (rf"{_BEGIN}they go (?=(?:in|on|into|onto|back)\b)", "put them "),
    (r"(leave|put|set|pop) me (?=(?:the|my|that|this)\b)", r"\1 "),
    (
        r"^(the|my|that) ([a-z ]+?),? (?:also|too),? you (?:can |may |should |could )?"
        r"(leave|put|set|drop) (there|here|down)(?=$|[,.!?])",
        r"\3 \1 \2 \4 too",
    ),
    (
        r"(bring|give|get|fetch|hand) (?:grandma|granny|gran|nana|mum|mom|dad|daddy|grandpa|"
        rf"grandad) (?:the|her|his) (?=(?:[a-z]+ )?(?:{KIND_WORDS})\b)",
        r"\1 me the ",
    ),
    (
        r"^(?:there(?:'s| is) )?something(?: is|'s)? (?:lying|standing|sitting) (on(?: top of)?|in|"
        r"under|next to|beside) ((?:the|my) [^.!?,]+)[.!?,]+ ([^.!?]*?)\b(?:that|it)(?=$|[,.!?])",
        r"\3the thing \1 \2",
    ),
    (
        r"(put|set|place|drop|pop) ([a-z ]+?) in (?:there |the same (?:box|place) )?with "
        rf"(?=(?:the|my) (?:[a-z]+ )?(?:{KIND_WORDS})\b)",
        r"\1 \2 next to ",
    ),
    (r"turn right (?:a?round|about)(?=$|[,.!?]| and\b)", "turn around"),
    (r"(?:to )?wherever ((?:the|my|that) [^,;.!?]+?) (?:is|are)(?=$|[,.!?]| and\b)", r"to \1"),
    (r",? or (?:nah|not|no|what)(?=$|[?!.])", ""),
    (r"^wait,? (?=(?:is|are|where|where's|what|do|did|have)\b)", ""),
    (r",? i (?:guess|suppose|reckon)(?=$|[.!?,])", ""),
    (r"(?:too|as well),? (?=(?:with|in|using) your (?:left|right)\b)", ""),
    (
        r"(?: anywhere| somewhere)? in (?:this|the|our|my) (?:apartment|flat|house|home|place)"
        r"(?=$|[,.!?])",
        "",
    ),
    (r",? and if (?:we|you|so)(?: do| have(?: one)?)?,? where(?: is it)?(?=$|[?.!])", ""),
    (r",? and (?:try to )?look (?:useful|busy|smart|nice|pretty|happy|cheerful)", ""),
    (
        r"keep (?!.*\b(?:until|till|while|when|if|for|where)\b)"
        r"(?=(?:the|my|this|that|our) (?:(?!\b(?:in|on)\b)[^,;.!?])+ (?:in|on|inside) "
        r"(?:the|my|our)\b(?! (?:left|right|other|same|hand)))",
        "put ",
    ),
    (
        r"((?:on|in|to) the (?:[a-z]+ )?(?:table|box|shelf|bowl)) with the "
        r"(?:[a-z]+s|rest|other (?:one|[a-z]+s))(?=$|[,.!?])",
        r"\1",
    ),
    (
        r"(?:on|onto|to) (?:the|that) (?:table|one|desk|shelf) where ((?:the|my) [^,;.!?]+?) "
        r"(?:is|are|stands?|lies?)(?=$|[,.!?])",
        r"next to \1",
    ),
    (r"do (?=(?:the|that|my) (?:other|[a-z]+ one)\b)", ""),
    (
        rf"(?:^|(?<=, )|(?<=: ))((?:(?:{_COLOUR}) )?(?:{KIND_WORDS})) (?=(?:in|into|on|onto) "
        rf"(?:the|my|that) (?!left|right)[^,;.!?]+?(?:,|,? and|,? then) (?:and |then )*"
        rf"(?:(?:(?:{_COLOUR}) )?(?:{KIND_WORDS})|you|put|the|my)\b)",
        r"put the \1 ",
    ),
    (
        r"^i need (?:one|two|three|a few|a couple of|some) (?:things|jobs) (?:doing|done)"
        r"[^:,;.!?]*[:,.] ",
        "",
    ),
    (r"get (?:a )?(?:good )?(?:hold|grip) of (?=(?:the|my|that|this|your)\b)", "pick up "),
    (r"take up (?=(?:the|my|that|this)\b)", "pick up "),
    (rf"them (?=(?:\w+ )?(?:{KIND_WORDS})s?\b)", "those "),
    (r"(?:right|just|directly|immediately) (?=(?:beside|next to|behind|near)\b)", ""),
    (r"^here,? (?=(?:give|take|hand|have|hold)\b)", ""),
    (r"^i mean (?=(?:the|that|my) [^.;!?]+, )", ""),
    (
        rf"{_BEGIN}(the|that|my) ([a-z ]+?) you (?:can |may |should |could )?"
        r"(give|hand|pass)(?: over)? (?:to )?me",
        r"give me \1 \2",
    ),
    (
        r"(?:^|(?<=, )|(?<=and )|(?<=but ))(the|that|my) ([a-z ]+?) you "
        r"(?:can |may |should |could )?keep(?=$|[,.!?])",
        r"keep \1 \2",
    ),
    (
        r"^with ([^,;.!?]+?),? (?:please |then |now )*do (?:exactly )?(?:the same|that|so)",
        r"do the same with \1",
    ),
    (
        r"i(?:'d| would)? (?:like|want) (the [^,;.!?]+?) (?:in |on )?there (?=(?:too|as well)\b)",
        r"put \1 there ",
    ),
    (
        r"((?:bring|fetch|get|give) (?:me|us) [^,;.!?]+?) here (?:in|into|to) (?:the|my) "
        r"[^,;.!?]+",
        r"\1",
    ),
    (r"go (?:a?round|over|past|out|back) by (?=the\b)", "go to "),
    (
        rf"{_BEGIN}({KIND_WORDS}) (down|over|back) (?=(?:on|in|to|into|onto) "
        r"(?:the|this|that|my)\b)",
        r"put the \1 \2 ",
    ),
    (r"(?:and|then) (the [^,;.!?]+?) (?:in|into) after (?:it|them|that)", r"then put \1 in there"),
    (r"it comes (?=(?:in|into|on|onto|back (?:in|on|to))\b)", "it goes "),
    (
        r"i(?:'ve| have)(?: got)? (?:a (?:good )?(?:grip|hold) (?:of|on) |hold of )?"
        r"((?:the|that|my) [a-z]+(?: [a-z]+)?),? (?:so |and )?(?:you (?:can |may ))?"
        r"let (?:it |that )?go(?: of it)?",
        r"let go of \1",
    ),
    (
        r"(?:the|my|our) (?:baby|kid|child|boy|girl|wife|husband|mother|mum|mom|father|dad|"
        rf"grandma|grandpa|sister|brother|guest)'s (?=(?:[a-z]+ )?(?:{KIND_WORDS})\b)",
        "the ",
    ),
    (r"outermost ([a-z]+) on the (left|right)", r"\2most \1"),
    (
        r"(?:clear|put|tidy) away ([^,;.!?]+?), (?:it|that|this) (?:goes|belongs) "
        r"(?=(?:in|on|into|onto)\b)",
        r"put \1 ",
    ),
    (r"(?:^|(?<=^right, )|(?<=^okay, ))tidy[- ]up time[,.!]* ", ""),
    (
        r"fire (?=(?:the|my|that|those|this|it|them)\b[^,;.!?]* (?:in|into|on|onto) "
        r"(?:the|my|that)\b)",
        "put ",
    ),
    (r"in on (?=(?:the|my|that)\b)", "on "),
    (r"(?:away|off|over) on charge", "go to your charging station"),
    (
        r"(?:finish|end)(?: up)? back (?:here|where you (?:are|were|started)(?: from)?(?: now)?)",
        "come back here",
    ),
    (r"here (?=into (?:the|my)\b)", ""),
    (
        r"look (?:a?round|all over|through) (?:the|my|our) (?:whole )?"
        r"(?:place|flat|house|home|apartment|rooms?) for (?=\w)",
        "look for ",
    ),
    (
        r"(?:see|check|look) is ((?:the|my) \w+(?: \w+)?) (?:inside |over |still )?"
        r"(?=(?:in|on|at)\b)",
        r"see if \1 is ",
    ),
    (r"look down (?:to|at|on) the (?:floor|ground)(?: once| for once)?", "look down"),
    (r"look up (?:to|at) the ceiling(?: once| for once)?", "look up"),
    (r"(small|tiny|wee) little", r"\1"),
    (r"(half|quarter)-(?=turn|circle|spin)", r"\1 "),
    (
        rf"(?<!bring )(?<!give )(?<!get )(?<!fetch )(?<!hand )(?<!pass )(?<!find )(?<!show )"
        rf"(?<!tell )(?<!for )(?<!to )me (?=(?:{KIND_WORDS})\b)",
        "my ",
    ),
    (
        rf"(bring us|give us|get us|fetch us|where are|where's|lost|found) me "
        rf"(?=(?:{KIND_WORDS})\b)",
        r"\1 my ",
    ),
    (r"(that|it|this|they|those|these) can (?=(?:go|be|stay|live|come)\b)", r"\1 should "),
    (r"(on|in|at) (the|that|this) (\w+) there(?=$|[,.;!?]| and\b| then\b)", r"\1 \2 \3"),
)
