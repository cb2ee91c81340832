"""Say what a referring expression can hold: how many things, which kind, by what they are told."""

from dataclasses import dataclass, field
from enum import StrEnum

from vla_deploy.planning.understanding.names import Match
from vla_deploy.planning.understanding.parting import Place
from vla_deploy.world import Query


class Scope(StrEnum):
    """Say how many things an expression means: the one, any one, or all of them."""

    ONE = "one"
    ANY = "any"
    ALL = "all"


@dataclass(frozen=True, slots=True, kw_only=True)
class Expression:
    """Hold what an expression says; `said` is its words, in lower case and without articles.

    `side` is left, right or middle, from the speaker's view where `by_speaker`. `support` names
    the furniture that a generic word such as "table" stands for. `place` is where in a row it is,
    `besides` what it is not, `near` what it is the nearest to, or the farthest from, as `order`
    says, `between` which two things it is. `among` is of how many things it is one. `kinds` are
    those that a word such as "round" fits, the best first. `corrections` are words taken for
    others, `doubts` those that only sound like a known one.
    """

    said: str
    query: Query
    pronoun: str = ""
    scope: Scope = Scope.ONE
    count: int = 0
    hand: str = ""
    side: str = ""
    by_speaker: bool = False
    extreme: str = ""
    is_other: bool = False
    support: frozenset[str] = frozenset()
    place: Place | None = None
    besides: "tuple[Expression, ...]" = ()
    near: "Expression | None" = None
    order: str = ""
    between: "tuple[Expression, ...]" = ()
    among: int = 0
    kinds: tuple[frozenset[str], ...] = ()
    corrections: tuple[Match, ...] = ()
    doubts: tuple[Match, ...] = ()
    words: tuple[str, ...] = field(default=(), repr=False)

    @property
    def is_relative(self) -> bool:
        """Tell whether only the things around tell which one it is: a row, or what it is not."""
        return bool(self.place or self.besides or self.near or self.between or self.kinds)

    @property
    def is_bare(self) -> bool:
        """Tell whether it is only a place in a list: "the second one"."""
        is_counted = self.place is not None and not self.place.side
        compared = self.besides or self.near or self.between
        tells = self.extreme or self.kinds or compared or self.support
        return is_counted and self.query == Query() and not (tells or self.query.is_named)
