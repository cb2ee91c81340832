"""Hold what one command is understood in: scene, who looks, furniture, and what was spoken of."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.world import Snapshot, Viewpoint


@dataclass(slots=True)
class Setting:
    """Remember, over one command, what has been mentioned; everything else is the request's."""

    request: Request
    mentions: list[Mention] = field(default_factory=list)
    furniture: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        """Gather what furniture may be called."""
        world = self.request.world
        named = world.furniture or frozenset(world.places.values())
        self.furniture = {name: one for name, one in world.places.items() if one in named}

    @property
    def scene(self) -> Snapshot:
        """Return the scene, an empty one where none is told."""
        return self.request.scene or Snapshot(stamp_ns=0, things=())

    @property
    def view(self) -> Viewpoint | None:
        """Return from where the robot looks, None where its pose is not known."""
        here = self.request.here
        if here is not None:
            return Viewpoint(x_m=here[0], y_m=here[1], yaw_rad=here[2])
        return self.scene.robot

    def spoken_of(self) -> tuple[Mention, ...]:
        """Return what was mentioned, in this command first, the newest first."""
        return (*reversed(self.mentions), *self.request.conversation.mentions())

    def latest_group(self) -> tuple[Mention, ...]:
        """Return the objects of the newest turn that mentioned any."""
        turns = reversed(self.request.conversation.turns)
        for mentioned in (tuple(self.mentions), *(turn.mentioned for turn in turns)):
            objects = tuple(one for one in mentioned if one.role is Role.OBJECT)
            if objects:
                return tuple(dict.fromkeys(objects))
        return ()

    def held(self) -> Mention | None:
        """Return what a hand holds, None where that is nothing or more than one thing."""
        found = list(self.holding())
        return found[0][1] if len(found) == 1 else None

    def holding(self) -> Iterator[tuple[str, Mention]]:
        """Yield each hand that holds something, with what it holds."""
        seen = [one for one in self.scene.things if one.held_by]
        for thing in seen:
            yield thing.held_by, Mention.of(thing)
        for hand, kind in self.request.world.holding.items():
            if kind and not any(one.held_by == hand for one in seen):
                yield hand, Mention(said=kind, means=kind, kind=kind)
