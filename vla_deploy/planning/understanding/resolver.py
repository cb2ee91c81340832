"""Resolve what a command refers to: each thing to its words or its id, with the reason.

A thing that its words single out goes by its words: they still find it when the scene changes. It
goes by its id where only the moment of the command singles it out: a side, an order, a pronoun, an
answer. What nothing singles out is asked back.
"""

from dataclasses import dataclass, replace

from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, MentionRole
from vla_deploy.planning.understanding.expressions import Expression, Scope
from vla_deploy.planning.understanding.fitting import CommandContext, ThingUse, fitting
from vla_deploy.planning.understanding.questions import which_thing
from vla_deploy.plans.catalogue import ARMS, GRASPABLE_CLASSES
from vla_deploy.plans.errors import UnknownObject
from vla_deploy.plans.knowledge import words_of
from vla_deploy.world import Thing
from vla_deploy.world.vocabulary import OBJECT_CLASSES


@dataclass(frozen=True, slots=True, kw_only=True)
class Referent:
    """Hold what was meant: `name` goes into the plan, an id or words; `thing` is None if unseen.

    `look_at` is the furniture, if any, on which an unseen thing was said to be, `hand` the hand, if
    it was said to be what that holds.
    """

    name: str
    kind: str
    thing: Thing | None = None
    look_at: str = ""
    hand: str = ""


class Resolver:
    """Resolve the expressions of one command, one after another.

    `reasons` says of each what it was taken for, and why.
    """

    def __init__(self, request: PlanRequest) -> None:
        self.context = CommandContext(request)
        self.reasons: list[str] = []

    def things(self, text: str, use: ThingUse) -> tuple[Referent, ...]:
        """Return what an expression means: one thing, or all of "both cups".

        Raises:
            UnknownObject: it says nothing that the robot knows.
            NotAble: things are known, but none that it can mean.
            Ambiguous: only the speaker can tell which one is meant.
        """
        read = self.context.read(text)
        return self._pointed_back(read, use) if read.pronoun else self._described(read, use)

    def thing(self, text: str, use: ThingUse) -> Referent:
        """Return the one thing that an expression means.

        Raises:
            UnknownObject: it says nothing that the robot knows.
            NotAble: things are known, but none that it can mean.
            Ambiguous: it means several, or only the speaker can tell.
        """
        found = self.things(text, use)
        seen = [one.thing for one in found if one.thing is not None]
        if len(seen) > 1:
            raise which_thing(seen, self.context.view, self.context.read(text).said)
        return found[0]

    def note(self, asked: str, chosen: str, why: str) -> None:
        """Log what an expression was taken for."""
        self.reasons.append(f'"{asked}" is {chosen} ({why})')

    # --- what is described ----------------------------------------------------------------------

    def _described(self, read: Expression, use: ThingUse) -> tuple[Referent, ...]:
        found = fitting(read, use, self.context)
        held = [one for one in found if one.held_by and use is ThingUse.PUT]
        found = held if len(held) == read.count > 0 else found
        if read.count not in (0, len(found)):
            raise NotAble(f'I see {len(found)} that could be "{read.said}"; say which ones')
        if not found:
            return (self._unseen(read, use),)
        if read.scope is Scope.ALL:
            return tuple(self._seen(read, one, use, "one of all of them") for one in found)
        if len(found) == 1:
            return (self._seen(read, found[0], use, "the only one that fits"),)
        if use is ThingUse.SEE and not _needs_id(read):
            return (self._seen(read, found[0], use, "any of them will do"),)
        if read.scope is Scope.ANY:
            return (
                self._seen(read, found[0], use, "any will do, this is the nearest", by_id=True),
            )
        if len(held) == 1:
            return (self._seen(read, held[0], use, "it is in my hand", by_id=True),)
        for one in self.context.spoken_of():
            for thing in found:
                if one.thing_id and thing.is_called(one.thing_id):
                    why = "we spoke of it just now"
                    return (self._seen(read, thing, use, why, by_id=True),)
        raise which_thing(found, self.context.view, read.said)

    def _unseen(self, read: Expression, use: ThingUse) -> Referent:
        """Go by words for what is not in the scene; what only points at things needs it there."""
        query = read.query
        if read.is_compared:
            alike = replace(read, besides=(), side="", is_other=False, held_by=frozenset())
            known = [f"the {one}" for one in fitting(alike, use, self.context)]
            only = f", only {' and '.join(dict.fromkeys(known))}" if known else ""
            raise NotAble(f'I see nothing that is "{read.said}"{only}')
        if not query.is_named and not query.colour and query.anchor is None:
            raise UnknownObject(read.said, OBJECT_CLASSES)
        look_at = query.anchor.surface if query.anchor is not None else ""
        words = replace(query, relation="", anchor=None) if look_at else query
        kind = query.thing_id.rpartition("_")[0] or query.kind
        mention = Mention(said=read.said, means=str(words), kind=kind, colour=query.colour)
        self._remember(mention, use, str(words), "not seen yet")
        return Referent(name=str(words), kind=kind, look_at=look_at)

    def _seen(
        self, read: Expression, thing: Thing, use: ThingUse, why: str, by_id: bool = False
    ) -> Referent:
        """Return what is in the scene: by its words where they will find it later, too."""
        others = [one for one in self.context.scene.things if one.thing_id != thing.thing_id]
        if use is ThingUse.TAKE:
            others = [one for one in others if one.held_by]
        is_one_of = use in (ThingUse.TAKE, ThingUse.ONTO) and any(map(read.query.fits, others))
        name = thing.thing_id if by_id or _needs_id(read) or is_one_of else str(read.query)
        self._remember(Mention.of(thing, read.said), use, f"{thing.thing_id} ({thing})", why)
        return Referent(name=name, kind=thing.kind, thing=thing)

    # --- what points back -----------------------------------------------------------------------

    def _pointed_back(self, read: Expression, use: ThingUse) -> tuple[Referent, ...]:
        """Return what a pronoun means: what was just said, is held, or was spoken of last.

        Raises:
            UnknownObject: there is nothing that it can mean.
            NotAble: the hand of which it speaks holds nothing.
            Ambiguous: only the speaker can tell what is meant.
        """
        context, holding = self.context, dict(self.context.holding())
        if read.pronoun == phrases.THEM:
            several = [one for one in context.latest_group() if _can_move(one, use)]
            if use is ThingUse.PUT and len(holding) > 1 and (not several or "both" in read.said):
                return self._in_hand(read, use)
            if several:
                return tuple(self._again(read, one, use, "you spoke of them") for one in several)
        if read.pronoun == phrases.HELD:
            return self._in_hand(read, use)
        held = list(holding.values()) if len(holding) == 1 else []
        objects = [one for one in context.mentions if one.role is MentionRole.OBJECT]
        just_said = [one for one in objects[-1:] if _can_move(one, use)]
        spoken = [one for one in context.spoken_of() if self._can_be(one, use)]
        first = [*just_said, *held] if use is ThingUse.PUT else []
        last = [] if use is ThingUse.ONTO else held
        meant = next(iter((*first, *spoken, *last)), None)
        if meant is not None:
            return (self._again(read, meant, use, "the latest that can be meant"),)
        known = fitting(Expression(said=read.said), use, context)
        known = [one for one in known if one.held_by and use is ThingUse.PUT] or known
        if not known:
            raise UnknownObject(read.said, OBJECT_CLASSES)
        if len(known) > 1:
            raise which_thing(known, context.view, read.said)
        return (self._seen(read, known[0], use, "nothing else is in sight"),)

    def _in_hand(self, read: Expression, use: ThingUse) -> tuple[Referent, ...]:
        """Return what the hands hold, or the hand that is named.

        Raises:
            NotAble: they hold nothing.
            Ambiguous: only the speaker can tell which one is meant.
        """
        hands = read.held_by or ARMS
        holding = {hand: one for hand, one in self.context.holding() if hand in hands}
        if len(holding) > 1 and not {"thing", "one"}.isdisjoint(words_of(read.said)):
            return self._described(Expression(said=read.said, held_by=read.held_by), use)
        if not holding:
            hand = "".join(hands) if len(hands) == 1 else ""
            raise NotAble(f"my {hand} hand holds nothing" if hand else "I hold nothing")
        return tuple(
            replace(self._again(read, one, use, f"it is in my {hand} hand"), hand=hand)
            for hand, one in holding.items()
        )

    def _can_be(self, one: Mention, use: ThingUse) -> bool:
        """Return whether what was mentioned can be meant: nothing is put upon itself."""
        if one.role is MentionRole.PLACE:
            return False
        if use is ThingUse.ONTO:
            return one not in self.context.mentions or one.role is not MentionRole.OBJECT
        return _can_move(one, use)

    def _again(self, read: Expression, one: Mention, use: ThingUse, why: str) -> Referent:
        """Return what was mentioned before; by its id where it is still in the scene."""
        thing = self.context.scene.thing(one.thing_id) if one.thing_id else None
        name = thing.thing_id if thing is not None else one.means
        self._remember(replace(one, said=read.said), use, name, why)
        return Referent(name=name, kind=one.kind, thing=thing)

    def _remember(self, mention: Mention, use: ThingUse, chosen: str, why: str) -> None:
        """Log what an expression was taken for, and remember that it was mentioned."""
        self.note(mention.said, chosen, why)
        role = MentionRole.DESTINATION if use is ThingUse.ONTO else MentionRole.OBJECT
        self.context.mentions.append(replace(mention, role=role))


def _can_move(one: Mention, use: ThingUse) -> bool:
    return use in (ThingUse.SEE, ThingUse.REACH) or one.kind in GRASPABLE_CLASSES


def _needs_id(read: Expression) -> bool:
    """Return whether words alone would not find the same thing later, elsewhere."""
    query = read.query
    pointed = read.is_compared or read.support or query.order or not query.is_named
    related = query.sizes or query.anchor is not None
    return bool(pointed or related or read.scope is Scope.ALL)
