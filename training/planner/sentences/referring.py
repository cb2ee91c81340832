"""Make up what people call things, places, amounts and sayings.

Each word says whether it belongs to what is meant: "(the) red cup (that is) on (the) table".
"""

from collections.abc import Callable, Mapping
from random import Random
from typing import Final

from training.planner.sentences import pointing, words
from training.planner.sentences.amounts import angle, duration, length, spelt
from training.planner.sentences.describing import (
    Word,
    a_noun,
    description,
    dropping,
    maybe_colour,
    maybe_place,
    maybe_size,
    plural,
    said,
    unmeant,
)
from training.planner.sentences.singling import counted, one_like, several, singled_out, which
from vla_deploy.world.vocabulary import OBJECT_CLASSES

Source = Callable[[Random], list[Word]]


def thing(random: Random) -> list[Word]:
    """Return a thing: "the big red cup on the table", "my keys", "a wug"."""
    return [*unmeant(random.choice(pointing.ARTICLES)), *description(random, depth=0)]


def bare_thing(random: Random) -> list[Word]:
    """Return a thing without its article, as after "that": "red cup on the table"."""
    return description(random, depth=0)


def what(random: Random) -> list[Word]:
    """Return a thing, or a word that stands for one."""
    chance = random.random()
    if chance < 0.10:
        said_of_it = random.choice(pointing.PRONOUNS).split()
        return [(word, word not in ("the", "of", "your")) for word in said_of_it]
    if chance < 0.18:
        return one_like(random)
    if chance < 0.23:
        return counted(random)
    if chance < 0.29:
        return singled_out(random)
    if chance < 0.32:
        return [*unmeant(random.choice(pointing.ARTICLES)), *description(random, depth=1),
                *said("and"), *unmeant(random.choice(pointing.ARTICLES)),
                *description(random, depth=1)]  # fmt: skip
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
    return [*unmeant(article), *maybe_colour(random), *said(a_noun(random))]


def all_things(random: Random) -> list[Word]:
    """Return all of several things: "everything", "all the cups", "every book on the shelf"."""
    chance = random.random()
    if chance < 0.45:
        return [*dropping(random.choice(_ALL)), *maybe_place(random, 0.25)]
    if chance < 0.55:
        quantity, noun = random.choice(("every", "every", "each", "every single")), a_noun(random)
    else:
        quantity, noun = random.choice(_ALL_THE), plural(a_noun(random))
    return [*dropping(quantity), *maybe_colour(random), *said(noun), *maybe_place(random, 0.2)]


def others(random: Random) -> list[Word]:
    """Return what is left over: "everything else", "the others", "all the other cups"."""
    if random.random() < 0.65:
        return dropping(random.choice(_OTHERS))
    other = random.choice(("all the other", "all my other", "the other", "the rest of the"))
    return [*dropping(other), *said(plural(a_noun(random)))]


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
        container = random.choice(words.CONTAINERS)
        return [
            *unmeant(random.choice(pointing.ARTICLES)),
            *maybe_size(random),
            *maybe_colour(random),
            *said(container),
            *maybe_place(random, 0.06),
        ]
    return one_like(random) if chance < 0.80 else thing(random)


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


_ALL: Final = ("everything",) * 8 + ("all of them", "all of it", "the lot", "all the things",
                                     "all these things", "all the stuff", "all of these",
                                     "all my things", "all of that", "all the toys")  # fmt: skip
_ALL_THE: Final = ("all the",) * 5 + ("all my", "all of the", "all these", "all those", "all our",
                                      "both", "both the", "all three", "the", "my")  # fmt: skip
_OTHERS: Final = ("everything else", "everything else", "the rest", "the rest", "the others",
                  "all the others", "all the rest", "the rest of it", "the rest of them",
                  "all the other things", "the other things", "anything else")  # fmt: skip


def _one_of(choices: tuple[str, ...]) -> Source:
    return lambda random: said(random.choice(choices))


SOURCES: Final[Mapping[str, Source]] = {
    "what": what,
    "thing": thing,
    "moved": moved,
    "bare": bare_thing,
    "several": several,
    "which": which,
    "any": any_thing,
    "all": all_things,
    "others": others,
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
