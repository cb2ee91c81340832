"""Hold what is known at one step of a plan: where the robot is, what it holds, what is where.

"Red cup" and "cup_1" are one thing, a subject.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

from vla_deploy.plans.knowledge import World, object_or_none, parse_object
from vla_deploy.world import Snapshot, Thing
from vla_deploy.world.thing import Rest

Point = tuple[float, float]
Pose = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldSymbol:
    """Hold one thing in a hand; `hand` is "" where the skill chooses it."""

    key: str
    kind: str
    hand: str = ""

    def __str__(self) -> str:
        return f"{self.hand or 'a hand'}: {self.key}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SymbolicState:
    """Hold the symbols.

    `at` is the place or the thing (its key) that the robot stands before, "" elsewhere; `spot` is
    about where that is, and `pose` exactly where, None where nobody knows. `hands` are the hands
    whose holding is known; `found` are the keys of things that the plan has looked for; `rests`
    tells what the plan has put where.
    """

    at: str = ""
    spot: Point | None = None
    pose: Pose | None = None
    hands: tuple[str, ...] = ()
    held: tuple[HeldSymbol, ...] = ()
    found: frozenset[str] = frozenset()
    rests: Mapping[str, Rest] = field(default_factory=dict)

    def holding(self, hand: str = "") -> tuple[HeldSymbol, ...]:
        """Return what that hand may hold; what any hand holds, where none is named."""
        return tuple(one for one in self.held if not hand or one.hand in ("", hand))

    def free_hands(self) -> int:
        """Return how many of the known hands hold nothing."""
        return len(self.hands) - len(self.held)

    def holds(self, key: str) -> bool:
        """Return whether a hand holds that thing."""
        return any(one.key == key for one in self.held)

    def taking(self, held: HeldSymbol) -> "SymbolicState":
        """Return the state with one thing more in the hands."""
        rests = {key: rest for key, rest in self.rests.items() if key != held.key}
        return replace(self, held=(*self.held, held), rests=rests)

    def without(self, given: Iterable[HeldSymbol]) -> "SymbolicState":
        """Return the state with some things no longer in the hands."""
        gone = tuple(given)
        return replace(self, held=tuple(one for one in self.held if one not in gone))


def state_of(world: World, scene: Snapshot | None, here: Pose | None) -> SymbolicState:
    """Return what is known before a plan begins."""
    robot = scene.robot if scene is not None else None
    if here is None and robot is not None:
        here = (robot.x_m, robot.y_m, robot.yaw_rad)
    return SymbolicState(
        spot=here[:2] if here is not None else None,
        pose=here,
        hands=tuple(world.holding),
        held=tuple(_held(world, scene)),
    )


def _held(world: World, scene: Snapshot | None) -> Iterable[HeldSymbol]:
    """Yield what the hands hold: by the scene, which knows the thing, or by its kind."""
    seen = {one.held_by: one for one in scene.things if one.held_by} if scene is not None else {}
    for hand, thing in seen.items():
        yield HeldSymbol(key=thing.thing_id, kind=thing.kind, hand=hand)
    for hand, kind in world.holding.items():
        if kind and hand not in seen:
            yield HeldSymbol(key=kind, kind=kind, hand=hand)


# How heavy a thing of a kind may be for its outer size, full where it can be filled. A bowl is
# mostly air, keys are.
DENSITY_KG_M3: Final[Mapping[str, float]] = MappingProxyType(
    {
        "cup": 800.0, "ball": 1000.0, "book": 700.0, "bottle": 750.0, "phone": 2500.0,
        "keys": 2500.0, "bowl": 400.0, "can": 800.0, "remote": 1000.0,
    }
)  # fmt: skip
OTHER_DENSITY_KG_M3: Final = 700.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """Hold what a parameter names; `key` is the id of the thing where exactly one fits."""

    key: str
    kind: str
    words: str
    thing: Thing | None = None
    others: int = 0

    @property
    def mass_kg(self) -> float | None:
        """Return the most that it may weigh by its size, None where its size is not known."""
        if self.thing is None:
            return None
        length_m, width_m, height_m = self.thing.size_m
        density = DENSITY_KG_M3.get(self.kind, OTHER_DENSITY_KG_M3)
        return density * length_m * width_m * height_m


def subject_or_none(text: object, scene: Snapshot | None) -> Subject | None:
    """Return what a parameter names, None where that is a place, or nothing known."""
    return None if object_or_none(text) is None else subject_of(str(text), scene)


def thing_of(text: object, scene: Snapshot | None) -> Thing | None:
    """Return the one thing in the scene that a parameter names, None where it names none there."""
    subject = subject_or_none(text, scene)
    return None if subject is None else subject.thing


def subject_of(text: str, scene: Snapshot | None) -> Subject:
    """Read a parameter that names a thing.

    Raises:
        UnknownObject: it names none that the robot knows.
    """
    query = parse_object(text)
    found = query.among(scene) if scene is not None else []
    words = str(query)
    if len(found) == 1 or (found and query.order):
        thing = found[0]
        return Subject(key=thing.thing_id, kind=thing.kind, words=words, thing=thing)
    return Subject(key=words, kind=query.kind, words=words, others=len(found))
