"""Draw sentences: commands in many wordings, questions, answers, other talk, strings of words.

A quarter are commands as the command parser learns them: what one understands the other hears.

A quarter of all are words strung together at random, so that the recogniser learns to hear words
and not to guess them from what usually follows. For the same reason some are two sentences in one
breath: what is a whole sentence need not be the end. Some are by speakers who hesitate.
"""

import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from training.speech.clips.pausing import hesitating
from training.speech.clips.planner_commands import draw_planner_command

Random = np.random.Generator

_FOLDER: Final = Path(__file__).parent.parent
_HOLE: Final = re.compile(r"<(\w+)>")
_CHOICE: Final = re.compile(r"\(([^()]*)\)")
_SPLIT: Final = re.compile(r"[^a-z' ]+")
HELD_OUT: Final = _FOLDER / "held_out"


def read_tables(path: Path) -> dict[str, list[str]]:
    """Read a file of sections; an entry is a line, or in words.txt a part between commas."""
    tables: dict[str, list[str]] = {}
    entries: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            entries = tables.setdefault(line.strip("[]"), [])
        elif line and not line.startswith("#"):
            entries += [line] if path.name == "sentences.txt" else line.split(", ")
    return tables


@cache
def tables() -> Mapping[str, list[str]]:
    """Return all words and patterns by kind."""
    names = ("words.txt", "common_words.txt", "sentences.txt")
    return {kind: told for name in names for kind, told in read_tables(_FOLDER / name).items()}


@cache
def held_out() -> frozenset[str]:
    """Return the sentences that are for judging alone."""
    return frozenset(
        normal(line)
        for path in HELD_OUT.glob("*.txt")
        for line in path.read_text(encoding="utf-8").splitlines()
        if line and not line.startswith("#")
    )


def normal(text: str) -> str:
    """Return a text as the recogniser writes it: small letters and apostrophes alone."""
    return " ".join(_SPLIT.sub(" ", text.lower()).split())


def fill(pattern: str, random: Random) -> str:
    """Replace choices and kinds in a pattern until only words are left."""
    while True:
        if found := _CHOICE.search(pattern):
            options = found[1].split("|")
        elif found := _HOLE.search(pattern):
            options = tables()[found[1]]
        else:
            return " ".join(pattern.split())
        chosen = options[int(random.integers(len(options)))]
        pattern = pattern[: found.start()] + chosen + pattern[found.end() :]


def _command(random: Random) -> str:
    clauses = [fill("<clause>", random)]
    while len(clauses) < 3 and random.random() < 0.22:
        joint = fill("(and|and then|then|and|after that|and after that|but first|or|so)", random)
        clauses += [joint, fill("<clause>", random)]
    if random.random() < 0.3:
        clauses.insert(0, fill("<polite>", random))
    if random.random() < 0.12:
        clauses.insert(0, fill("<name>", random))
    if random.random() < 0.12:
        clauses.append(fill("<after>", random))
    return " ".join(clauses)


def _question(random: Random) -> str:
    return fill("<name> <question>" if random.random() < 0.1 else "<question>", random)


def _answer(random: Random) -> str:
    return fill("<answer>", random)


def _talk(random: Random) -> str:
    return fill("<talk>", random)


_COMMAND_KINDS: Final = (
    "thing", "container", "colour", "size", "place", "count", "degrees", "direction", "verb",
    "person", "after", "polite", "fast", "look", "surface", "answer", "pose", "things", "doing",
)  # fmt: skip
_COMMON_KINDS: Final = ("common", "common", "common", "little", "verb", "noun", "thing", "surface")
_TALK_KINDS: Final = ("verb", "noun", "noun", "adjective", "little", "doing", "done", "things")


def _string(kinds: tuple[str, ...]) -> Callable[[Random], str]:
    """Return a drawer of words in no order that makes sense."""

    def draw(random: Random) -> str:
        words: list[str] = []
        count = int(random.integers(1, 8))
        while len(words) < count:
            kind = kinds[int(random.integers(len(kinds)))]
            words += fill(f"<{kind}>", random).split()
        sound_alike = tables()["sound alike"]
        told = [word for word in words if word not in sound_alike]
        return " ".join(told) or _answer(random)

    return draw


MOST_WORDS: Final = 20
"""What is longer than all that was learnt from, the recogniser does not follow to its end."""


def _in_one_breath(random: Random) -> str:
    """Return two short sentences with nothing between them."""
    first, second = (_BREATHS[int(random.integers(len(_BREATHS)))](random) for _ in range(2))
    return f"{first} {second}"


def _hesitation(random: Random) -> str:
    """Return a command, or two short ones, of somebody who looks for words."""
    drawer = (_command, draw_planner_command, _in_one_breath)[int(random.integers(3))]
    return hesitating(drawer(random), random)


def _urgent(random: Random) -> str:
    """Return a few words with a stop among them, or one that sounds like it."""
    return fill("<urgent>", random)


_BREATHS: Final = (_command, draw_planner_command, _answer, _talk, _string(_COMMAND_KINDS))
SHARES: Final[Mapping[Callable[[Random], str], float]] = {
    _command: 0.15,
    draw_planner_command: 0.25,
    _in_one_breath: 0.12,
    _hesitation: 0.09,
    _urgent: 0.05,
    _question: 0.05,
    _answer: 0.04,
    _talk: 0.06,
    _string(_COMMAND_KINDS): 0.08,
    _string(_TALK_KINDS): 0.04,
    _string(_COMMON_KINDS): 0.07,
}


def draw_sentence(random: Random) -> str:
    """Draw one sentence that is not among the held-out ones, and not too long."""
    drawers = list(SHARES)
    while True:
        drawer = drawers[int(random.choice(len(drawers), p=list(SHARES.values())))]
        text = drawer(random)
        if len(text.split()) <= MOST_WORDS and text not in held_out():
            return text
