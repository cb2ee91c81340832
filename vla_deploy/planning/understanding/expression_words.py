"""Take out of the words of an expression what points, compares and counts; the rest is a query."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.expression import Expression, Scope
from vla_deploy.planning.understanding.known_words import (
    is_kind,
    known_words,
    likely_words,
    relation_words,
    single,
)
from vla_deploy.planning.understanding.names import closest
from vla_deploy.world.vocabulary import ANY_CLASS, ARTICLES

_ID: Final = re.compile(r"[a-z]+_\d+")
# Where one takes a thing from is where it is.
_FROM: Final = ((re.compile(r"\b(?:from|off(?: of)?) (?!me\b)"), "on "),
                (re.compile(r"\bout of "), "in "))  # fmt: skip


def compounds(rest: str) -> str:
    """Return words with those of one meaning as one, and with "from" as where a thing is."""
    for pattern, word in _FROM:
        rest = pattern.sub(word, rest)
    for spoken, word in phrases.COMPOUNDS.items():
        rest = re.sub(rf"\b{spoken}\b", word, rest)
    return rest


def pointing(words: list[str], read: Expression) -> Expression:
    """Take side, extreme, "other", plural and modifiers out of the words."""
    kept: list[str] = []
    changes: dict[str, object] = {}
    for at, word in enumerate(words):
        following = " ".join(words[at + 1 : at + 2])
        if word in phrases.SIDES and following != "of":
            changes["side"] = phrases.SIDES[word]
        elif word in phrases.EXTREMES:
            changes["extreme"] = phrases.EXTREMES[word]
        elif word in ("other", "another", "different"):
            changes["is_other"] = True
            changes |= {"scope": Scope.ANY} if word == "another" else {}
        elif word == "ones":
            changes.setdefault("scope", Scope.ALL if read.scope is Scope.ONE else read.scope)
        elif word in phrases.FITTING_KINDS:
            changes["kinds"] = phrases.FITTING_KINDS[word]
            kept += ["object"] if word in phrases.KIND_NOUNS else []
        elif word in phrases.SILENT or (word in phrases.MODIFIERS and is_kind(following)):
            continue
        else:
            one = single(word)
            if one != word and not _has_relation(kept):
                changes.setdefault("scope", Scope.ALL if read.scope is Scope.ONE else read.scope)
            kept.append(phrases.ORDER_WORDS.get(one, one))
    return replace(read, words=tuple(kept), **changes)  # type: ignore[arg-type]


def of_kinds(read: Expression) -> Expression | None:
    """Let "round" say nothing more of a cup; None where it is nothing that a kind can be."""
    kind = read.query.kind
    if not read.kinds or kind == ANY_CLASS:
        return read
    return replace(read, kinds=()) if any(kind in kinds for kinds in read.kinds) else None


def _has_relation(kept: list[str]) -> bool:
    return any(word in relation_words() for word in kept)


def generic_support(read: Expression, furniture: Mapping[str, str]) -> Expression:
    """Let "on the table" mean any furniture whose name ends in "table"."""
    words = [word for word in read.words if word not in ARTICLES]
    for at in range(len(words) - 1, 0, -1):
        spoken = " ".join(words[at:])
        if words[at - 1] != "on" or spoken in furniture:
            continue
        named = {place for name, place in furniture.items() if name.split()[-1:] == words[at:]}
        if named:
            return replace(read, words=tuple(words[: at - 1]), support=frozenset(named))
    return read


def with_known_words(read: Expression, furniture: Mapping[str, str]) -> Expression:
    """Put known words in the place of misspelt ones; note those that only sound alike."""
    known = known_words() | frozenset(word for name in furniture for word in name.split())
    matches = [
        None if word in known or _ID.fullmatch(word) else closest(word, likely_words())
        for word in read.words
    ]
    return replace(
        read,
        words=tuple(
            match.known[0] if match else word
            for word, match in zip(read.words, matches, strict=True)
        ),
        corrections=tuple(one for one in matches if one and one.is_sure),
        doubts=tuple(one for one in matches if one and not one.is_sure),
    )
