"""Make up what singles a thing out of several: "the second from the left", "any but the red"."""

from random import Random
from typing import Final

from training.planner.sentences import pointing, words
from training.planner.sentences.describing import (
    Word,
    a_noun,
    dropping,
    maybe_colour,
    maybe_place,
    plural,
    said,
    unmeant,
)

_THESE_MANY: Final = frozenset({"these two", "those two", "these three", "those three"})


def one_like(random: Random) -> list[Word]:
    """Return "the red one", "the one next to the book", "that one on the left"."""
    article = unmeant(random.choice(("the", "the", "the", "that", "this")))
    if random.random() < 0.3:
        return [*article, *said("one"), *maybe_place(random, 1.0)]
    picks = (*words.COLOUR_WORDS, *words.SIZE_WORDS, *words.ORDER_WORDS, *pointing.COMPARED)
    return [*article, *said(random.choice(picks)), *said("one"), *maybe_place(random, 0.2)]


def several(random: Random) -> list[Word]:
    """Return "the two bottles", "those cups on the shelf": what one is then singled out from."""
    quantity = random.choice(pointing.OF_WHICH)
    return [*unmeant(quantity), *said(plural(a_noun(random))), *maybe_place(random, 0.25)]


def which(random: Random) -> list[Word]:
    """Return "the smaller one", "the one on the left": one of several that were named before."""
    if random.random() < 0.35:
        return [*unmeant("the"), *said("one"), *maybe_place(random, 1.0)]
    picks = (*words.COLOUR_WORDS, *words.SIZE_WORDS, *words.ORDER_WORDS, *pointing.COMPARED)
    return [*unmeant("the"), *said(random.choice(picks)), *said("one")]


def counted(random: Random) -> list[Word]:
    """Return "both red cups", "each book on the shelf", "a couple of bottles"."""
    if random.random() < 0.25:
        quantity, noun = random.choice(pointing.SINGLES), a_noun(random)
    else:
        quantity, noun = random.choice(pointing.QUANTITIES), plural(a_noun(random))
    how_many = said(quantity) if quantity in _THESE_MANY else dropping(quantity)
    return [*how_many, *maybe_colour(random), *said(noun), *maybe_place(random, 0.2)]


def _compared(random: Random) -> list[Word]:
    """Return "the smaller of the two balls", "the taller cup of the two"."""
    compared, several = random.choice(pointing.COMPARED), random.choice(pointing.OF_SEVERAL)
    noun = a_noun(random)
    if random.random() < 0.3:
        return [*unmeant("the"), *said(f"{compared} {noun}"), *dropping("of the two")]
    one = said("one") if random.random() < 0.25 else []
    return [*unmeant("the"), *said(compared), *one, *dropping(several), *said(plural(noun))]


def _in_row(random: Random) -> list[Word]:
    """Return "the second cup from the left", "the third one on the right", "bottle number two"."""
    noun = "one" if random.random() < 0.25 else a_noun(random)
    if random.random() < 0.15:
        return [*unmeant(random.choice(("", "the"))), *maybe_colour(random),
                *said(f"{a_noun(random)} {random.choice(pointing.NUMBERED)}")]  # fmt: skip
    colour = maybe_colour(random) if noun != "one" and random.random() < 0.5 else []
    return [*unmeant("the"), *said(random.choice(pointing.ORDINALS)), *colour, *said(noun),
            *dropping(random.choice(pointing.ROWS))]  # fmt: skip


def _nearest(random: Random) -> list[Word]:
    """Return "the cup closest to the box", "the bottle furthest from you"."""
    own = "one" if random.random() < 0.25 else a_noun(random)
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
        noun = "one" if random.random() < 0.25 else a_noun(random)
        return [*unmeant("the"), *said(noun), *_dropping_is(random.choice(pointing.BUT_COLOUR)),
                *said(colour)]  # fmt: skip
    noun = a_noun(random)
    head = random.choice(("any", "a", "any other"))
    out = random.choice((colour, colour, random.choice(pointing.COMPARED)))
    return [*dropping(head), *said(noun), *said(random.choice(pointing.BUT)), *unmeant("the"),
            *said(f"{out} one")]  # fmt: skip


def _dropping_is(text: str) -> list[Word]:
    """Keep what denies: "(that is) not", "(that) isn't", "that's not"."""
    return [(word, word in ("not", "isn't")) for word in text.split()]


def _whatever(random: Random) -> list[Word]:
    """Return "whatever is on the shelf", "everything in the box", "the thing on the table"."""
    head = random.choice((*map(said, ("whatever is", "whatever's", "everything", "anything")),
                          dropping("everything that is"), dropping("everything that's"),
                          dropping("the things"), dropping("the thing that's"),
                          dropping("the stuff"), said("something")))  # fmt: skip
    anchor = random.choice((*words.SURFACES, "box", "bowl", "basket", "drawer", "crate"))
    relation = random.choice(("on", "in", "inside", "under", "next to", "behind", "on top of"))
    return [*head, *said(relation), *unmeant(random.choice(("the", "the", "my"))), *said(anchor)]


def _looking(random: Random) -> list[Word]:
    """Return "the cup that is red", "the book with the blue cover", "the red coloured bowl"."""
    noun = "one" if random.random() < 0.3 else a_noun(random)
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


def singled_out(random: Random) -> list[Word]:
    """Return a thing that is told from others by how it stands to them."""
    return random.choice(_SINGLED_OUT)(random)


_SINGLED_OUT: Final = (
    _compared, _in_row, _in_row, _nearest, _all_but, _whatever, _looking,
)  # fmt: skip
