"""Resolve what points back: "it", "them", "the second one", "what you are holding"."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from vla_deploy.planning.catalogue import GRASPABLE_CLASSES
from vla_deploy.planning.errors import Ambiguous, NotThere, UnknownObject
from vla_deploy.planning.references import words_of
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.expression import Expression
from vla_deploy.planning.understanding.fitting import Use, suits
from vla_deploy.planning.understanding.parting import Place
from vla_deploy.planning.understanding.questions import which_hand, which_thing
from vla_deploy.planning.understanding.referents import Referent, Referents
from vla_deploy.world import Query, find
from vla_deploy.world.vocabulary import OBJECT_CLASSES

_ONE_THING: Final = frozenset({"thing", "one", "object", "item"})


class Pronouns:
    """Resolve them by what was just said, what the hands hold, and what was spoken of last."""

    def __init__(self, referents: Referents) -> None:
        self._referents = referents
        self._setting = referents.setting

    def resolve(self, read: Expression, use: Use) -> tuple[Referent, ...]:
        """Return what a pronoun means.

        Raises:
            UnknownObject: there is nothing that it can mean.
            NotThere: the hand of which it speaks holds nothing.
            Ambiguous: only the speaker can tell what is meant.
        """
        if read.pronoun == phrases.THEM:
            in_hands = [one for _, one in self._setting.holding()]
            if use is Use.PUT and "both" in read.said and len(in_hands) > 1:
                return tuple(
                    self._referents.again(read, one, use, "it is in my hand") for one in in_hands
                )
            several = [one for one in self._setting.latest_group() if _can_move(one, use)]
            if several:
                return tuple(
                    self._referents.again(read, one, use, "you spoke of them") for one in several
                )
            if use is Use.PUT and len(in_hands) > 1:
                return self._in_hand(read, use)
        if read.pronoun == phrases.HELD:
            return self._in_hand(read, use)
        just_said = [one for one in self._setting.mentions if one.role is Role.OBJECT]
        if use is Use.PUT and just_said and self._can_be(just_said[-1], use):
            return (self._referents.again(read, just_said[-1], use, "you have just said it"),)
        held = self._setting.held()
        if use is Use.PUT and held is not None:
            return (self._referents.again(read, held, use, "it is in my hand"),)
        for one in self._setting.spoken_of():
            if one.role is not Role.PLACE and self._can_be(one, use):
                return (self._referents.again(read, one, use, "spoken of last"),)
        if held is not None and use is not Use.ONTO:
            return (self._referents.again(read, held, use, "it is in my hand"),)
        if use is Use.PUT and (full := dict(self._setting.holding())):
            raise _which_hand(full, read)
        return (self._only_thing(read, use),)

    def in_list(self, read: Expression, place: Place, use: Use) -> Referent:
        """Return "the second one" of those that were spoken of last.

        Raises:
            UnknownObject: not as many were.
        """
        spoken = [one for one in self._setting.latest_group() if _can_move(one, use)]
        if len(spoken) < max(place.number, 2):
            raise UnknownObject(read.said, OBJECT_CLASSES)
        chosen = spoken[place.number - 1 if place.number > 0 else place.number]
        return self._referents.again(read, chosen, use, f"of the {len(spoken)} that you spoke of")

    def _in_hand(self, read: Expression, use: Use) -> tuple[Referent, ...]:
        """Return what the hands hold, or the hand that is named.

        Raises:
            NotThere: nothing; the message says what the other hand holds.
        """
        holding = {hand: one for hand, one in self._setting.holding() if read.hand in ("", hand)}
        if len(holding) > 1 and not _ONE_THING.isdisjoint(words_of(read.said)):
            raise _which_hand(holding, read)
        if not holding:
            others = [
                f"the {hand} one holds the {one.said}" for hand, one in self._setting.holding()
            ]
            nothing = f"my {read.hand} hand holds nothing" if read.hand else "I hold nothing"
            raise NotThere("; ".join((nothing, *others)))
        return tuple(
            replace(self._referents.again(read, one, use, f"it is in my {hand} hand"), hand=hand)
            for hand, one in holding.items()
        )

    def _can_be(self, one: Mention, use: Use) -> bool:
        """Tell whether what was mentioned can be meant: nothing is put upon itself."""
        if use is Use.ONTO:
            return one not in self._setting.mentions or one.role is not Role.OBJECT
        return _can_move(one, use)

    def _only_thing(self, read: Expression, use: Use) -> Referent:
        """Take "it" for the only thing that could be meant, or ask."""
        scene, view = self._setting.scene, self._setting.view
        found = [
            one for one in find(Query(), scene, view) if suits(one, use, Query(), self._setting)
        ]
        if len(found) == 1:
            return self._referents.seen(read, found[0], use, "nothing else is in sight", found)
        if found:
            raise which_thing(found, view, read.said)
        raise UnknownObject(read.said, OBJECT_CLASSES)


def _can_move(one: Mention, use: Use) -> bool:
    return use in (Use.SEE, Use.REACH) or one.kind in GRASPABLE_CLASSES


def _which_hand(holding: Mapping[str, Mention], read: Expression) -> Ambiguous:
    return which_hand({hand: one.said for hand, one in holding.items()}, read.said)
