"""Give somebody what a hand holds: let go as soon as the arm feels that it is pulled at.

On a robot that drives the hand stays where loaded hands travel, close in front of the chest: held
out further it would hang over furniture that the robot may stand at. An arm on a table holds things
out over it, and goes back. What the arm bears by itself is measured before
anybody is asked to pull; a knock is over before the fingers open.
"""

from collections.abc import Generator, Mapping
from contextlib import suppress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.skills.actions.simple import speak
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, Touched
from vla_deploy.skills.movements.arms import arm_joints, believe_fingers, open_gripper
from vla_deploy.skills.movements.carrying import carry, hold_out, or_carry
from vla_deploy.skills.movements.motion import pause, settle, stay
from vla_deploy.world.vocabulary import ANY_CLASS

PATIENCE_S: Final = 30.0
PULL_RATIO: Final = 0.15
"""Of the contact limits of the arm: about 1.5 N at the thing. From 1.0 on control would stop."""
PULL_EFFORT_RATIO: Final = 0.03
"""Of a joint's stall torque, more than before: 1 N at the thing; at rest it changes by 0.005."""
PULLED_S: Final = 0.1
"""A knock is fading by then; whoever pulls for longer soon passes the limits of contact."""
STILL_PULLED_RATIO: Final = 0.5
"""Of the most that was felt."""
AWAY_S: Final = 2.0
"""So long somebody may have their fingers between those of the hand; then it moves again."""

Efforts = NDArray[np.float64]


def hand_over(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Offer what a hand holds, and open it when somebody takes it; without a pull it stays shut.

    Raises:
        NotPossible: no hand holds anything, or nobody has taken it.
    """
    hand = context.holding_hand(parameters.get("arm"))
    held = context.hands[hand]
    kind = ANY_CLASS if held is None else held.kind
    yield from carry(context)
    context.keep_only(hand)
    if context.robot.parts.base is not None:
        yield from _offer(context, hand, kind)
        return
    yield from hold_out(context, hand)
    yield from or_carry(context, _offer(context, hand, kind), hand)
    yield from carry(context, (hand,))


def _offer(context: SkillContext, hand: str, kind: str) -> Skill:
    yield from settle(context, arm_joints(context, hand))
    alone = _efforts(context, hand)
    here = "Here you are" if kind == ANY_CLASS else f"Here is the {kind}"
    talk = speak(context, {"text": f"{here}. Pull a little, and I let go."})
    yield from _taken(context, hand, kind, alone, talk)
    yield from open_gripper(context, {"arm": hand})
    context.tell(arm=hand, **{"class": kind})
    yield from talk
    yield from pause(context, AWAY_S)


def _taken(context: SkillContext, hand: str, kind: str, alone: Efforts, talk: Skill) -> Skill:
    """Talk, and wait until somebody pulls at what a hand holds, or has it already.

    Who stands there waiting pulls at the first word.

    Raises:
        NotPossible: nobody does.
    """
    end_ns = context.link.working_ns() + round(PATIENCE_S * NS_PER_S)

    def is_over() -> bool:
        next(talk, None)
        return _is_gone(context, hand) or _is_pulled(context, hand, alone)

    while (left_s := (end_ns - context.link.working_ns()) / NS_PER_S) > 0.0:
        with suppress(Touched):
            yield from stay(context, arm_joints(context, hand), left_s, PULL_RATIO, is_over)
        if _is_gone(context, hand) or (yield from _is_pulled_on(context, hand, alone)):
            return
    raise NotPossible(
        f"nobody took the {kind} within {PATIENCE_S:g} s, so I hold it still; "
        "say again that you want it"
    )


def _is_pulled_on(context: SkillContext, hand: str, alone: Efforts) -> Generator[None, None, bool]:
    """Return, after a moment, whether the arm has felt a pull all the while that does not fade."""
    until_ns = context.link.working_ns() + round(PULLED_S * NS_PER_S)
    most = 0.0
    while context.link.working_ns() < until_ns:
        felt = _felt(context, hand, alone)
        if felt <= PULL_EFFORT_RATIO:
            return False
        most = max(most, felt)
        yield
    return _felt(context, hand, alone) > STILL_PULLED_RATIO * most


def _is_pulled(context: SkillContext, hand: str, alone: Efforts) -> bool:
    return _felt(context, hand, alone) > PULL_EFFORT_RATIO


def _felt(context: SkillContext, hand: str, alone: Efforts) -> float:
    """Return the most that a joint bears on top of what it bore alone."""
    return float(np.abs(_efforts(context, hand) - alone).max())


def _is_gone(context: SkillContext, hand: str) -> bool:
    believe_fingers(context)
    return context.hands.get(hand) is None


def _efforts(context: SkillContext, hand: str) -> Efforts:
    """Return what a hand's arm bears, of each joint as a ratio of its stall torque."""
    index = context.robot.joint_index
    return context.link.efforts[[index[name] for name in arm_joints(context, hand)]]
