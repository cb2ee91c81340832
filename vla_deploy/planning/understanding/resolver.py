"""Resolve what a command refers to: each thing to its words or its id, with the reason.

A thing that its words single out goes by its words: they still find it when the scene changes. It
goes by its id where only the moment of the command singles it out: a side, an order, a pronoun, an
answer. What nothing singles out is asked back.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.errors import NotThere, UnknownObject
from vla_deploy.planning.references import words_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.absence import not_as_many, not_there
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.decisions import Decision
from vla_deploy.planning.understanding.expressions import Expression, Scope, read_expression
from vla_deploy.planning.understanding.fitting import Use, alike, fitting, suits
from vla_deploy.planning.understanding.parting import Place
from vla_deploy.planning.understanding.questions import did_you_mean, which_hand, which_thing
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world import Query, Thing, find
from vla_deploy.world.vocabulary import OBJECT_CLASSES

# How surely words mean what they were taken for.
MISSPELT: Final = 0.85
BY_SPEAKER: Final = 0.6
_ONE_THING: Final = frozenset({"thing", "one", "object", "item"})
TOGETHER_M: Final = 1.2
"""As far as things on one table are from one another."""


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
    """Resolve the expressions of one command, one after another, and log every decision."""

    def __init__(self, request: Request) -> None:
        self.setting = Setting(request)
        self.decisions: list[Decision] = []
        self._choices = request.conversation.choices

    @property
    def certainty(self) -> float:
        """Return how sure the least sure decision is."""
        return min((one.certainty for one in self.decisions), default=1.0)

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
            self.note(read.said, Role.OBJECT, answer, "you said so")
            read = replace(read_expression(answer, self.setting.furniture), scope=Scope.ONE)
        if read.doubts:
            raise did_you_mean(read.doubts[0], read.said)
        if read.pronoun:
            return self._pronoun(read, use)
        if read.place is not None and read.is_bare:
            return (self._in_list(read, read.place, use),)
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

    def note(
        self,
        asked: str,
        role: Role,
        chosen: str,
        why: str,
        candidates: tuple[str, ...] = (),
        certainty: float = 1.0,
    ) -> None:
        """Log one decision."""
        self.decisions.append(
            Decision(
                asked=asked,
                role=role,
                candidates=candidates,
                chosen=chosen,
                why=why,
                certainty=certainty,
            )
        )

    def _choose(self, read: Expression, found: list[Thing], use: Use) -> tuple[Referent, ...]:
        among = self._among(read, use) if read.is_relative else found
        if not found and read.is_relative:
            raise not_there(read, among)
        if not found:
            return (self._unseen(read, use),)
        if read.scope is not Scope.ONE and read.count not in (0, len(found)):
            return self._counted(read, found, use)
        if read.scope is Scope.ALL or (read.scope is Scope.ANY and read.count):
            return tuple(self._seen(read, one, use, "one of all of them", found) for one in found)
        if len(found) == 1:
            of = f" of {len(among)}" if len(among) > 1 else ""
            return (self._seen(read, found[0], use, f"the only one{of} that fits", among),)
        is_any = use is Use.SEE or (use is Use.REACH and _are_together(found))
        if is_any and not _needs_id(read):
            return (self._seen(read, found[0], use, "any of them will do", found),)
        chosen, why = self._preferred(read, found, use)
        if chosen is None:
            raise which_thing(found, self.setting.view, read.said)
        return (self._seen(read, chosen, use, why, found, by_id=True),)

    def _counted(self, read: Expression, found: list[Thing], use: Use) -> tuple[Referent, ...]:
        """Return as many as were asked for where any will do: the nearest ones."""
        held = [one for one in found if one.held_by]
        if use is Use.PUT and len(held) == read.count:
            return tuple(self._seen(read, one, use, "it is in my hand", found) for one in held)
        if read.scope is Scope.ALL or len(found) < read.count:
            raise not_as_many(read, found)
        why = "any will do, these are the nearest"
        nearest = found[: read.count]
        return tuple(self._seen(read, one, use, why, found, by_id=True) for one in nearest)

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

    def _seen(
        self,
        read: Expression,
        thing: Thing,
        use: Use,
        why: str,
        among: Sequence[Thing],
        by_id: bool = False,
    ) -> Referent:
        by_id = by_id or _needs_id(read) or self._is_one_in_hand(read, use)
        name = thing.thing_id if by_id else str(read.query)
        referent = Referent(name=name, kind=thing.kind, colour=thing.colour, thing=thing)
        self._decide(
            read, referent, use, f"{thing.thing_id} ({thing})", why,
            tuple(one.thing_id for one in among),
        )  # fmt: skip
        return referent

    def _is_one_in_hand(self, read: Expression, use: Use) -> bool:
        """Tell whether the words for what shall be taken fit what a hand holds as well."""
        things = self.setting.scene.things
        return use is Use.TAKE and any(one.held_by and read.query.fits(one) for one in things)

    def _unseen(self, read: Expression, use: Use) -> Referent:
        """Go by words for what is not in the scene; what only points at things needs it there."""
        query = read.query
        if not query.is_named and not query.colour and query.anchor is None:
            raise UnknownObject(read.said, OBJECT_CLASSES)
        look_at = query.anchor.surface if query.anchor is not None else ""
        words = replace(query, relation="", anchor=None) if look_at else query
        kind = query.thing_id.rpartition("_")[0] or query.kind
        referent = Referent(name=str(words), kind=kind, colour=query.colour, look_at=look_at)
        self._decide(read, referent, use, referent.name, "not seen yet")
        return referent

    def _pronoun(self, read: Expression, use: Use) -> tuple[Referent, ...]:
        if read.pronoun == phrases.THEM:
            in_hands = [one for _, one in self.setting.holding()]
            if use is Use.PUT and "both" in read.said and len(in_hands) > 1:
                return tuple(self._again(read, one, use, "it is in my hand") for one in in_hands)
            several = [one for one in self.setting.latest_group() if _can_move(one, use)]
            if several:
                return tuple(self._again(read, one, use, "you spoke of them") for one in several)
            if use is Use.PUT and len(in_hands) > 1:
                return self._in_hand(read, use)
        if read.pronoun == phrases.HELD:
            return self._in_hand(read, use)
        just_said = [one for one in self.setting.mentions if one.role is Role.OBJECT]
        if use is Use.PUT and just_said and self._can_be(just_said[-1], use):
            return (self._again(read, just_said[-1], use, "you have just said it"),)
        held = self.setting.held()
        if use is Use.PUT and held is not None:
            return (self._again(read, held, use, "it is in my hand"),)
        for one in self.setting.spoken_of():
            if one.role is not Role.PLACE and self._can_be(one, use):
                return (self._again(read, one, use, "spoken of last"),)
        if held is not None and use is not Use.ONTO:
            return (self._again(read, held, use, "it is in my hand"),)
        if use is Use.PUT and (full := dict(self.setting.holding())):
            raise which_hand({hand: one.said for hand, one in full.items()}, read.said)
        return (self._only_thing(read, use),)

    def _in_list(self, read: Expression, place: Place, use: Use) -> Referent:
        """Return "the second one" of those that were spoken of last."""
        spoken = [one for one in self.setting.latest_group() if _can_move(one, use)]
        if len(spoken) < max(place.number, 2):
            raise UnknownObject(read.said, OBJECT_CLASSES)
        chosen = spoken[place.number - 1 if place.number > 0 else place.number]
        return self._again(read, chosen, use, f"of the {len(spoken)} that you spoke of")

    def _in_hand(self, read: Expression, use: Use) -> tuple[Referent, ...]:
        """Return what the hands hold, or the hand that is named.

        Raises:
            NotThere: nothing; the message says what the other hand holds.
        """
        holding = {hand: one for hand, one in self.setting.holding() if read.hand in ("", hand)}
        if len(holding) > 1 and not _ONE_THING.isdisjoint(words_of(read.said)):
            raise which_hand({hand: one.said for hand, one in holding.items()}, read.said)
        if not holding:
            others = [
                f"the {hand} one holds the {one.said}" for hand, one in self.setting.holding()
            ]
            nothing = f"my {read.hand} hand holds nothing" if read.hand else "I hold nothing"
            raise NotThere("; ".join((nothing, *others)))
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
            return self._seen(read, found[0], use, "nothing else is in sight", found)
        if found:
            raise which_thing(found, view, read.said)
        raise UnknownObject(read.said, OBJECT_CLASSES)

    def _again(self, read: Expression, one: Mention, use: Use, why: str) -> Referent:
        """Return what was mentioned before; by its id where it is still in the scene."""
        thing = self.setting.scene.thing(one.thing_id) if one.thing_id else None
        name = thing.thing_id if thing is not None else one.means
        referent = Referent(name=name, kind=one.kind, colour=one.colour, thing=thing)
        self._decide(read, referent, use, name, why)
        return referent

    def _decide(
        self,
        read: Expression,
        referent: Referent,
        use: Use,
        chosen: str,
        why: str,
        candidates: tuple[str, ...] = (),
    ) -> None:
        """Log what an expression was taken for, and remember that it was mentioned."""
        role = Role.DESTINATION if use is Use.ONTO else Role.OBJECT
        taken = [f'"{one.word}" taken for {one.known[0]}' for one in read.corrections]
        taken += ["taking it that you face me"] if read.by_speaker else []
        certainty = min(
            MISSPELT if read.corrections else 1.0, BY_SPEAKER if read.by_speaker else 1.0
        )
        self.note(read.said, role, chosen, ", ".join([why, *taken]), candidates, certainty)
        self.setting.mentions.append(
            Mention(
                said=read.said,
                means=referent.words,
                role=role,
                thing_id="" if referent.thing is None else referent.thing.thing_id,
                kind=referent.kind,
                colour=referent.colour,
            )
        )


def _are_together(things: Sequence[Thing]) -> bool:
    """Tell whether whoever stands before one of them stands before all."""
    first = things[0].xy_m
    return all(math.dist(first, one.xy_m) <= TOGETHER_M for one in things)


def _needs_id(read: Expression) -> bool:
    """Tell whether words alone would not find the same thing later, elsewhere."""
    query = read.query
    pointed = read.side or read.extreme or read.is_other or read.support or query.order
    related = query.sizes or query.anchor is not None
    return bool(
        pointed
        or related
        or read.is_relative
        or not query.is_named
        or read.scope is Scope.ALL
        or read.count
    )


def _can_move(one: Mention, use: Use) -> bool:
    return use in (Use.SEE, Use.REACH) or one.kind in GRASPABLE_CLASSES
