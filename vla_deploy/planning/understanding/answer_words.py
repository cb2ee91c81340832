"""List the words of answers: yes and no, any and all, which place in a row, what says nothing."""

import re
from typing import Final

from vla_deploy.planning.understanding.phrases import EXTREMES, ORDER_WORDS, ORDINALS, SIDES
from vla_deploy.world.query import ORDERS

NO_WORDS: Final = re.compile(
    r"(?:no|nope|nah|never ?mind|forget (?:it|about it|that)|cancel|neither|none|nothing|"
    r"not now|don'?t|do not|leave it|no thanks?|no thank you|"
    r"(?:none|neither|not any|nor any) of (?:them|those|these|the (?:two|three|four))|"
    r"neither (?:one|the one nor the other))(?: (?:one|please|thanks|thank you))*"
)
YES_WORDS: Final = re.compile(
    r"(?:yes|yeah|yep|yup|sure|ok|okay|right|correct|exactly|of course|please do|do it|do that|"
    r"go now|go|now|go ahead|go on|confirm(?:ed)?|affirmative|that'?s right|that is right)"
    r"(?: (?:please|now|go|do it|do that|do|go ahead|that one|that'?s right))*"
)
ANY_WORDS: Final = re.compile(
    r"(?:either|any|whichever|any one|anyone|i don'?t care|doesn'?t matter|"
    r"it doesn'?t matter|you choose|your choice|whatever)(?: (?:one|of them|will do|is fine))*"
)
# Several, where one was asked for: no other command, and nothing that could be gone on with.
ALL_WORDS: Final = re.compile(
    r"(?:both|all|each|every one)(?: (?:of (?:them|those|these)|two|three))*"
)
# Places in the row of the candidates, from 1.
PLACES: Final = {**ORDINALS, "former": 1, "latter": 2}
# What says nothing of which one is meant.
SILENT: Final = frozenset(
    {
        "the", "a", "an", "one", "ones", "please", "i", "mean", "meant", "want", "take", "pick",
        "it", "is", "its", "that", "this", "thing", "on", "in", "at", "to", "of", "with", "my",
        "your", "side", "and", "uh", "um", "er", "well", "just", "give", "me", "bring", "use",
        "from", "yes", "no", "rather", "other", "are", "which", "there", "over",
        "that's", "it's", "said", "oh", "sorry", "ah", "hm", "hmm", "actually", "thanks", "thank",
        "you", "cheers", "ta", "mate", "dear", "love", "one's", "i'd", "like", "would",
        "think", "was", "thinking", "meaning", "talking", "about", "then", "guess", "suppose",
        "two", "three", "those", "these", "should", "have", "had", "aye", "erm", "probably",
        "maybe", "course", "duh", "obviously", "if", "make", "there's", "isn't",
        "aren't", "question",
        "good", "for", "them", "we", "only", "let's", "pet", "alright",
    }
)  # fmt: skip
# Words of the questions themselves.
FILL: Final = frozenset({"the", "one", "on", "in", "a", "an"})
WORD: Final = re.compile(r"[a-z0-9_']+")
TO: Final = re.compile(
    r"^(?:(?:go |back |over )*(?:to|into|in|at|on|onto|by) )?(?:(?:the|my|your) )?"
)
PIECE: Final = re.compile(r"\s*(?:[,;.!?]|\s-+\s)\s*")
NOT: Final = re.compile(
    r"(?:no )?(?P<any>(?:any|either|anything|whichever)(?: one| of them)? )?(?:the one )?"
    r"(?:but not|but|not|except|other than|apart from|(?:that |which )?is(?:n'?t| not)|"
    r"(?:you can )?(?:leave|keep|hang on to|hold on to)|"
    r"i (?:don'?t|do not) (?:want|mean)) (?P<not>.+?)(?: alone| where it is)?(?: but (?P<rest>.+))?"
)
# What people say when they are asked, before they answer.
SURPRISE: Final = re.compile(
    r"(?:oh |ah |well |hm )*"
    r"(?:there(?:'s| is| are| were)|you(?:'ve| have)(?: got)?|i see|are there) "
    r"(?:two|three|four|several|both|more(?: than one)?)(?: of (?:them|those|these))?(?: there)?|"
    r"(?:(?:is|are) not|isn't|aren't|wasn't|haven't|hasn't) (?:there|it|they|you|we|i)|"
    r"(?:(?:oh|ah|well|hm|good (?:question|point)|fair (?:enough|point)|my mistake|right|sorry)"
    r"\b ?)+"
)
NEGATES: Final = re.compile(
    r"\b(?:not|no|never|neither|nor|but|except|what|where|why|how|who|avoid|beside|besides|instead|"
    r"without|hardly|forget|hate|dislike|wrong|out|if|when|later|tomorrow|do you|are "
    r"you)\b|n't\b|^(?:is|are|was|does|did)\b"
)
OR: Final = re.compile(r" (?:or|nor|and)(?: not)? ")
# Words of an answer even where they tell no candidate from the others.
COMPARING: Final = frozenset({*EXTREMES, *SIDES, *ORDERS, *ORDER_WORDS, *ORDINALS, "furthest"})
FROM_SIDE: Final = re.compile(
    rf"\b({'|'.join(ORDINALS)})(?: one)?(?: counting| counted)? (?:from|on) (?:the )?(left|right)\b"
)
