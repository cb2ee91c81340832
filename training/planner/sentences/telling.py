"""Make commands of sentences that were written out whole, as people tell things at home.

A line of `phrases/told` is `STEP [; STEP ...] | SENTENCE`: a step is a name and its closed fields,
`put how=in`, and the sentence has slots, `{what}` or `{2.where:place}` for the second step. Remarks
that stand before or after a command, and ask for nothing, are lines of `phrases/remarks`.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Final
from zlib import crc32

from training.planner.sentences.clause import Clause, SaidWord, answer_text, filled
from training.planner.sentences.grammar import PatternInvalid, Slot
from training.planner.sentences.lists import PHRASES
from training.planner.sentences.referring import SOURCES
from vla_deploy.planning.command_parser.grammar import (
    COPIED_FIELDS,
    STEPS,
    field_names,
)
from vla_deploy.planning.command_parser.wording import plain_words

TOLD: Final = PHRASES / "told"
REMARKS: Final = PHRASES / "remarks"
BEFORE, AFTER = "before", "after"
KEPT_BACK_OF: Final = 10
"""One line of so many is kept back, to judge by."""
_SLOT: Final = re.compile(r"\{(?:(\d)\.)?([a-z]+)(?::([a-z]+))?\}")
_STEP: Final = re.compile(r'([a-z]+)((?: [a-z]+=(?:"[a-z ]+"|[a-z]+))*)')
_CLOSED: Final = re.compile(r' ([a-z]+)=(?:"([a-z ]+)"|([a-z]+))')


@dataclass(frozen=True, slots=True)
class Mark:
    """Mark the place in a sentence of what fills a field of a step, counted from 0."""

    step: int
    slot: Slot


@dataclass(frozen=True, slots=True)
class SentenceFrame:
    """Hold a sentence, its words and marks, and its steps without what the marks fill."""

    steps: tuple[Mapping[str, str], ...]
    parts: tuple[str | Mark, ...]

    def drawn(self, random: Random) -> tuple[list[Clause], list[SaidWord]]:
        """Return the steps and the sentence with its marks filled by chance."""
        sentence: list[SaidWord] = []
        things: set[int] = set()
        for part in self.parts:
            if isinstance(part, str):
                sentence.append(SaidWord(part, None))
                continue
            # Of what the first step has named, the next may say "it".
            is_later = part.slot.source == "what" and any(step < part.step for step in things)
            for word, field in filled(part.slot, random, is_later):
                sentence.append(SaidWord(word, (part.step, field) if field else None))
            if part.slot.field == "what":
                things.add(part.step)
        return [Clause((), step, False) for step in self.steps], sentence


@cache
def load_told(held_out: bool) -> tuple[SentenceFrame, ...]:
    """Return the frames to train on, or those to judge by.

    Raises:
        PatternInvalid: a line is none.
    """
    frames = {repr(frame): frame for frame in map(read_frame, _lines(TOLD, "*", held_out))}
    if held_out:
        learnt = set(map(repr, load_told(held_out=False)))
        frames = {name: frame for name, frame in frames.items() if name not in learnt}
    return tuple(frames.values())


@cache
def load_remarks(where: str, held_out: bool) -> tuple[tuple[str, ...], ...]:
    """Return the words of remarks that stand `BEFORE` or `AFTER` a command."""
    return tuple(tuple(plain_words(line)) for line in _lines(REMARKS, where, held_out))


def read_frame(line: str) -> SentenceFrame:
    """Read one line.

    Raises:
        PatternInvalid: a step, a field or a source of words is none, or a needed field is missing.
    """
    head, bar, text = line.partition("|")
    if not bar:
        raise PatternInvalid(f"{line!r}: expected STEPS | SENTENCE")
    steps = tuple(_step(part.strip(), line) for part in head.split(";"))
    frame = SentenceFrame(steps, tuple(_parts(text)))
    filled_in = [dict(step) for step in steps]
    for part in frame.parts:
        if isinstance(part, Mark):
            slot = part.slot
            if part.step >= len(steps) or slot.field not in COPIED_FIELDS:
                raise PatternInvalid(f"{line!r}: no step has {slot.field!r} ({part.step + 1})")
            if slot.source not in SOURCES:
                raise PatternInvalid(f"{line!r}: {slot.source!r} is no source of words")
            filled_in[part.step][slot.field] = "word"
    for step in filled_in:
        strange = step.keys() - {"do", *dict(field_names(step["do"]))}
        if strange:
            raise PatternInvalid(f"{line!r}: {step['do']!r} has no {', '.join(sorted(strange))}")
    try:
        answer_text(filled_in)
    except KeyError as error:
        raise PatternInvalid(f"{line!r}: a step lacks {error}, or is none") from error
    return frame


def _lines(folder: Path, name: str, held_out: bool) -> Iterator[str]:
    for file in sorted(folder.glob(f"{name}.txt")):
        for line in file.read_text(encoding="utf-8").splitlines():
            is_kept_back = crc32(line.encode()) % KEPT_BACK_OF == 0
            if line and not line.startswith("#") and is_kept_back == held_out:
                yield line


def _step(text: str, line: str) -> Mapping[str, str]:
    match = _STEP.fullmatch(text)
    if match is None or match[1] not in STEPS:
        raise PatternInvalid(f"{line!r}: {text!r} is no step; known: {', '.join(STEPS)}")
    fields = _CLOSED.findall(match[2])
    return {"do": match[1], **{name: quoted or plain for name, quoted, plain in fields}}


def _parts(text: str) -> Iterator[str | Mark]:
    """Yield words, plain as commands reach the model, and marks."""
    at = 0
    for match in _SLOT.finditer(text):
        yield from plain_words(text[at : match.start()])
        number, field, source = match.groups()
        yield Mark(int(number or 1) - 1, Slot(field, source or field))
        at = match.end()
    yield from plain_words(text[at:])
