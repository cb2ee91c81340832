"""List what people run together, slip in, or say by habit, each with the plain words for it.

gimme the keys   where on earth are me keys   that can go in the box   about a foot
"""

from typing import Final

from vla_deploy.world.vocabulary import KIND_WORDS

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
    (r"that(?:'s| is) (?:lying |standing |sitting )?on (?:it|there)", ""),
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
    (r" for (?:tonight|today|the night|the moment|the time being|now)(?=$|[,.!?]| and\b)", ""),
    (
        r"(?:about|roughly|approximately|around|some) (?=(?:\d|one|two|three|four|five|ten|fifteen|"
        r"twenty|thirty|forty|fifty|sixty|ninety|half a|a (?:half|quarter|foot|metre|meter))\b"
        r"[^,]*\b(?:degrees?|m|met(?:er|re)s?|cm|centimet(?:er|re)s?|feet|foot|inch(?:es)?|steps?)\b)",
        "",
    ),
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
