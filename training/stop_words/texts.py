"""Say what is spoken for the training besides stop words: all that holds none."""

import pydoc_data.topics
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from training.stop_words.amid_talk import amid_talk
from training.stop_words.picking import pick

Draw = Callable[[np.random.Generator], "Other"]
WORDS: Final = ("stop", "halt", "freeze")
"""The classes, in the order of the network's outputs; output 0 is none of them."""

# Whoever says one of these says a stop word, whole or as part of another, however it is spelt.
_LIKE_A_WORD: Final = re.compile(
    r"\b\w*stop(?!ped|ping|per|s\b)\w*|\b\w*freeze(?!r|s\b)\w*|\bhalt\b|\bfrees\b|\bfrieze\b"
    r"|\bst(aw|ah)p|\bstopt|\bh(aw|au)lt|\bfr(ee|ea)(z|s)e?\b",
    re.IGNORECASE,
)

CONFUSABLE: Final = (
    "stopped", "stopping", "stops", "stopper", "top", "tops", "topped", "tap", "tip", "shop",
    "shops", "shopping", "chop", "chopped", "stuff", "step", "steps", "stepped", "spot", "spots",
    "spotted", "stock", "stocks", "stalk", "stork", "stump", "stomp", "stoop", "stub", "strop",
    "strap", "strip", "swap", "slop", "flop", "flopped", "crop", "drop", "drops", "dropped",
    "prop", "props", "cop", "hop", "mop", "pop", "popped", "scope", "store", "storm", "star",
    "start", "started", "stay", "stand", "still", "stack", "stick", "stiff", "staff", "stamp",
    "steep", "stoke", "stove", "stone", "stood", "stew", "stage", "sop", "sob", "sock", "sought",
    "sort", "salt", "spa", "spark", "spout", "at", "up", "the", "top", "set", "up", "sit", "up",
    "stuck", "stalled", "style", "status", "subtle", "half", "halves", "hall", "hauled", "haul",
    "hold", "hole", "hot", "hat", "hut", "hurt", "alt", "alter", "altar", "salt", "fault", "malt",
    "vault", "wall", "all", "also", "always", "bolt", "assault", "exalt", "halter", "halted",
    "halting", "holt", "hull", "hulk", "heart", "hard", "art", "wallet", "tall", "tolled",
    "called", "fall", "hello", "hollow", "holiday", "altogether", "ought", "caught", "bought",
    "walked", "free", "freed", "freely", "freezer", "freezing", "freezes", "froze", "frozen",
    "fries", "fry", "frizz", "three", "threes", "threw", "breeze", "please", "pleased", "peas",
    "peace", "piece", "cheese", "knees", "trees", "tree", "tease", "fleece", "freak", "fridge",
    "phrase", "praise", "bees", "sneeze", "squeeze", "these", "keys", "seas", "seize", "sees",
    "street", "sleeve", "leaves", "fees", "flees", "feast", "feed", "friend", "from", "freight",
    "fresh", "hold", "on", "wait", "cup", "up", "now", "not", "box", "box", "on", "right", "left",
    "go", "no", "robot", "hope", "help", "held", "hurry", "both", "dock", "study", "big",
)  # fmt: skip
CARRIERS: Final = (
    "{a}",
    "{a} {b}",
    "the {a}",
    "a {a} and a {b}",
    "{a} it",
    "please {a}",
    "robot {a}",
    "{a} now",
    "go to the {a}",
    "I like the {a} of the {b}",
    "he {a} and she {b}",
    "is that a {a} or a {b}",
    "{a}, {b}, {c}",
    "put the {a} on the {b}",
    "out in the {a}",
    "it was all {a} and {b}",
    "two of these {a}",
    "could you {a} up, please",
    "not {a} but {b} for me",
)
_COMMANDS: Final = (
    "pick up the {colour} {thing}",
    "put the {thing} in the box",
    "put it on the table",
    "bring me the {colour} {thing}",
    "go to the {place}",
    "drive to the {place} and look around",
    "find the {thing}",
    "where is the {thing}",
    "turn left",
    "turn right a little",
    "move forward one metre",
    "come here",
    "open the gripper",
    "raise your left arm",
    "what can you see",
    "take the {thing} to the {place}",
    "follow me to the {place}",
    "clean up the {place}",
    "hand me the {thing} please",
    "wait a moment",
    "yes",
    "no",
    "thank you",
)
_TALK: Final = (
    "I was at the {place} when {name} called about the {thing}",
    "did you see the film with {name} last night",
    "it will probably rain again on {day}",
    "we could have pasta and peas for dinner on {day}",
    "my sister moved to another flat in {day}'s snow",
    "the train was late so we walked up the hill instead",
    "how much did you pay for that {colour} {thing}",
    "{name} always drops the keys somewhere near the {thing}",
    "let us play a game of cards after supper",
    "turn the music up a bit, this part is good",
    "I have to be at work at half past seven on {day}",
    "she opened a shop next to the old town hall",
    "there is a spot on your shirt, just at the top",
    "could you help me with my homework, {name}",
    "the dog barked at the neighbours all night long",
    "we should get a new fridge, this one is too small",
    "he started to laugh and would not calm down",
    "I think the {colour} one looks better than the other",
    "what time does the bus leave on {day}",
    "three hundred and forty two, minus seventeen",
    "the doctor told {name} to rest for two weeks",
    "mix the flour with the butter and add a pinch of salt",
    "who left the {thing} on the {place} floor",
    "nobody told me that the meeting was moved to {day}",
)
_FILL: Final = {
    "colour": ("red", "blue", "green", "yellow", "white", "black", "orange", "big", "small"),
    "thing": ("cup", "ball", "book", "bottle", "phone", "keys", "box", "bowl", "can", "remote"),
    "place": ("kitchen", "table", "door", "sofa", "hall", "bedroom", "shelf", "window", "desk"),
    "name": ("Anna", "Peter", "Sophie", "Robert", "Kate", "Paul", "Mister Hopper", "Stella"),
    "day": ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday"),
}
_ONSETS: Final = (
    "st", "st", "s", "sh", "t", "ch", "h", "h", "f", "fr", "fr", "f", "th", "b", "p", "pl", "k",
    "g", "d", "l", "r", "m", "n", "w", "st", "sp", "str", "sl",
)  # fmt: skip
_NUCLEI: Final = (
    "o", "o", "aw", "a", "ah", "u", "ee", "ee", "ea", "i", "e", "ay", "oh", "oo", "ai",
)  # fmt: skip
_CODAS: Final = (
    "p", "p", "b", "pt", "ps", "ck", "t", "t", "d", "lt", "lt", "ld", "l", "z", "z", "s", "ze",
    "zed", "f", "m", "n", "ng", "k", "x", "", "",
)  # fmt: skip

_SENTENCE: Final = re.compile(r"[A-Z][a-z]+(?: [a-z]+[,;]?){3,16}[.?!]")


def is_clean(text: str) -> bool:
    """Return whether nobody who reads a text aloud says a stop word."""
    return _LIKE_A_WORD.search(text) is None


@dataclass(frozen=True, slots=True, kw_only=True)
class Other:
    """Hold a text without a stop word, and whether it is one that people may say any day.

    The others are made to sound like a stop word, or chosen because something in them does.
    """

    text: str
    is_ordinary: bool


def other_talk(
    count: int, random: np.random.Generator, lexicon: Sequence[str], example: Draw
) -> list[Other]:
    """Return texts of all kinds that hold no stop word.

    `lexicon` gives any words of English, `example` sentences of it.
    """
    running, at_home = _running_talk(), _talk_at_home()

    def ordinary(draw: Callable[[], str]) -> Callable[[], Other]:
        return lambda: Other(text=draw(), is_ordinary=True)

    def made(draw: Callable[[], str]) -> Callable[[], Other]:
        return lambda: Other(text=draw(), is_ordinary=False)

    kinds = (
        *(2 * [made(lambda: _carried(CONFUSABLE, random))]),
        made(
            lambda: amid_talk(pick(CONFUSABLE, random), random, at_home, before=True, after=False)
        ),
        ordinary(lambda: _filled(_COMMANDS, random)),
        ordinary(lambda: _filled(_TALK, random)),
        ordinary(lambda: pick(running, random)),
        *(2 * [ordinary(lambda: pick(at_home, random))]),
        *(4 * [lambda: example(random)]),
        made(lambda: " ".join(pick(lexicon, random) for _ in range(int(random.integers(1, 7))))),
        made(lambda: " ".join(_made_up(random) for _ in range(int(random.integers(1, 5))))),
    )
    texts = (pick(kinds, random)() for _ in range(2 * count))
    return [one for one in texts if is_clean(one.text)][:count]


def _running_talk() -> list[str]:
    """Return sentences of running English that every Python carries."""
    return [s for topic in pydoc_data.topics.topics.values() for s in _SENTENCE.findall(topic)]


def _talk_at_home() -> list[str]:
    lines = Path(__file__).with_name("talk.txt").read_text(encoding="utf-8").splitlines()
    return [line for line in lines if not line.startswith("#")]


def _carried(words: Sequence[str], random: np.random.Generator) -> str:
    carrier = pick(CARRIERS, random)
    return carrier.format(a=pick(words, random), b=pick(words, random), c=pick(words, random))


def _filled(patterns: Sequence[str], random: np.random.Generator) -> str:
    filling = {key: pick(values, random) for key, values in _FILL.items()}
    return pick(patterns, random).format(**filling)


def _made_up(random: np.random.Generator) -> str:
    return "".join(pick(part, random) for part in (_ONSETS, _NUCLEI, _CODAS))
