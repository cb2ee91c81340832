"""Resolve what a command refers to: each thing to its words or its id, with the reason.

A thing that its words single out goes by its words: they still find it when the scene changes. It
goes by its id where only the moment of the command singles it out: a side, an order, a pronoun, an
answer. What nothing singles out is asked back.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.understanding.absence import not_as_many, not_there
from vla_deploy.planning.understanding.conversation import Role
from vla_deploy.planning.understanding.expression import Expression, Scope
from vla_deploy.planning.understanding.expressions import read_expression
from vla_deploy.planning.understanding.fitting import Use, alike, fitting
from vla_deploy.planning.understanding.pronouns import Pronouns
from vla_deploy.planning.understanding.questions import did_you_mean, which_thing
from vla_deploy.planning.understanding.referents import Referent, Referents, needs_id
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world import Thing
from vla_deploy.world.vocabulary import OBJECT_CLASSES

TOGETHER_M: Final = 1.2
"""As far as things on one table are from one another."""


class Resolver:
    """Resolve the expressions of one command, one after another."""

    def __init__(self, request: Request) -> None:
        self.setting = Setting(request)
        self.referents = Referents(self.setting)
        self._pronouns = Pronouns(self.referents)
        self._choices = request.conversation.choices

    def things(self, text: str, use: Use) -> tuple[Referent, ...]:
        """Return what an expression means: one thing, or all of "both cups".

        Raises:
            UnknownObject: it says nothing that the robot knows.
            NotThere: things are known, but none that it can mean.
            Ambiguous: only the speaker can tell which one is meant.
        """
        read = read_expression(text, self.setting.furniture)
        answer = self._choices.get(read.said, read.said)
        if answer != read.said:
            self.referents.note(read.said, Role.OBJECT, answer, "you said so")
            read = replace(read_expression(answer, self.setting.furniture), scope=Scope.ONE)
        if read.doubts:
            raise did_you_mean(read.doubts[0], read.said)
        if read.pronoun:
            return self._pronouns.resolve(read, use)
        if read.place is not None and read.is_bare:
            return (self._pronouns.in_list(read, read.place, use),)
        return self._choose(read, fitting(read, use, self.setting), use)

    def thing(self, text: str, use: Use) -> Referent:
        """Return the one thing that an expression means.

        Raises:
            UnknownObject: it says nothing that the robot knows.
            NotThere: things are known, but none that it can mean.
            Ambiguous: it means several, or only the speaker can tell.
        """
        found = self.things(text, use)
        seen = [one.thing for one in found if one.thing is not None]
        if len(found) > 1 and len(seen) > 1:
            said = read_expression(text, self.setting.furniture).said
            raise which_thing(seen, self.setting.view, said)
        return found[0]

    def _choose(self, read: Expression, found: list[Thing], use: Use) -> tuple[Referent, ...]:
        among = self._among(read, use) if read.is_relative else found
        if not found and read.is_relative:
            raise not_there(read, among)
        if not found:
            return (self._unseen(read, use),)
        if read.scope is not Scope.ONE and read.count not in (0, len(found)):
            return self._counted(read, found, use)
        if read.scope is Scope.ALL or (read.scope is Scope.ANY and read.count):
            return tuple(
                self.referents.seen(read, one, use, "one of all of them", found) for one in found
            )
        if len(found) == 1:
            of = f" of {len(among)}" if len(among) > 1 else ""
            return (self.referents.seen(read, found[0], use, f"the only one{of} that fits", among),)
        is_any = use is Use.SEE or (use is Use.REACH and _are_together(found))
        if is_any and not needs_id(read):
            return (self.referents.seen(read, found[0], use, "any of them will do", found),)
        chosen, why = self._preferred(read, found, use)
        if chosen is None:
            raise which_thing(found, self.setting.view, read.said)
        return (self.referents.seen(read, chosen, use, why, found, by_id=True),)

    def _counted(self, read: Expression, found: list[Thing], use: Use) -> tuple[Referent, ...]:
        """Return as many as were asked for where any will do: the nearest ones."""
        held = [one for one in found if one.held_by]
        if use is Use.PUT and len(held) == read.count:
            return tuple(
                self.referents.seen(read, one, use, "it is in my hand", found) for one in held
            )
        if read.scope is Scope.ALL or len(found) < read.count:
            raise not_as_many(read, found)
        why = "any will do, these are the nearest"
        nearest = found[: read.count]
        return tuple(self.referents.seen(read, one, use, why, found, by_id=True) for one in nearest)

    def _among(self, read: Expression, use: Use) -> list[Thing]:
        """Return what would fit if it were not compared, nor anything left out of it."""
        return alike(replace(read, besides=(), kinds=()), use, self.setting)

    def _preferred(
        self, read: Expression, found: Sequence[Thing], use: Use
    ) -> tuple[Thing | None, str]:
        """Return which of several is meant, and why; None where only the speaker knows."""
        if read.place is not None:
            return None, ""
        if read.scope is Scope.ANY:
            return found[0], "any will do, this is the nearest"
        held = [one for one in found if one.held_by]
        if use is Use.PUT and len(held) == 1:
            return held[0], "it is in my hand"
        for one in self.setting.spoken_of():
            named = [thing for thing in found if one.thing_id and thing.is_called(one.thing_id)]
            if named:
                return named[0], "we spoke of it just now"
        return None, ""

    def _unseen(self, read: Expression, use: Use) -> Referent:
        """Go by words for what is not in the scene; what only points at things needs it there."""
        query = read.query
        if not query.is_named and not query.colour and query.anchor is None:
            raise UnknownObject(read.said, OBJECT_CLASSES)
        look_at = query.anchor.surface if query.anchor is not None else ""
        words = replace(query, relation="", anchor=None) if look_at else query
        kind = query.thing_id.rpartition("_")[0] or query.kind
        referent = Referent(name=str(words), kind=kind, colour=query.colour, look_at=look_at)
        self.referents.decide(read, referent, use, referent.name, "not seen yet")
        return referent


def _are_together(things: Sequence[Thing]) -> bool:
    """Tell whether whoever stands before one of them stands before all."""
    first = things[0].xy_m
    return all(math.dist(first, one.xy_m) <= TOGETHER_M for one in things)
