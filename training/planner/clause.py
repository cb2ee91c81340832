"""Make one clause of a command from a group of phrases: its words, and the step that it means."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Final, NamedTuple

from training.planner.describing import Word
from training.planner.grammar import Sequence, Slot, expand, parse
from training.planner.referring import SOURCES
from training.planner.slips import SLIPS
from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS

PHRASES: Final = Path(__file__).with_name("phrases")
# What people say of a closed field, and its value; an often-said form stands twice.
CLOSED: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    "how": (
        ("in", "in"), ("in", "in"), ("into", "in"), ("inside", "in"), ("inside of", "in"),
            ("within", "in"),
        ("on", "on"), ("on", "on"), ("onto", "on"), ("on top of", "on"), ("upon", "on"),
            ("on to", "on"),
        ("next to", "next to"), ("beside", "next to"), ("by", "near"), ("near", "near"),
            ("close to", "near"),
        ("under", "under"), ("below", "under"), ("behind", "behind"), ("in front of",
            "in front of"),
        ("left of", "left of"), ("to the left of", "left of"), ("right of", "right of"),
        ("to the right of", "right of"), ("alongside", "next to"), ("underneath", "under"),
        ("to", "to"), ("in to", "in"), ("over on", "on"), ("over to", "to"), ("back in", "in"),
            ("back on", "on"),
    ),
    "arm": (("left", "left"), ("right", "right")),
    "side": (("left", "left"), ("right", "right"), ("left hand side", "left"),
    ("right hand side", "right"),
             ("left", "left"), ("right", "right"), ("counterclockwise", "left"), ("clockwise",
                 "right"),
             ("anticlockwise", "left")),
    "way": (
        ("forward", "forward"), ("forwards", "forward"), ("ahead", "forward"), ("straight ahead",
            "forward"),
        ("straight on", "forward"), ("straight", "forward"), ("to the front", "forward"),
            ("onward", "forward"),
        ("backward", "backward"), ("backwards", "backward"), ("back", "backward"), ("in reverse",
            "backward"),
        ("back up", "backward"), ("to the back", "backward"), ("closer", "forward"), ("away",
            "backward"),
        ("further", "forward"), ("towards me", "forward"), ("rearward", "backward"),
    ),
    "direction": (
        ("left", "left"), ("right", "right"), ("up", "up"), ("down", "down"), ("ahead", "ahead"),
        ("straight ahead", "ahead"), ("forward", "ahead"), ("to the front", "ahead"), ("upwards",
            "up"),
        ("downwards", "down"), ("at the ceiling", "up"), ("at the floor", "down"),
            ("to the ceiling", "up"),
        ("to the ground", "down"), ("higher", "up"), ("lower", "down"), ("leftwards", "left"),
            ("rightwards", "right"),
        ("straight", "ahead"), ("in front of you", "ahead"),
    ),
}  # fmt: skip
# The field of a step that a closed slot fills.
_FIELD_OF: Final[Mapping[str, str]] = {
    "how": "how",
    "arm": "arm",
    "side": "way",
    "way": "way",
    "direction": "way",
}
_PRONOUNS: Final = ("it", "it", "it", "it", "them", "that", "this")


class Said(NamedTuple):
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
class Group:
    """Hold phrases of one meaning; those kept for judging are not trained on."""

    fixed: Mapping[str, str]
    imperative: tuple[Sequence, ...]
    free: tuple[Sequence, ...]


def load_groups(held_out: bool) -> dict[str, list[Group]]:
    """Return the groups of phrases by what they do: those to train on, or those to judge by."""
    prefix = "held_" if held_out else ""
    groups: dict[str, list[Group]] = {}
    for file in sorted(PHRASES.glob("*.toml")):
        for table in tomllib.loads(file.read_text(encoding="utf-8"))["group"]:
            group = Group(
                fixed={"do": table["do"], **table.get("field", {})},
                imperative=tuple(map(parse, table.get(prefix + "imperative", []))),
                free=tuple(map(parse, table.get(prefix + "free", []))),
            )
            if group.imperative or group.free:
                groups.setdefault(table["do"], []).append(group)
    return groups


def make_clause(
    group: Group, random: Random, groups: Mapping[str, list[Group]], after_thing: bool = False
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


def _other_clause(random: Random, groups: Mapping[str, list[Group]]) -> Clause:
    choices = [
        one for do in ("go", "pick", "put", "bring", "find", "move") for one in groups.get(do, [])
    ]
    commanding = [one for one in choices if one.imperative]
    group = random.choice(commanding)
    return make_clause(Group(group.fixed, group.imperative, ()), random, groups)
