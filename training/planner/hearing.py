"""Spoil sentences as speech recognisers and hasty typists do, the plan's words along with them."""

from collections.abc import Mapping
from random import Random
from typing import Final

from training.planner.clause import Said

MISHEARD: Final[Mapping[str, tuple[str, ...]]] = {
    "to": ("two", "too", "the", "a"), "for": ("four", "fer", "from"), "pick": ("peck", "big",
    "picked", "kick"),
    "put": ("foot", "but", "puts", "pull"), "the": ("a", "da", "this", "their", "uh"),
    "bring": ("ring", "brink", "bringing"),
    "find": ("fine", "fined", "finds"), "turn": ("tern", "torn", "turned"), "right": ("write",
    "ride"),
    "left": ("lift", "laughed"), "in": ("and", "inn", "an"), "on": ("own", "an", "and"),
    "up": ("a", "app"),
    "cup": ("cop", "cap", "cub", "cups"), "red": ("read", "bread", "rad"), "blue": ("blew",
    "glue"), "me": ("may", "my", "mi"),
    "kitchen": ("chicken", "kitten"), "box": ("bucks", "boxes", "fox"), "book": ("brook", "hook",
    "look"),
    "bottle": ("bottles", "battle", "model"), "keys": ("kiss", "cheese", "kees"),
    "wait": ("weight", "way"),
    "hand": ("and", "hands", "hent"), "say": ("see", "sea", "said"), "look": ("luke", "looked",
    "book"),
    "take": ("steak", "tape", "took"), "place": ("please", "plays", "plate"), "and": ("an", "in",
    "end"),
    "go": ("goes", "so", "co"), "drive": ("dry", "drives", "thrive"), "move": ("moves", "moo",
    "groove"),
    "green": ("grain", "clean"), "white": ("why", "wide"), "phone": ("fawn", "bone"),
    "table": ("tables", "cable"),
    "ball": ("bawl", "balls", "wall"), "bowl": ("bold", "bull"), "can": ("ken", "cam"),
    "it": ("id", "at", "its"),
    "your": ("you", "you're", "yore"), "where": ("wear", "were", "we're"), "is": ("his", "as"),
    "grab": ("crab", "grabbed"),
    "give": ("gave", "live"), "get": ("got", "guest"), "fetch": ("fetched", "vetch"),
    "please": ("piece", "police", "peas"),
    "open": ("opened", "hope and"), "close": ("clothes", "closed"), "forward": ("four word",
    "foreword"),
    "back": ("bag", "pack"), "meters": ("meter", "mirrors"), "seconds": ("second", "segments"),
    "stop": ("stopped", "top"),
    "i": ("eye", "a"), "you": ("u", "ya"), "could": ("cud", "good"), "that": ("dad", "the"),
    "with": ("whiff", "width"),
    "one": ("won",), "two": ("to", "too"), "four": ("for",), "eight": ("ate",), "room": ("rome",
    "rum"),
}  # fmt: skip
SHORTENED: Final[Mapping[str, str]] = {
    "going to": "gonna",
    "want to": "wanna",
    "give me": "gimme",
    "let me": "lemme",
    "got to": "gotta",
    "because": "cause",
    "please": "pls",
    "you": "u",
    "them": "em",
    "do not": "dont",
}
_DROPPED: Final = frozenset(
    {
        "the",
        "a",
        "an",
        "to",
        "up",
        "of",
        "your",
        "my",
        "is",
        "it",
        "and",
        "me",
        "on",
        "in",
        "that",
        "at",
        "for",
        "you",
    }
)


def misheard(sentence: list[Said], random: Random) -> list[Said]:
    """Return the sentence as it may arrive; words of the plan are never lost."""
    strength = random.choice((0.0, 0.0, 0.0, 0.03, 0.06, 0.12))
    if not strength:
        return sentence
    heard: list[Said] = []
    for word in sentence:
        heard += _one(word, strength, random)
    return heard or sentence


def _one(word: Said, strength: float, random: Random) -> list[Said]:
    chance = random.random()
    if chance < strength and word.owner is None and word.text in _DROPPED:
        return []
    if chance < strength and word.text in MISHEARD:
        return [Said(random.choice(MISHEARD[word.text]), word.owner)]
    if chance < 0.35 * strength and len(word.text) > 3:
        return [Said(_mistyped(word.text, random), word.owner)]
    if chance > 1.0 - 0.15 * strength and word.owner is None:
        return [word, word]
    return [word]


def _mistyped(text: str, random: Random) -> str:
    at = random.randrange(1, len(text) - 1)
    match random.randrange(3):
        case 0:
            return text[:at] + text[at + 1 :]
        case 1:
            return text[:at] + text[at + 1] + text[at] + text[at + 2 :]
        case _:
            return text[:at] + text[at] + text[at:]
