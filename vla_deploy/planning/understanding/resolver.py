"""Resolve what a command refers to: each thing to its words or its id, with the reason.

A thing that its words single out goes by its words: they still find it when the scene changes. It
goes by its id where only the moment of the command singles it out: a side, an order, a pronoun, an
answer. What nothing singles out is asked back.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.errors import NotAble, UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import words_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.expressions import Expression, Scope, read_expression
from vla_deploy.planning.understanding.fitting import Setting, Use, alike, fitting, suits
from vla_deploy.planning.understanding.questions import did_you_mean, which_hand, which_thing
from vla_deploy.world import Query, Thing, find
from vla_deploy.world.vocabulary import ANY_CLASS, OBJECT_CLASSES

TOGETHER_M: Final = 1.2
"""As far as things on one table are from one another."""
_ONE_THING: Final = frozenset({"thing", "one", "object", "item"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Referent:
    """Hold what was meant: `name` goes into the plan, an id or words; `thing` is None if unseen.

    `look_at` is the furniture, if any, on which an unseen thing was said to be, `hand` the hand, if
    it was said to be what that holds.
    """

    name: str
    kind: str
    colour: str = ""
    thing: Thing | None = None
    look_at: str = ""
    hand: str = ""

    @property
    def words(self) -> str:
        """Return the words for it, also where it goes by its id."""
        return self.name if self.thing is None else str(self.thing)


class Resolver:
    """Resolve the expressions of one command, one after another.

    `reasons` says of each what it was taken for, and why.
    """

    def __init__(self, request: Request) -> None:
        self.setting = Setting(request)
        self.reasons: list[str] = []
        self._choices = request.conversation.choices

    def things(self, text: str, use: Use) -> tuple[Referent, ...]:
        """Return what an expression means: one thing, or all of "both cups".

        Raises:
            UnknownObject: it says nothing that the robot knows.
            NotAble: things are known, but none that it can mean.
            Ambiguous: only the speaker can tell which one is meant.
        """
        read = read_expression(text, self.setting.furniture)
        answer = self._choices.get(read.said, read.said)
        if answer != read.said:
            self.note(read.said, answer, "you said so")
            read = replace(read_expression(answer, self.setting.furniture), scope=Scope.ONE)
        if read.doubts:
            raise did_you_mean(read.doubts[0], read.said)
        if read.pronoun:
            return self._pointed_back(read, use)
        return self._choose(read, fitting(read, use, self.setting), use)

    def thing(self, text: str, use: Use) -> Referent:
        """Return the one thing that an expression means.

        Raises:
            UnknownObject: it says nothing that the robot knows.
            NotAble: things are known, but none that it can mean.
            Ambiguous: it means several, or only the speaker can tell.
        """
        found = self.things(text, use)
        seen = [one.thing for one in found if one.thing is not None]
        if len(found) > 1 and len(seen) > 1:
            said = read_expression(text, self.setting.furniture).said
            raise which_thing(seen, self.setting.view, said)
        return found[0]

    def note(self, asked: str, chosen: str, why: str) -> None:
        """Log what an expression was taken for."""
        self.reasons.append(f'"{asked}" is {chosen} ({why})')

    # --- what is described ----------------------------------------------------------------------

    def _choose(self, read: Expression, found: list[Thing], use: Use) -> tuple[Referent, ...]:
        among = alike(replace(read, besides=()), use, self.setting) if read.is_relative else found
        if not found:
            return (self._unseen(read, among, use),)
        if read.scope is not Scope.ONE and read.count not in (0, len(found)):
            return self._counted(read, found, use)
        if read.scope is Scope.ALL or (read.scope is Scope.ANY and read.count):
            return tuple(self._seen(read, one, use, "one of all of them") for one in found)
        if len(found) == 1:
            of = f" of {len(among)}" if len(among) > 1 else ""
            return (self._seen(read, found[0], use, f"the only one{of} that fits"),)
        is_any = use is Use.SEE or (use is Use.REACH and _are_together(found))
        if is_any and not _needs_id(read):
            return (self._seen(read, found[0], use, "any of them will do"),)
        chosen, why = self._preferred(read, found, use)
        if chosen is None:
            raise which_thing(found, self.setting.view, read.said)
        return (self._seen(read, chosen, use, why, by_id=True),)

    def _counted(self, read: Expression, found: list[Thing], use: Use) -> tuple[Referent, ...]:
        """Return as many as were asked for where any will do: the nearest ones."""
        held = [one for one in found if one.held_by]
        if use is Use.PUT and len(held) == read.count:
            return tuple(self._seen(read, one, use, "it is in my hand") for one in held)
        if read.scope is Scope.ALL or len(found) < read.count:
            raise _not_as_many(read, found)
        why = "any will do, these are the nearest"
        return tuple(self._seen(read, one, use, why, by_id=True) for one in found[: read.count])

    def _preferred(
        self, read: Expression, found: Sequence[Thing], use: Use
    ) -> tuple[Thing | None, str]:
        """Return which of several is meant, and why; None where only the speaker knows."""
        if read.nth:
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

    def _unseen(self, read: Expression, among: Sequence[Thing], use: Use) -> Referent:
        """Go by words for what is not in the scene; what only points at things needs it there."""
        query = read.query
        is_compared = use is not Use.SEE and bool(read.side or read.extreme)
        if read.is_relative or is_compared:
            raise _not_there(read, among)
        if not query.is_named and not query.colour and query.anchor is None:
            raise UnknownObject(read.said, OBJECT_CLASSES)
        look_at = query.anchor.surface if query.anchor is not None else ""
        words = replace(query, relation="", anchor=None) if look_at else query
        kind = query.thing_id.rpartition("_")[0] or query.kind
        referent = Referent(name=str(words), kind=kind, colour=query.colour, look_at=look_at)
        return self._taken(read, referent, use, referent.name, "not seen yet")

    def _seen(
        self, read: Expression, thing: Thing, use: Use, why: str, by_id: bool = False
    ) -> Referent:
        """Return what is in the scene: by its words where they will find it later, too."""
        held = [one for one in self.setting.scene.things if one.held_by]
        fits_held = use is Use.TAKE and any(map(read.query.fits, held))
        name = thing.thing_id if by_id or _needs_id(read) or fits_held else str(read.query)
        referent = Referent(name=name, kind=thing.kind, colour=thing.colour, thing=thing)
        return self._taken(read, referent, use, f"{thing.thing_id} ({thing})", why)

    # --- what points back -----------------------------------------------------------------------

    def _pointed_back(self, read: Expression, use: Use) -> tuple[Referent, ...]:
        """Return what a pronoun means: what was just said, is held, or was spoken of last.

        Raises:
            UnknownObject: there is nothing that it can mean.
            NotAble: the hand of which it speaks holds nothing.
            Ambiguous: only the speaker can tell what is meant.
        """
        holding = dict(self.setting.holding())
        held = next(iter(holding.values())) if len(holding) == 1 else None
        if read.pronoun == phrases.THEM:
            several = [one for one in self.setting.latest_group() if _can_move(one, use)]
            if use is Use.PUT and len(holding) > 1 and (not several or "both" in read.said):
                return self._in_hand(read, use)
            if several:
                return tuple(self._again(read, one, use, "you spoke of them") for one in several)
        if read.pronoun == phrases.HELD:
            return self._in_hand(read, use)
        just_said = [one for one in self.setting.mentions if one.role is Role.OBJECT]
        if use is Use.PUT and just_said and _can_move(just_said[-1], use):
            return (self._again(read, just_said[-1], use, "you have just said it"),)
        if use is Use.PUT and held is not None:
            return (self._again(read, held, use, "it is in my hand"),)
        for one in self.setting.spoken_of():
            if one.role is not Role.PLACE and self._can_be(one, use):
                return (self._again(read, one, use, "spoken of last"),)
        if held is not None and use is not Use.ONTO:
            return (self._again(read, held, use, "it is in my hand"),)
        if use is Use.PUT and holding:
            raise which_hand(holding, read.said)
        return (self._only_thing(read, use),)

    def _in_hand(self, read: Expression, use: Use) -> tuple[Referent, ...]:
        """Return what the hands hold, or the hand that is named.

        Raises:
            NotAble: nothing; the message says what the other hand holds.
        """
        holding = {hand: one for hand, one in self.setting.holding() if read.hand in ("", hand)}
        if len(holding) > 1 and not _ONE_THING.isdisjoint(words_of(read.said)):
            raise which_hand(holding, read.said)
        if not holding:
            others = [f"the {hand} one holds the {it.said}" for hand, it in self.setting.holding()]
            nothing = f"my {read.hand} hand holds nothing" if read.hand else "I hold nothing"
            raise NotAble("; ".join((nothing, *others)))
        return tuple(
            replace(self._again(read, one, use, f"it is in my {hand} hand"), hand=hand)
            for hand, one in holding.items()
        )

    def _can_be(self, one: Mention, use: Use) -> bool:
        """Tell whether what was mentioned can be meant: nothing is put upon itself."""
        if use is Use.ONTO:
            return one not in self.setting.mentions or one.role is not Role.OBJECT
        return _can_move(one, use)

    def _only_thing(self, read: Expression, use: Use) -> Referent:
        """Take "it" for the only thing that could be meant, or ask."""
        scene, view = self.setting.scene, self.setting.view
        found = [
            one for one in find(Query(), scene, view) if suits(one, use, Query(), self.setting)
        ]
        if len(found) == 1:
            return self._seen(read, found[0], use, "nothing else is in sight")
        if found:
            raise which_thing(found, view, read.said)
        raise UnknownObject(read.said, OBJECT_CLASSES)

    def _again(self, read: Expression, one: Mention, use: Use, why: str) -> Referent:
        """Return what was mentioned before; by its id where it is still in the scene."""
        thing = self.setting.scene.thing(one.thing_id) if one.thing_id else None
        name = thing.thing_id if thing is not None else one.means
        referent = Referent(name=name, kind=one.kind, colour=one.colour, thing=thing)
        return self._taken(read, referent, use, name, why)

    def _taken(
        self, read: Expression, referent: Referent, use: Use, chosen: str, why: str
    ) -> Referent:
        """Log what an expression was taken for, and remember that it was mentioned."""
        self.note(read.said, chosen, why)
        role = Role.DESTINATION if use is Use.ONTO else Role.OBJECT
        thing, kind, colour = referent.thing, referent.kind, referent.colour
        self.setting.mentions.append(
            Mention(said=read.said, means=referent.words, role=role, kind=kind, colour=colour)
            if thing is None
            else Mention.of(thing, read.said, role)
        )
        return referent


def _can_move(one: Mention, use: Use) -> bool:
    return use in (Use.SEE, Use.REACH) or one.kind in GRASPABLE_CLASSES


def _needs_id(read: Expression) -> bool:
    """Tell whether words alone would not find the same thing later, elsewhere."""
    query = read.query
    pointed = read.side or read.extreme or read.is_other or read.support or query.order
    related = query.sizes or query.anchor is not None or read.is_relative
    is_one = read.scope is not Scope.ALL and not read.count
    return bool(pointed or related or not query.is_named or not is_one)


def _are_together(things: Sequence[Thing]) -> bool:
    """Tell whether whoever stands before one of them stands before all."""
    first = things[0].xy_m
    return all(math.dist(first, one.xy_m) <= TOGETHER_M for one in things)


def _not_there(read: Expression, things: Sequence[Thing]) -> NotAble:
    """Return why nothing fits; `things` are those that would, if they were not compared."""
    if not things:
        return NotAble(f'I see no {_noun(read, 0)}, so I cannot tell which is "{read.said}"')
    known = " and ".join(dict.fromkeys(f"the {one}" for one in things))
    return NotAble(f'I see nothing that is "{read.said}", only {known}')


def _not_as_many(read: Expression, things: Sequence[Thing]) -> NotAble:
    """Return why other things are there than were counted."""
    there = f"{len(things)} {_noun(read, len(things))}"
    if len(things) < read.count:
        return NotAble(f"I see only {there}")
    return NotAble(f"I see {there}, and cannot tell which {read.count} you mean")


def _noun(read: Expression, count: int) -> str:
    """Return what the things are called, in the singular for one or none."""
    kind = "thing" if read.query.kind == ANY_CLASS else read.query.kind
    plural = {"box": "boxes", "keys": "keys"}.get(kind, f"{kind}s")
    return " ".join(word for word in (read.query.colour, kind if count < 2 else plural) if word)
