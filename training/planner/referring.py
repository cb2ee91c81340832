"""Make up what people call things, places, amounts and sayings.

Each word says whether it belongs to what is meant: "(the) red cup (that is) on (the) table".
"""

from collections.abc import Callable, Mapping
from random import Random
from typing import Final

from training.planner import words
from training.planner.amounts import angle, duration, length
from vla_deploy.world.vocabulary import OBJECT_CLASSES

Word = tuple[str, bool]
Source = Callable[[Random], list[Word]]

ARTICLES: Final = ("the",) * 9 + (
    "a",
    "my",
    "my",
    "your",
    "that",
    "this",
    "some",
    "our",
    "his",
    "her",
    "",
)
_NEAR: Final = ("on", "on", "on", "in", "in", "next to", "near", "beside", "by", "under", "behind",
                "in front of", "left of", "right of", "on top of", "inside", "close to", "below",
                "to the left of", "to the right of", "from", "at", "underneath",
                "against")  # fmt: skip
_CLAUSES: Final = ("that is", "which is", "that's", "lying", "sitting", "standing", "over there",
                   "that stands", "that lies", "that you see", "located", "placed",
                   "which you see")  # fmt: skip
_SIDES: Final = ("on the left", "on the right", "in the middle", "to the left", "to the right",
                 "on your left", "on your right", "in the back", "in the front",
                 "at the front")  # fmt: skip
_TAILS: Final = ("over there", "there", "here", "in front of you", "that i like", "you see",
    "i mentioned",
                 "from before", "right there", "that fell down", "that i dropped",
                 "we talked about")  # fmt: skip
_PRONOUNS: Final = ("it",) * 8 + ("that", "this", "them", "that one", "this one", "those", "these",
                    "that thing", "the thing", "the object", "everything", "something")  # fmt: skip
_QUANTITIES: Final = ("all the", "every", "both", "all", "each", "all of the", "both of the", "any",
                      "two", "three", "the two", "another", "one of the",
                      "most of the")  # fmt: skip
_DROPPED: Final = frozenset({"the", "a", "an", "my", "your", "our", "his", "her", "some",
    "their", "its",
                             "that", "this", "these", "those", "which", "is", "that's",
                             "of"})  # fmt: skip


def said(text: str) -> list[Word]:
    """Return words that all belong to what is meant."""
    return [(word, True) for word in text.split()]


def unmeant(text: str) -> list[Word]:
    """Return words that add nothing to what is meant."""
    return [(word, False) for word in text.split()]


def thing(random: Random) -> list[Word]:
    """Return a thing: "the big red cup on the table", "my keys", "a wug"."""
    return [*unmeant(random.choice(ARTICLES)), *_description(random, depth=0)]


def what(random: Random) -> list[Word]:
    """Return a thing, or a word that stands for one."""
    chance = random.random()
    if chance < 0.10:
        return _pronoun(random)
    if chance < 0.17:
        adjective = random.choice((*words.COLOUR_WORDS, *words.SIZE_WORDS, *words.ORDER_WORDS))
        return [*unmeant(random.choice(("the", "that"))), *said(adjective), *said("one"),
                *_maybe_place(random, 0.15)]  # fmt: skip
    if chance < 0.21:
        noun = _noun(random)
        plural = noun if noun.endswith("s") else noun + "s"
        return [
            *_quantity(random),
            *_maybe_colour(random),
            *said(plural),
            *_maybe_place(random, 0.2),
        ]
    if chance < 0.25:
        return [*unmeant(random.choice(ARTICLES)), *_description(random, depth=1), *said("and"),
                *unmeant(random.choice(ARTICLES)), *_description(random, depth=1)]  # fmt: skip
    if chance < 0.26:
        return said(f"{random.choice(OBJECT_CLASSES)}_{random.randint(1, 12)}")
    return thing(random)


def moved(random: Random) -> list[Word]:
    """Return a thing with the place that it is to be taken from, all of which counts."""
    source = place(random) if random.random() < 0.5 else target(random)
    return [*thing(random), *said("from"), *source]


def any_thing(random: Random) -> list[Word]:
    """Return a thing of which any will do."""
    article = random.choice(("a", "any", "some", "a", "another"))
    return [*unmeant(article), *_maybe_colour(random), *said(_noun(random))]


def place(random: Random) -> list[Word]:
    """Return a place: "the kitchen", "room 12", "anna's desk"."""
    chance = random.random()
    if chance < 0.80:
        return [
            *unmeant(random.choice(("the",) * 6 + ("", "my", "our"))),
            *said(random.choice(words.PLACES)),
        ]
    if chance < 0.88:
        owner = random.choice(words.NAMES) + "'s"
        return said(f"{owner} {random.choice(('room', 'desk', 'office', 'bed', 'place', 'table'))}")
    if chance < 0.93:
        numbered = random.choice(("room", "station", "dock", "office", "point", "area"))
        return said(f"{numbered} {random.randint(1, 40)}")
    return [*unmeant("the"), *said(words.invented(random))]


def target(random: Random) -> list[Word]:
    """Return where something may be put: furniture, a container, a thing, a place."""
    chance = random.random()
    if chance < 0.35:
        return [
            *unmeant(random.choice(("the", "the", "the", "that", "my", ""))),
            *said(random.choice(words.SURFACES)),
        ]
    if chance < 0.50:
        return place(random)
    if chance < 0.56:
        return said(random.choice(("it", "there", "here", "that", "them")))
    if chance < 0.75:
        container = random.choice(
            ("box", "bowl", "basket", "crate", "bin", "container", "drawer", "bag", "cup")
        )
        return [
            *unmeant(random.choice(ARTICLES)),
            *_maybe_size(random),
            *_maybe_colour(random),
            *said(container),
        ]
    return thing(random)


def person(random: Random) -> list[Word]:
    """Return a person."""
    return said(random.choice(words.PEOPLE))


def saying(random: Random) -> list[Word]:
    """Return something to say; each word of it counts."""
    chance = random.random()
    if chance < 0.5:
        return said(random.choice(words.SAYINGS))
    if chance < 0.7:
        return said(f"{random.choice(words.SAYINGS)} {random.choice(words.NAMES)}")
    subject = " ".join(word for word, _ in thing(random))
    if chance < 0.85:
        state = random.choice(("here", "gone", "ready", "red", "on the table", "lost"))
        return said(f"{subject} is {state}")
    return said(" ".join(words.invented(random) for _ in range(random.randint(1, 5))))


def _pronoun(random: Random) -> list[Word]:
    chosen = random.choice(_PRONOUNS)
    if chosen.startswith("the "):
        return [*unmeant("the"), *said(chosen[4:])]
    return said(chosen)


def _quantity(random: Random) -> list[Word]:
    return [(word, word not in _DROPPED) for word in random.choice(_QUANTITIES).split()]


def _description(random: Random, depth: int) -> list[Word]:
    described: list[Word] = []
    if random.random() < 0.09:
        described += said(random.choice(words.ORDER_WORDS))
    described += _maybe_size(random)
    if random.random() < 0.07:
        described += said(random.choice(words.LOOK_WORDS))
    described += [*_maybe_colour(random), *said(_noun(random))]
    if depth == 0:
        described += _maybe_place(random, 0.22)
    return described


def _maybe_size(random: Random) -> list[Word]:
    return said(random.choice(words.SIZE_WORDS)) if random.random() < 0.18 else []


def _maybe_colour(random: Random) -> list[Word]:
    return said(random.choice(words.COLOUR_WORDS)) if random.random() < 0.40 else []


def _maybe_place(random: Random, share: float) -> list[Word]:
    chance = random.random()
    if chance > share:
        return unmeant(random.choice(_TAILS)) if chance > 0.975 else []
    if chance < 0.25 * share:
        return [(word, word not in _DROPPED) for word in random.choice(_SIDES).split()]
    relative = unmeant(random.choice(_CLAUSES)) if random.random() < 0.3 else []
    relation = [(word, word != "the") for word in random.choice(_NEAR).split()]
    if random.random() < 0.5:
        anchor = said(random.choice((*words.SURFACES, *words.PLACES)))
    else:
        anchor = _description(random, depth=1)
    return [*relative, *relation, *unmeant(random.choice(ARTICLES)), *anchor]


def _noun(random: Random) -> str:
    chance = random.random()
    if chance < 0.62:
        return random.choice(words.KNOWN_THINGS)
    return random.choice(words.OTHER_THINGS) if chance < 0.90 else words.invented(random)


def _one_of(choices: tuple[str, ...]) -> Source:
    return lambda random: said(random.choice(choices))


SOURCES: Final[Mapping[str, Source]] = {
    "what": what,
    "thing": thing,
    "moved": moved,
    "any": any_thing,
    "place": place,
    "where": target,
    "person": person,
    "text": saying,
    "length": length,
    "angle": angle,
    "time": duration,
    "pose": _one_of(words.POSES),
    "tuck": _one_of(("tuck", "fold", "pull", "stow")),
    "rest": _one_of(("rest", "relax", "lower")),
    "someone": _one_of(words.NAMES),
    "country": _one_of(words.COUNTRIES),
    "food": _one_of(words.FOODS),
    "number": lambda random: said(str(random.randint(2, 99))),
}
