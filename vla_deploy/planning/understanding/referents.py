"""Keep what each expression of a command was taken for, with the reason, and what was mentioned."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.planning.understanding.decisions import Decision
from vla_deploy.planning.understanding.expression import Expression, Scope
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.setting import Setting
from vla_deploy.world import Thing

# How surely words mean what they were taken for.
MISSPELT: Final = 0.85
BY_SPEAKER: Final = 0.6


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


class Referents:
    """Make the referents of one command, one after another, and log every decision."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.decisions: list[Decision] = []

    @property
    def certainty(self) -> float:
        """Return how sure the least sure decision is."""
        return min((one.certainty for one in self.decisions), default=1.0)

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

    def seen(
        self,
        read: Expression,
        thing: Thing,
        use: Use,
        why: str,
        among: Sequence[Thing],
        by_id: bool = False,
    ) -> Referent:
        """Return what is in the scene: by its words where they will find it later, too."""
        by_id = by_id or needs_id(read) or self._is_one_in_hand(read, use)
        name = thing.thing_id if by_id else str(read.query)
        referent = Referent(name=name, kind=thing.kind, colour=thing.colour, thing=thing)
        self.decide(
            read, referent, use, f"{thing.thing_id} ({thing})", why,
            tuple(one.thing_id for one in among),
        )  # fmt: skip
        return referent

    def _is_one_in_hand(self, read: Expression, use: Use) -> bool:
        """Tell whether the words for what shall be taken fit what a hand holds as well."""
        things = self.setting.scene.things
        return use is Use.TAKE and any(one.held_by and read.query.fits(one) for one in things)

    def again(self, read: Expression, one: Mention, use: Use, why: str) -> Referent:
        """Return what was mentioned before; by its id where it is still in the scene."""
        thing = self.setting.scene.thing(one.thing_id) if one.thing_id else None
        name = thing.thing_id if thing is not None else one.means
        referent = Referent(name=name, kind=one.kind, colour=one.colour, thing=thing)
        self.decide(read, referent, use, name, why)
        return referent

    def decide(
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


def needs_id(read: Expression) -> bool:
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
