"""Somebody takes a cup out of the robot's hand: it lets go when it is pulled at, and not before."""

import numpy as np
import pytest

from platforms import load_profile
from sim_twin.harness.lockstep_stack import LockstepStack
from vla_deploy.skills.node import ExecutorNode

pytestmark = pytest.mark.gl

CUP = "red_cup"
STEP_S = 0.02
PULL_N_S, MOST_N = 15.0, 8.0
"""How fast a person takes a light thing, and how hard."""


def _pull(stack: LockstepStack, direction: tuple[float, float, float]) -> bool:
    """Pull at the cup ever harder; return whether the hand has let go of it."""
    engine = stack.lockstep.twin.engine
    body = engine.model.body(CUP).id
    for step in range(100):
        force_n = min(MOST_N, PULL_N_S * STEP_S * step)
        engine.data.xfrc_applied[body, :3] = force_n * np.array(direction)
        stack.lockstep.run_for(STEP_S)
        if CUP not in stack.lockstep.truth()["held"]:
            break
    engine.data.xfrc_applied[body] = 0.0
    return CUP not in stack.lockstep.truth()["held"]


def _knock(stack: LockstepStack) -> None:
    """Push the cup for less than a tenth of a second."""
    engine = stack.lockstep.twin.engine
    body = engine.model.body(CUP).id
    engine.data.xfrc_applied[body, :3] = (0.0, 4.0, 0.0)
    stack.lockstep.run_for(0.06)
    engine.data.xfrc_applied[body] = 0.0
    stack.lockstep.run_for(2.0)


@pytest.mark.slow
@pytest.mark.timeout(240)
def test_a_cup_that_nobody_takes_is_kept(coarse_at_table: LockstepStack) -> None:
    stack = coarse_at_table
    assert stack.say("pick up the red cup")["success"]
    kept = stack.say("hand me the cup")
    assert not kept["success"]
    assert "nobody took the cup" in kept["error"]
    assert CUP in stack.lockstep.truth()["held"]


@pytest.mark.timeout(240)
def test_a_cup_is_kept_over_a_restart_of_the_executor_and_until_somebody_pulls_at_it(
    coarse_at_table: LockstepStack, coarse: str
) -> None:
    stack = coarse_at_table
    assert stack.say("pick up the red cup")["success"]
    stack.lockstep.kill(stack.executor)
    rate_hz = load_profile(coarse).executor_rate_hz
    stack.lockstep.add(ExecutorNode(stack.lockstep.context, stack.robot, rate_hz))
    stack.lockstep.run_for(1.0)
    sample = stack.space.cell_reader("executor_status").latest()
    assert sample is not None
    assert sample.document()["holding"] == {"left": "cup", "right": None}
    assert stack.lockstep.truth()["held"] == [CUP]

    command = stack.give(text="hand it over")
    stack.lockstep.run_for(6.0)
    _knock(stack)
    assert stack.outcome(command) is None
    assert CUP in stack.lockstep.truth()["held"]
    assert _pull(stack, (0.8, -0.6, 0.0))
    assert stack.lockstep.run_until(lambda: stack.outcome(command) is not None, 30.0)
    outcome = stack.outcome(command)
    assert outcome is not None
    assert outcome["success"], outcome["error"]
    assert stack.status()["state"] == "armed"
