"""A small home: a coffee table with cups and a ball on it, a box on the side table."""

from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding import Conversation, ConversationTurn, Mention, MentionRole
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import load_robot
from vla_deploy.world import Snapshot, Thing, Viewpoint
from vla_deploy.world.thing import Rest

SIZES = {
    "cup": (0.066, 0.066, 0.095),
    "ball": (0.05, 0.05, 0.05),
    "book": (0.15, 0.065, 0.04),
    "box": (0.24, 0.24, 0.13),
    "bottle": (0.06, 0.06, 0.18),
}


def make_thing(name: str, colour: str, x_m: float, y_m: float, **changes: Any) -> Thing:
    kind = name.partition("_")[0]
    size_m = changes.pop("size_m", SIZES.get(kind, (0.06, 0.06, 0.06)))
    fields: dict[str, Any] = {
        "thing_id": name,
        "kind": kind,
        "colour": colour,
        "position_m": (x_m, y_m, 0.45 + 0.5 * size_m[2]),
        "size_m": size_m,
        "rests": Rest("on", "coffee_table"),
    }
    return Thing(**(fields | changes))


# Before the coffee table, looking at it: the red cup is on the right.
HERE = (2.15, 2.05, -1.5708)
THINGS = {
    one.thing_id: one
    for one in (
        make_thing("cup_1", "red", 2.0, 1.5),
        make_thing("cup_2", "blue", 2.4, 1.5),
        make_thing("cup_4", "green", 2.2, 1.4),
        make_thing("ball_1", "blue", 2.2, 1.6),
        make_thing("box_1", "orange", 4.2, 0.46, rests=Rest("on", "side_table")),
    )
}


def _seen(name: str) -> Thing:
    thing, _, hand = name.partition(" in ")
    return replace(THINGS[thing], held_by=hand) if hand else THINGS[thing]


class Home:
    """Build requests in a scene of some things, as they are or by names like "cup_1 in left"."""

    def __init__(self) -> None:
        self.world = world_of(load_robot("butler"), {"left": None, "right": None})
        self.things = THINGS

    def ask(self, *things: str | Thing, text: str = "", **changes: Any) -> PlanRequest:
        robot = Viewpoint(x_m=HERE[0], y_m=HERE[1], yaw_rad=HERE[2])
        seen = tuple(_seen(one) if isinstance(one, str) else one for one in things)
        fields: dict[str, Any] = {
            "command_id": "c1",
            "text": text,
            "world": self.world,
            "scene": Snapshot(stamp_ns=1_000_000_000, things=seen, robot=robot),
            "here": HERE,
        }
        return PlanRequest(**(fields | changes))

    def spoke_of(self, *names: str, role: MentionRole = MentionRole.OBJECT) -> Conversation:
        """Return a conversation whose last turn mentioned some things."""
        mentioned = tuple(
            Mention(
                said=str(one),
                means=str(one),
                role=role,
                thing_id=one.thing_id,
                kind=one.kind,
                colour=one.colour,
            )
            for one in (THINGS[name] for name in names)
        )
        return Conversation().after(
            ConversationTurn(said="before", command_id="c0", mentioned=mentioned)
        )


@pytest.fixture(scope="session")
def home() -> Home:
    """Return the home."""
    return Home()
