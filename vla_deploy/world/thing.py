"""Hold what the scene tells at one moment as values: things, surfaces, hands, the robot's place."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import Pose2D

Vector = tuple[float, float, float]

FLOOR = "floor"


@dataclass(frozen=True, slots=True)
class Rest:
    """Say what a thing rests in or on: `of` is a thing's id, a surface's name, or the floor."""

    relation: str
    of: str

    @property
    def words(self) -> str:
        """Return it as one says it: "on the coffee table"."""
        name, _, number = self.of.rpartition("_")
        return f"{self.relation} the {(name if number.isdigit() else self.of).replace('_', ' ')}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """Hold one known thing; the place is its centre in the map, the size along its yaw."""

    thing_id: str
    kind: str
    colour: str
    position_m: Vector
    size_m: Vector
    yaw_rad: float = 0.0
    last_seen_ns: int = 0
    confidence: float = 1.0
    sigma_m: Vector = (0.0, 0.0, 0.0)
    rests: Rest | None = None
    held_by: str = ""
    aliases: tuple[str, ...] = ()

    @property
    def bottom_m(self) -> float:
        """Return the height of its underside above the floor."""
        return self.position_m[2] - 0.5 * self.size_m[2]

    @property
    def top_m(self) -> float:
        """Return the height of its upper side above the floor."""
        return self.position_m[2] + 0.5 * self.size_m[2]

    @property
    def xy_m(self) -> tuple[float, float]:
        """Return its place on the floor plan."""
        return self.position_m[:2]

    @property
    def floor_pose(self) -> Pose2D:
        """Return its middle on the floor plan, with the direction of its length."""
        return Pose2D(*self.xy_m, self.yaw_rad)

    def is_called(self, name: str) -> bool:
        """Return whether a name is one of its ids."""
        return name == self.thing_id or name in self.aliases

    def __str__(self) -> str:
        return f"{self.colour} {self.kind}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """Hold a level surface; `polygon_m` is its known part, convex, in the map."""

    name: str
    height_m: float
    polygon_m: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoint(Pose2D):
    """Place someone who looks: the robot, or a named place; `name` is for words only."""

    yaw_rad: float = 0.0
    name: str = "robot"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost:
    """Hold a thing that is no longer where it was; its place is where it was last known."""

    thing: Thing
    cause: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Hold the world as it was known at `stamp_ns`; `robot` is None where its pose is not known."""

    stamp_ns: int
    things: tuple[Thing, ...]
    surfaces: tuple[Surface, ...] = ()
    lost: tuple[Lost, ...] = ()
    robot: Viewpoint | None = None
    hands: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def thing(self, name: str) -> Thing | None:
        """Return the thing that goes by an id, or None."""
        return next((one for one in self.things if one.is_called(name)), None)

    def below(self, name: str) -> tuple[str, ...]:
        """Return what a thing rests in or on, and all below that: a box, the table under it."""
        found: list[str] = []
        thing = self.thing(name)
        while thing is not None and thing.rests is not None and thing.rests.of not in found:
            found.append(thing.rests.of)
            thing = self.thing(thing.rests.of)
        return tuple(found)

    def unseen_s(self, thing: Thing) -> float:
        """Return for how long a thing had not been seen."""
        return max(0.0, (self.stamp_ns - thing.last_seen_ns) / NS_PER_S)
