"""Make up descriptions of things, each word with whether it belongs to what is meant."""

from random import Random

from training.planner.sentences import pointing, words

Word = tuple[str, bool]


def said(text: str) -> list[Word]:
    """Return words that all belong to what is meant."""
    return [(word, True) for word in text.split()]


def unmeant(text: str) -> list[Word]:
    """Return words that add nothing to what is meant."""
    return [(word, False) for word in text.split()]


def dropping(text: str) -> list[Word]:
    """Return words that are meant but for those that code puts back or that say nothing."""
    return [(word, word not in pointing.DROPPED) for word in text.split()]


def plural(noun: str) -> str:
    """Return what several of them are called."""
    if noun.endswith("s"):
        return noun
    if noun.endswith(("x", "sh", "ch")):
        return f"{noun}es"
    is_ies = noun.endswith("y") and noun[-2:-1] not in "aeiou"
    return f"{noun[:-1]}ies" if is_ies else f"{noun}s"


def description(random: Random, depth: int) -> list[Word]:
    """Return a thing without its article: "big red cup (that is) on table"."""
    described: list[Word] = []
    if random.random() < 0.09:
        described += said(random.choice(words.ORDER_WORDS))
    described += maybe_size(random)
    if random.random() < 0.07:
        described += said(random.choice(words.LOOK_WORDS))
    described += [*maybe_colour(random), *said(a_noun(random))]
    if depth == 0:
        described += maybe_place(random, 0.22)
    return described


def maybe_size(random: Random) -> list[Word]:
    """Return a size or nothing."""
    return said(random.choice(words.SIZE_WORDS)) if random.random() < 0.18 else []


def maybe_colour(random: Random) -> list[Word]:
    """Return a colour or nothing."""
    return said(random.choice(words.COLOUR_WORDS)) if random.random() < 0.40 else []


def maybe_place(random: Random, share: float) -> list[Word]:
    """Return where a thing is, or nothing."""
    chance = random.random()
    if chance > share:
        return unmeant(random.choice(pointing.TAILS)) if chance > 0.965 else []
    if chance < 0.25 * share:
        return dropping(random.choice(pointing.SIDES))
    relative = unmeant(random.choice(pointing.CLAUSES)) if random.random() < 0.35 else []
    near = random.choice(pointing.NEAR).split()
    leads = len(near) > 1 and near[0] in pointing.LEADING and near[1] != "of"
    relation = [(word, word != "the" and not (leads and at == 0)) for at, word in enumerate(near)]
    if random.random() < 0.5:
        anchor = said(random.choice((*words.SURFACES, *words.PLACES)))
    else:
        anchor = description(random, depth=1)
    return [*relative, *relation, *unmeant(random.choice(pointing.ARTICLES)), *anchor]


def a_noun(random: Random) -> str:
    """Return what a thing is called."""
    chance = random.random()
    if chance < 0.62:
        return random.choice(words.KNOWN_THINGS)
    return random.choice(words.OTHER_THINGS) if chance < 0.90 else words.invented(random)
