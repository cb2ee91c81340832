"""Make up what people call things, places, amounts and sayings.

Each word says whether it belongs to what is meant: "(the) red cup (that is) on (the) table".
"""

from collections.abc import Callable, Mapping
from random import Random
from typing import Final

from training.planner import pointing, words
from training.planner.amounts import angle, duration, length, spelt
from vla_deploy.world.vocabulary import OBJECT_CLASSES

Word = tuple[str, bool]
Source = Callable[[Random], list[Word]]


def said(text: str) -> list[Word]:
    """Return words that all belong to what is meant."""
    return [(word, True) for word in text.split()]


def unmeant(text: str) -> list[Word]:
    """Return words that add nothing to what is meant."""
    return [(word, False) for word in text.split()]


def thing(random: Random) -> list[Word]:
    """Return a thing: "the big red cup on the table", "my keys", "a wug"."""
    return [*unmeant(random.choice(pointing.ARTICLES)), *_description(random, depth=0)]


def what(random: Random) -> list[Word]:
    """Return a thing, or a word that stands for one."""
    chance = random.random()
    if chance < 0.10:
        said_of_it = random.choice(pointing.PRONOUNS).split()
        return [(word, word not in ("the", "of", "your")) for word in said_of_it]
    if chance < 0.18:
        return _one(random)
    if chance < 0.23:
        return _counted(random)
    if chance < 0.29:
        return random.choice(_SINGLED_OUT)(random)
    if chance < 0.32:
        return [*unmeant(random.choice(pointing.ARTICLES)), *_description(random, depth=1),
                *said("and"), *unmeant(random.choice(pointing.ARTICLES)),
                *_description(random, depth=1)]  # fmt: skip
    if chance < 0.33:
        return said(f"{random.choice(OBJECT_CLASSES)}_{random.randint(1, 12)}")
    return thing(random)


def moved(random: Random) -> list[Word]:
    """Return a thing with the place that it is to be taken from, all of which counts."""
    if random.random() < 0.25:
        return [*thing(random), *said(random.choice(("off", "out of", "off of"))), *target(random)]
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
        number = random.randint(1, 40)
        return said(f"{numbered} {spelt(number) if random.random() < 0.5 else number}")
    if chance < 0.96:
        which = random.choice(("other", "second", "next", "small", "big", "front", "back", "far"))
        room = random.choice(("room", "bedroom", "bathroom", "table", "office", "door", "window"))
        return [*unmeant("the"), *said(f"{which} {room}")]
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
            (
                "box",
                "bowl",
                "basket",
                "crate",
                "bin",
                "container",
                "drawer",
                "bag",
                "cup",
                "box",
                "bowl",
                "tray",
                "carton",
                "bucket",
                "jar",
                "hamper",
                "mug",
                "tin",
            )
        )
        return [
            *unmeant(random.choice(pointing.ARTICLES)),
            *_maybe_size(random),
            *_maybe_colour(random),
            *said(container),
            *_maybe_place(random, 0.06),
        ]
    return _one(random) if chance < 0.80 else thing(random)


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


def _dropping(text: str) -> list[Word]:
    """Return words that are meant but for those that code puts back or that say nothing."""
    return [(word, word not in pointing.DROPPED) for word in text.split()]


def _one(random: Random) -> list[Word]:
    """Return "the red one", "the one next to the book", "that one on the left"."""
    article = unmeant(random.choice(("the", "the", "the", "that", "this")))
    if random.random() < 0.3:
        return [*article, *said("one"), *_maybe_place(random, 1.0)]
    picks = (*words.COLOUR_WORDS, *words.SIZE_WORDS, *words.ORDER_WORDS, *pointing.COMPARED)
    return [*article, *said(random.choice(picks)), *said("one"), *_maybe_place(random, 0.2)]


def _counted(random: Random) -> list[Word]:
    """Return "both red cups", "each book on the shelf", "a couple of bottles"."""
    if random.random() < 0.25:
        quantity, noun = random.choice(pointing.SINGLES), _noun(random)
    else:
        quantity, noun = random.choice(pointing.QUANTITIES), _plural(_noun(random))
    counted = said(quantity) if quantity in _THESE_MANY else _dropping(quantity)
    return [*counted, *_maybe_colour(random), *said(noun), *_maybe_place(random, 0.2)]


def _compared(random: Random) -> list[Word]:
    """Return "the smaller of the two balls", "the taller cup of the two"."""
    compared, several = random.choice(pointing.COMPARED), random.choice(pointing.OF_SEVERAL)
    noun = _noun(random)
    if random.random() < 0.3:
        return [*unmeant("the"), *said(f"{compared} {noun}"), *_dropping("of the two")]
    one = said("one") if random.random() < 0.25 else []
    return [*unmeant("the"), *said(compared), *one, *_dropping(several), *said(_plural(noun))]


def _in_row(random: Random) -> list[Word]:
    """Return "the second cup from the left", "the third one on the right", "bottle number two"."""
    noun = "one" if random.random() < 0.25 else _noun(random)
    if random.random() < 0.15:
        return [*unmeant(random.choice(("", "the"))), *_maybe_colour(random),
                *said(f"{_noun(random)} {random.choice(pointing.NUMBERED)}")]  # fmt: skip
    colour = _maybe_colour(random) if noun != "one" and random.random() < 0.5 else []
    return [*unmeant("the"), *said(random.choice(pointing.ORDINALS)), *colour, *said(noun),
            *_dropping(random.choice(pointing.ROWS))]  # fmt: skip


def _nearest(random: Random) -> list[Word]:
    """Return "the cup closest to the box", "the bottle furthest from you"."""
    own = "one" if random.random() < 0.25 else _noun(random)
    relative = unmeant(random.choice(("", "", "that is", "that's", "which is", "that stands")))
    if random.random() < 0.5:
        return [*unmeant("the"), *said(own), *relative, *said(random.choice(pointing.DISTANCES))]
    anchor = random.choice((*words.KNOWN_THINGS, *words.SURFACES, "door", "window", "wall"))
    return [*unmeant("the"), *said(own), *relative, *said(random.choice(pointing.CLOSEST)),
            *unmeant(random.choice(("the", "the", "my", "that"))), *said(anchor)]  # fmt: skip


def _all_but(random: Random) -> list[Word]:
    """Return "any cup but the blue one", "the cup that isn't red"."""
    colour = random.choice(words.COLOUR_WORDS)
    if random.random() < 0.5:
        noun = "one" if random.random() < 0.25 else _noun(random)
        return [*unmeant("the"), *said(noun), *_dropping_is(random.choice(pointing.BUT_COLOUR)),
                *said(colour)]  # fmt: skip
    several = random.random() < 0.5
    noun = _plural(_noun(random)) if several else _noun(random)
    head = "all the" if several else random.choice(("any", "a", "any other"))
    out = random.choice((colour, colour, random.choice(pointing.COMPARED)))
    return [*_dropping(head), *said(noun), *said(random.choice(pointing.BUT)), *unmeant("the"),
            *said(f"{out} one")]  # fmt: skip


def _dropping_is(text: str) -> list[Word]:
    """Keep what denies: "(that is) not", "(that) isn't", "that's not"."""
    return [(word, word in ("not", "isn't")) for word in text.split()]


def _whatever(random: Random) -> list[Word]:
    """Return "whatever is on the shelf", "everything in the box", "the thing on the table"."""
    head = random.choice((*map(said, ("whatever is", "whatever's", "everything", "anything")),
                          _dropping("everything that is"), _dropping("everything that's"),
                          _dropping("the things"), _dropping("the thing that's"),
                          _dropping("the stuff"), said("something")))  # fmt: skip
    anchor = random.choice((*words.SURFACES, "box", "bowl", "basket", "drawer", "crate"))
    relation = random.choice(("on", "in", "inside", "under", "next to", "behind", "on top of"))
    return [*head, *said(relation), *unmeant(random.choice(("the", "the", "my"))), *said(anchor)]


def _looking(random: Random) -> list[Word]:
    """Return "the cup that is red", "the book with the blue cover", "the red coloured bowl"."""
    noun = "one" if random.random() < 0.3 else _noun(random)
    colour = random.choice(words.COLOUR_WORDS)
    chance = random.random()
    if chance < 0.4:
        relative = random.choice(("that is", "that's", "which is"))
        return [*unmeant("the"), *said(noun), *unmeant(relative), *said(colour)]
    if chance < 0.8:
        part = random.choice(pointing.PARTS)
        return [*unmeant("the"), *said(f"{noun} with"), *unmeant(random.choice(("the", "a"))),
                *said(f"{colour} {part}")]  # fmt: skip
    coloured = random.choice(("coloured", "colored"))
    return [*unmeant("the"), *said(f"{colour} {coloured} {noun}")]


def _plural(noun: str) -> str:
    if noun.endswith("s"):
        return noun
    if noun.endswith(("x", "sh", "ch")):
        return f"{noun}es"
    is_ies = noun.endswith("y") and noun[-2:-1] not in "aeiou"
    return f"{noun[:-1]}ies" if is_ies else f"{noun}s"


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
        return unmeant(random.choice(pointing.TAILS)) if chance > 0.965 else []
    if chance < 0.25 * share:
        return _dropping(random.choice(pointing.SIDES))
    relative = unmeant(random.choice(pointing.CLAUSES)) if random.random() < 0.35 else []
    near = random.choice(pointing.NEAR).split()
    leads = len(near) > 1 and near[0] in pointing.LEADING and near[1] != "of"
    relation = [(word, word != "the" and not (leads and at == 0)) for at, word in enumerate(near)]
    if random.random() < 0.5:
        anchor = said(random.choice((*words.SURFACES, *words.PLACES)))
    else:
        anchor = _description(random, depth=1)
    return [*relative, *relation, *unmeant(random.choice(pointing.ARTICLES)), *anchor]


def _noun(random: Random) -> str:
    chance = random.random()
    if chance < 0.62:
        return random.choice(words.KNOWN_THINGS)
    return random.choice(words.OTHER_THINGS) if chance < 0.90 else words.invented(random)


_THESE_MANY: Final = frozenset({"these two", "those two", "these three", "those three"})
_SINGLED_OUT: Final = (
    _compared, _in_row, _in_row, _nearest, _all_but, _whatever, _looking,
)  # fmt: skip


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
