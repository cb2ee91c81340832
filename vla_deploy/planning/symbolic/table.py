"""List, for each skill, what must hold before it and what holds after."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from vla_deploy.planning.symbolic import conditions, effects
from vla_deploy.planning.symbolic.conditions import Condition
from vla_deploy.planning.symbolic.effects import Effect


@dataclass(frozen=True, slots=True, kw_only=True)
class Logic:
    """Hold a skill's preconditions by name, its effect, and the effect in words."""

    needs: Mapping[str, Condition]
    effect: Effect = effects.stays
    leaves: tuple[str, ...] = ()


KNOWN: Final = "object known"
BEFORE: Final = "robot before it"
FREE_HAND: Final = "hand free"
HOLDING: Final = "something held"
WHICH_HAND: Final = "hand named"
GRASPABLE: Final = "graspable"
PAYLOAD: Final = "payload"
TAKES_THINGS: Final = "destination takes things"

LOGIC: Final[Mapping[str, Logic]] = MappingProxyType(
    {
        "navigate_to": Logic(
            needs={
                KNOWN: conditions.is_known,
                "not held": conditions.is_not_held,
                "area allowed": conditions.may_go_there,
                "speed allowed": conditions.is_slow_enough,
            },
            effect=effects.goes,
            leaves=("robot at goal",),
        ),
        "move": Logic(
            needs={
                "area allowed": conditions.way_is_allowed,
                "speed allowed": conditions.is_slow_enough,
            },
            effect=effects.moves,
            leaves=("robot moved",),
        ),
        "turn": Logic(needs={}, effect=effects.turns, leaves=("robot turned",)),
        "look_at": Logic(needs={KNOWN: conditions.is_known}, leaves=("head turned",)),
        "find_object": Logic(needs={}, effect=effects.finds, leaves=("object known",)),
        "pick_up": Logic(
            needs={
                KNOWN: conditions.is_known,
                "not held": conditions.is_not_held,
                FREE_HAND: conditions.has_free_hand,
                BEFORE: conditions.is_before,
                GRASPABLE: conditions.can_be_gripped,
                PAYLOAD: conditions.is_light_enough,
            },
            effect=effects.takes,
            leaves=("object held",),
        ),
        "place": Logic(
            needs={
                HOLDING: conditions.holds_something,
                WHICH_HAND: conditions.knows_which,
                KNOWN: conditions.is_known,
                "not onto itself": conditions.is_not_held,
                TAKES_THINGS: conditions.takes_things,
                BEFORE: conditions.is_before,
            },
            effect=effects.puts,
            leaves=("object at destination", "hand free"),
        ),
        "hand_over": Logic(
            needs={HOLDING: conditions.holds_something, WHICH_HAND: conditions.knows_which},
            effect=effects.lets_go,
            leaves=("hand free",),
        ),
        "open_gripper": Logic(
            needs={"nothing dropped": conditions.opens_empty},
            effect=effects.lets_go,
            leaves=("gripper open",),
        ),
        "close_gripper": Logic(needs={}, leaves=("gripper closed",)),
        "move_arm": Logic(needs={}, leaves=("arm at pose",)),
        "speak": Logic(needs={}, leaves=("text said",)),
        "wait": Logic(needs={}, leaves=("time passed",)),
        "stop": Logic(needs={}, leaves=("robot at rest",)),
    }
)
