"""Make one clause of a command from a group of phrases, and write the steps that clauses mean."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from random import Random
from typing import Final, NamedTuple

from training.planner.sentences.describing import Word
from training.planner.sentences.grammar import Sequence, Slot, expand, parse
from training.planner.sentences.lists import PHRASES, read_file
from training.planner.sentences.manners import SLIPS
from training.planner.sentences.referring import SOURCES
from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS, Step, field_names

# What people say of a closed field, and its value.
CLOSED: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    name: tuple((said, value) for said, value in forms)
    for name, forms in read_file("closed").items()
}
# The field of a step that a closed slot fills.
_FIELD_OF: Final[Mapping[str, str]] = {
    "how": "how",
    "arm": "arm",
    "side": "way",
    "way": "way",
    "direction": "way",
}
_PRONOUNS: Final = ("it", "it", "it", "it", "them", "that", "this")


class SaidWord(NamedTuple):
    """Hold a word, and the step's number and field that it belongs to, or None."""

    text: str
    owner: tuple[int, str] | None


@dataclass(frozen=True, slots=True)
class Clause:
    """Hold words with the field that each fills, and the step without those fields."""

    words: tuple[tuple[str, str | None], ...]
    step: Mapping[str, str]
    is_imperative: bool


@dataclass(frozen=True, slots=True)
class PhraseGroup:
    """Hold phrases of one meaning; those kept for judging are not trained on."""

    fixed: Mapping[str, str]
    imperative: tuple[Sequence, ...]
    free: tuple[Sequence, ...]


@cache
def load_groups(held_out: bool) -> dict[str, list[PhraseGroup]]:
    """Return the groups of phrases by what they do: those to train on, or those to judge by."""
    prefix = "held_" if held_out else ""
    groups: dict[str, list[PhraseGroup]] = {}
    for file in sorted(PHRASES.glob("*.toml")):
        for table in tomllib.loads(file.read_text(encoding="utf-8"))["group"]:
            group = PhraseGroup(
                fixed={"do": table["do"], **table.get("field", {})},
                imperative=tuple(map(parse, table.get(prefix + "imperative", []))),
                free=tuple(map(parse, table.get(prefix + "free", []))),
            )
            if group.imperative or group.free:
                groups.setdefault(table["do"], []).append(group)
    return groups


def make_clause(
    group: PhraseGroup,
    random: Random,
    groups: Mapping[str, list[PhraseGroup]],
    after_thing: bool = False,
) -> Clause:
    """Return one clause of a group; `after_thing` makes "it" likely, as something was named."""
    count = len(group.imperative)
    at = random.randrange(count + len(group.free))
    is_imperative = at < count
    pattern = group.imperative[at] if is_imperative else group.free[at - count]
    words: list[tuple[str, str | None]] = []
    step = dict(group.fixed)
    for part in expand(pattern, random):
        if isinstance(part, str):
            words.append((part, None))
        elif part.source == "clause":
            words += [(word, None) for word, _ in _other_clause(random, groups).words]
        elif part.source in CLOSED:
            spoken, step[_FIELD_OF[part.source]] = random.choice(CLOSED[part.source])
            words += [(word, None) for word in spoken.split()]
        else:
            words += filled(part, random, after_thing)
    return Clause(tuple(words), step, is_imperative)


def filled(slot: Slot, random: Random, after_thing: bool) -> list[tuple[str, str | None]]:
    """Return words for a slot, each with the field that it belongs to, or None."""
    field = slot.field if slot.field in COPIED_FIELDS else None
    source = SOURCES[slot.source]
    if field == "what" and after_thing and random.random() < 0.55:
        return [(random.choice(_PRONOUNS), field)]
    slip: list[tuple[str, str | None]] = []
    if field and random.random() < 0.025:
        slip = [(word, None) for word, _ in source(random)]
        slip += [(str(word), None) for word in expand(SLIPS, random)]
    return [*slip, *_owned(source(random), field)]


def _owned(words: list[Word], field: str | None) -> list[tuple[str, str | None]]:
    return [(word, field if is_meant else None) for word, is_meant in words]


def _other_clause(random: Random, groups: Mapping[str, list[PhraseGroup]]) -> Clause:
    choices = [
        one for do in ("go", "pick", "put", "bring", "find", "move") for one in groups.get(do, [])
    ]
    commanding = [one for one in choices if one.imperative]
    group = random.choice(commanding)
    return make_clause(PhraseGroup(group.fixed, group.imperative, ()), random, groups)


def answer_text(steps: Iterable[Step]) -> str:
    """Return steps as the model writes them: fields in their order, no spaces between.

    Raises:
        KeyError: a step lacks a field that it must have, or is none.
    """
    return '{"steps":[' + ",".join(map(_step_text, steps)) + "]}"


def _step_text(step: Step) -> str:
    fields = [f'"do":"{step["do"]}"']
    for name, is_needed in field_names(step["do"]):
        if is_needed or name in step:
            space = " " if name in COPIED_FIELDS else ""
            fields.append(f'"{name}":"{space}{step[name]}"')
    return "{" + ",".join(fields) + "}"
