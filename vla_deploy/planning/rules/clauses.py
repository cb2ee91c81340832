"""Take a sentence apart: politeness off, a stop recognised, one clause for each thing to do."""

import re
from functools import lru_cache
from typing import Final

from vla_deploy.planning.references import words_of
from vla_deploy.planning.rules.breaths import without_breaths
from vla_deploy.planning.rules.figures import in_figures
from vla_deploy.planning.rules.rewording import NO_OCCASION, reworded
from vla_deploy.planning.rules.run_together import with_commas
from vla_deploy.planning.rules.verbs import DOING, any_verb
from vla_deploy.planning.understanding.purposes import without_purpose
from vla_deploy.world.vocabulary import OBJECT_CLASSES

MOST_LETTERS: Final = 400
# More clauses than that are no command that rules should answer.
MOST_CLAUSES: Final = 12
STOP_WORDS: Final = frozenset(
    {
        "stop", "halt", "freeze", "cancel", "abort", "stop now", "stop it", "stop moving",
        "stop there", "stop right there", "stop everything", "stop all", "never mind", "nevermind",
        "dont move", "do not move", "stand still", "hold still", "hold it", "emergency stop",
        "stop stop", "stop stop stop", "no stop", "whoa", "wait stop", "cancel it", "abort mission",
        "stop what you are doing", "stop what youre doing", "cancel everything", "stop at once",
        "stop immediately", "halt now", "freeze now", "enough",
    }
)  # fmt: skip
_POLITE_BEFORE: Final = re.compile(
    r"^(?:please|yo|ooh|yay|(?:would|do) you mind|could you|can you|would you|will you|mind|robot|"
    r"butler|"
    r"hey butler|hey robot|can(?= (?:go|come)\b)|"
    r"(?:then )?use (?:it|that|your (?:free|other) hand) to|"
    r"okay butler|ok butler|hello butler|hi butler|hey|ok|okay|now|just|kindly|i want you to|"
    r"i would like you to|i'd like you to|i need you to|you should|you need to|you have to|you can|"
    r"let's|lets|let us|go ahead and|first(?: of all)?|"
    r"be so kind as to|how about you|how about|what about|"
    r"i was wondering if you (?:could|would)|i wonder if you (?:could|would)|"
    r"i'd (?:appreciate it|be (?:glad|happy|grateful)) if you(?:'d| would| could)|"
    r"i would (?:appreciate it|be (?:glad|happy|grateful)) if you(?:'d| would| could)|"
    r"what i (?:want|need) is for you to|possibly|so|well|quickly|maybe|perhaps|"
    r"go (?:and )?(?=(?:get|fetch|grab|pick|find|look|search|bring|take|put|tidy|clean|wait|see|"
    r"check|charge|dock|stand|park|turn|open|close|drop|leave|give|have)\b)|"
    r"come (?:and )?(?=(?:stand|wait|get|fetch|pick|take|help|look)\b)|"
    r"(?:would|will) you be able to|are you able to|is it possible (?:for you )?to|"
    r"(?:could|can|may|might) i (?:ask|trouble|get|bother) you to|"
    r"you(?:'d| had)? better|i'd like for you to|i would love (?:it )?(?:if you|for you to)|"
    r"it would be (?:nice|great|good) if you(?: could)?|"
    r"see if you can|try to|try and|start to|next|finally|also|alright|all right|"
    r"if it(?:'s| is) not too much trouble|excuse me|pardon me|if you don't mind|"
    r"right then|but(?= (?:go|also|do|take|put|pick|bring|keep|hang|hold|leave)\b)|"
    r"you(?= (?:look|go|take|get|bring|find|pick|fetch|drive|come|turn|search|carry|recharge|"
    r"charge|move)\b)|"
    r"when(?:ever)? you (?:get|have) (?:a|the) (?:sec|second|minute|moment|chance)|"
    r"ever(?= \w)|you(?:'ll| will) have to|you (?:may|might)|"
    r"why don't you|go on then|i(?:'d| would) be obliged if you(?:'d| would)|i wonder whether "
    r"you (?:could|would)|"
    r"only(?= (?:look|turn|move|open|close|lift|take|put|drive|tilt)\b)|"
    r"already(?= \w)|it's time to|time to|away and|plus|if you(?:'d| would| could)(?= "
    r"(?:just|please|kindly)\b)|but(?= don't (?:drop|let go|put down)\b))\b[, ]*"
)
_POLITE_AFTER: Final = re.compile(
    r"[, ]*\b(?:please|thanks|thank you|now|right now|if you can|if you could|will you|"
    r"would you|could you|can you|butler|robot|quickly|immediately|at once|instead|somewhere|"
    r"anywhere|for us|and nothing else|"
    r"for (?:later|good|keeps)|(?<!look )(?<!search )for (?:him|her)|for (?:my|our|the) "
    r"(?:daughter|son|wife|husband|mum|mom|mother|dad|father|"
    r"grandma|granny|gran|grandpa|grandad|sister|brother|kids?|children|baby|guests?|friends?|"
    r"missus|visitors?|neighbours?|boss|nurse|doctor|partner|girlfriend|boyfriend)|"
    r"mate|love|dear|darling|pet|pal|buddy|bud|lol|sweetie|this time|"
    r"with (?:everything else|the (?:rest|others|other ones))|where (?:it|they) belongs?|"
    r"carefully|gently|my friend|cheers|ta|right away|"
    r"straight away|real quick|asap|okay|ok|if you would|if you don't mind|if possible|"
    r"when(?:ever)? you (?:can|get (?:a|the) (?:chance|moment|minute|second)|"
    r"have (?:a|the) (?:chance|moment|minute|second|time)|(?:are|get) (?:here|back|done|ready|"
    r"finished|home)|'re (?:here|back|done|ready|finished|home))|"
    r"when you're (?:here|back|done|ready|finished|home)|"
    r"these days|nowadays|on the spot|in place|for now|just for now|at (?:the moment|present)|"
    r"this (?:minute|instant|very \w+)|for once|"
    r"where (?:i|we) can (?:find|see|reach|get at) (?:it|them)(?: \w+)?)$|"
    r",\s*(?:son|hen|lad|lass|man|boss|chief|sir|madam|ma'am|honey|sweetheart|guys|folks|eh|yeah|"
    r"yes|huh|innit|alright|hon|bach|miss|darlin'|good fellow|there's a good (?:fellow|chap|"
    r"lad))$|,\s*right\?$|,\s*no\?$|[.!?, ]+$"
)
# What likens a clause to another one, and says nothing where it can stand alone.
_ECHO: Final = re.compile(
    r"[, ]*\b(?:again|too|also|as well|likewise|once more|(?<!the )first|next|after that)$"
)
_SPLIT: Final = re.compile(
    r"\s*(?:[,;.!?]?\s*\b(?:and then|and after that|"
    rf"after that{NO_OCCASION}|"
    r"afterwards|then|"
    r"(?<!\bgo )(?<!\btry )and|(?<=\bgo )and(?= (?:come|go|then|drive|return)\b)|"
    r"but(?= (?:then|hang|hold|keep|leave|bring|take|put|pick|come)\b))\b|[,;]|[.!?]\s)\s*"
)
# What people say while they think, and words said twice.
_FILLER: Final = re.compile(
    r",?\s*\b(?:um+|uh+|er+m?|hmm+|ugh|och|aye|oops|(?<!do )(?<!did )you know(?! where| what| if|"
    r" the)|like,|let me (?:think|see)(?=,)|"
    r"(?:what's|what is|what was|what are) (?:it|that|they|its name)(?: called)?(?: again)?(?=,)|"
    r"how do you (?:say|call it)|what do you call it|whatsit|whatchamacallit)(?=[\s,.!?]|$),?\s*"
)
_DOTS: Final = re.compile(r"\s*(?:\.{2,}|\u2026)\s*")
_TWICE: Final = re.compile(r"\b(\w+)(?: \1\b)+")
# Whole parts of a sentence that ask for nothing.
_COURTESY: Final = re.compile(
    r"(?:hello|hi|hey|good (?:morning|day|afternoon|evening))(?: there| robot| butler)?|excuse me|"
    r"pardon(?: me)?|thanks(?: .*)?|thank you(?: .*)?|cheers|please|(?:if|when|whenever) you(?: "
    r"don't mind|'re ready| are ready| have (?:a|the) (?:\w+))|if it(?:'s| is) not too much "
    r"trouble|if possible|you know what|listen|(?:any|either)(?: (?:one|of (?:them|those)|cup|"
    r"ball|book|bottle|can|bowl|phone|remote))?(?: (?:will|would) do| is fine| you (?:like|"
    r"want))?|whichever(?: one)?(?: (?:you (?:like|want|prefer|find)|is (?:closest|nearest|"
    r"fine)))?|(?:it )?(?:doesn't|does not) matter which(?: one)?|i don't (?:mind|care)(?: "
    r"which(?: one)?)?|(?:and )?(?:then )?you(?:'re| are) (?:all )?done|(?:and )?(?:you )?can "
    r"go(?: now)?|that(?:'s| is| will be| would be) (?:all(?: i need)?|it|great|lovely|enough)|no "
    r"(?:rush|hurry)|(?:no,? )?(?:that's |it's |that was )?(?:the )?wrong one|take your time|"
    r"(?:oh|ah|aw|ooh|well|hm+|mm+|righto|ok|okay|yes)(?: yes| yeah| well)?|yeah|yep|aye|right "
    r"then|keep going|carry on|(?:and )?(?:have a )?rest|take a break|(?:and )?don't (?:let it "
    r"(?:slip|fall|drop)|drop it|spill (?:it|any))|(?:there's |there is )?no need (?:for you "
    r")?to\b.*|(?:did|have|do) you (?:see|seen) (?:it|them)(?: anywhere| somewhere)?|or "
    r"(?:whether|if) .*|good (?:robot|boy|girl|job)|well done|great|perfect|lovely|brilliant|"
    r"super|excellent|cool|nice|good|fine|do me a favou?r|(?:can|could|would|will) you (?:sort|"
    r"see to|do|arrange|handle) (?:that|it)(?: out)?(?: for me)?|(?:don't|do|haven't|have|isn't|"
    r"is|aren't|are|can't|can|won't) (?:you|i|we|it|they)|not (?:a bit|any|one step|an inch|"
    r"much)? ?(?:further|farther|more)|(?:my )?(?:dear|love|mate|darling|pet|buddy|pal|friend|lad|"
    r"son|sweetheart)|(?:and )?stay (?:there|near me|with me|put|close(?: by)?|where you are)|"
    r"(?:and |but |please )*leave (?:it|them|that|(?:the|my) \w+(?: \w+)?) "
    r"(?:right |just |exactly )?(?:where|as) (?:it|they) (?:is|are)|"
    r"(?:keep|leave) your (?:wheels|base|feet|body) (?:where they are|where it is|still)|"
    r"where(?:ver)? (?:it|they) (?:is|are|may be|might be)"
)
# At the beginning these ask for nothing either; later on they are a side, and something to do.
_OPENING: Final = re.compile(r"right(?: then)?|look")
# Before these the speaker has changed his mind about what he has just said.
_REPAIR: Final = re.compile(
    r"(?:no,? wait|wait,? no|(?:oh|ah|um|er|well),? no|no|sorry|i (?:mean|meant|said)|"
    r"or rather|rather|actually(?:,? no)?|correction|make (?:that|it)|that is)\b"
)


def is_stop(text: str) -> bool:
    """Tell whether a command means: stop what you are doing."""
    if len(text) > MOST_LETTERS:
        return False
    said = [one for one in _SENTENCE.split(text) if words_of(one)]
    sentences = [one for one in said if not _URGING.fullmatch(" ".join(words_of(one)))]
    return bool(sentences) and all(map(_is_stop, sentences))


_SENTENCE: Final = re.compile(r"[.!?;]+")
_URGING: Final = re.compile(r"(?:and|but|no|oh|hey|please|robot|butler|just|now| )+")


def _is_stop(text: str) -> bool:
    said = " ".join(words_of(polite_off(text).replace("'", "")))
    urged = _URGED.sub("", said)
    is_halt = urged in _STOPS and urged.startswith(_HALTS)
    return said in _STOPS or is_halt or _STOP_DOING.fullmatch(urged) is not None


# What people say before it who want it now; "no, never mind" may still answer a question.
_URGED: Final = re.compile(r"^(?:(?:and|then|but|no|wait|oh|hey|i (?:said|say)|just|now) )+")
# "Stop driving to the kitchen", but not "stop looking and come here".
_STOP_DOING: Final = re.compile(
    r"(?:stop|quit|cease) (?!(?:any|some|every|no)thing)[a-z]{2,}ing\b"
    r"(?!.* (?:and|then|but|instead)\b).*"
)
_HALTS: Final = ("stop", "halt", "freeze", "dont move", "do not move", "hold still", "stand still")
_STOPS: Final = frozenset(" ".join(words_of(spoken)) for spoken in STOP_WORDS) | {"stop that"}


def polite_off(text: str) -> str:
    """Return a command in lower case without what only asks nicely, or likens it to another."""
    return _commanded(text, (_POLITE_BEFORE, _POLITE_AFTER, _ECHO))


def courtesy_off(text: str) -> str:
    """Return a command in lower case without what only asks nicely; "again" and "too" stay."""
    return _commanded(text, (_POLITE_BEFORE, _POLITE_AFTER))


def _commanded(text: str, patterns: tuple[re.Pattern[str], ...]) -> str:
    """Return what is left without the patterns: "get the cup" of "do you mind getting the cup"."""
    asked = plain(text)
    own = _without(asked, patterns)
    verb, space, rest = own.partition(" ")
    is_asked = _ASKS_DOING.search(asked.removesuffix(own)) is not None
    return f"{DOING[verb]}{space}{rest}" if is_asked and verb in DOING else own


_ASKS_DOING: Final = re.compile(r"\b(?:mind|how about|what about)\b")
# "And" joins what a thing is between; nothing new begins with it.
_BETWEEN: Final = re.compile(
    r"\b(between (?:[\w']+ ){1,4}?)and (?=(?:the|a|an|my|your|that|this|those|these)\b)"
)


# Rules try many readings of a command: the same clauses come again and again.
@lru_cache(maxsize=256)
def plain(text: str) -> str:
    """Return a text in lower case without hesitation, with words in full that were run together."""
    text = _DOTS.sub(", ", text)
    text = " ".join(_FILLER.sub(" ", text.lower().replace("\u2019", "'")).split())
    text = with_commas(without_purpose(without_breaths(text)))
    text = _REASON.sub("", _ASKED_BETWEEN.sub(", ", text))
    text = reworded(text)
    return in_figures(_TWICE.sub(r"\1", _BETWEEN.sub(r"\1& ", text)))


_VERBS: Final = any_verb("stop", "clean", "search", "charge", "hang")
# "Get my keys would you they are by the bed", said in one breath.
_ASKED_BETWEEN: Final = re.compile(
    r" (?:would you|could you|will you|please) (?=(?:they|it|i|he|she)\b)"
)
_REASON: Final = re.compile(
    r"^(?:i|we|you|there|they|he|she|somebody|someone|my \w+)"
    r"(?:'[a-z]+| am| is| are| will| have| has| need| want| got| had)? "
    r"(?!.*\b(?:if|when|until|unless)\b).+?,? so "
    rf"(?=(?:please |just |first |now |can you |could you )?(?:{_VERBS})\b|"
    r"(?:the|my|that) (?:\w+ ){1,2}(?:goes|belongs) (?:in|on|to)\b)"
    rf"(?!(?:(?!\b(?:{'|'.join(OBJECT_CLASSES)})s?\b).)*\b(?:it|them|there|those|that)\b)"
)
"""What is said before a command to say why; conditions are none."""


def _without(text: str, patterns: tuple[re.Pattern[str], ...]) -> str:
    """Return a text without what any pattern finds in it, as long as words are left."""
    while True:
        before = text
        for pattern in patterns:
            text = pattern.sub("", text).strip() or text
        if text == before:
            return text


def segments(text: str) -> list[str]:
    """Return what stands between the conjunctions of a sentence, courtesies left out."""
    parts = [polite_off(part) for part in _SPLIT.split(text) if part.strip(" .!?,")]
    if len(parts) > 1 and _OPENING.fullmatch(parts[0]):
        parts = parts[1:]
    return [part for part in parts if not _COURTESY.fullmatch(part)] or parts


def repaired(part: str) -> str | None:
    """Return what a part says in the place of the one before ("" for what only begins to).

    None where it says something of its own.
    """
    changed = False
    while found := _REPAIR.match(part):
        part, changed = part[found.end() :].strip(" ,"), True
    return part if changed else None
