"""Give somebody what a hand holds: let go as soon as the arm feels that it is pulled at.

The hand stays where loaded hands travel, close in front of the chest: held out further it would
hang over furniture that the robot may stand at.
"""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.skills.arms import arm_joints, open_gripper
from vla_deploy.skills.carrying import carry
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, Touched
from vla_deploy.skills.motion import pause, stay
from vla_deploy.skills.simple import speak

PATIENCE_S: Final = 30.0
PULL_RATIO: Final = 0.15
"""Of the contact limits of the arm: about 1.5 N at the thing. From 1.0 on control would stop."""
AWAY_S: Final = 1.0
"""So long a hand takes to draw the thing away from between the fingers."""


def hand_over(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Offer what a hand holds, and open it when somebody takes it; without a pull it stays shut.

    Raises:
        NotPossible: no hand holds anything, or nobody has taken it.
    """
    hand = context.holding_hand(parameters.get("arm"))
    held = context.hands[hand]
    kind = "object" if held is None else held.kind
    yield from carry(context)
    yield from speak(context, {"text": f"Here is the {kind}. Pull a little, and I let go."})
    yield from _pulled(context, hand, kind)
    yield from open_gripper(context, {"arm": hand})
    yield from pause(context, AWAY_S)
    yield from carry(context)


def _pulled(context: SkillContext, hand: str, kind: str) -> Skill:
    """Wait until somebody pulls at what a hand holds, or has it already.

    Raises:
        NotPossible: nobody does.
    """
    try:
        yield from stay(
            context,
            arm_joints(context, hand),
            PATIENCE_S,
            PULL_RATIO,
            lambda: context.hands.get(hand) is None,
        )
    except Touched:
        return
    if context.hands.get(hand) is not None:
        raise NotPossible(
            f"nobody took the {kind} within {PATIENCE_S:g} s, so I hold it still; "
            "say again that you want it"
        )
