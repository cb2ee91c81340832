"""Somebody takes a cup out of the robot's hand: it lets go when it is pulled at, and not before."""

from collections.abc import Callable

import pytest

from platforms import load_profile
from sim_twin.campaigns.missions import OFFER
from sim_twin.errors import RefereeRefusal
from sim_twin.harness.lockstep_stack import LockstepStack
from vla_deploy.skills.node import ExecutorNode

pytestmark = pytest.mark.gl

CUP = "red_cup"


def _offers(stack: LockstepStack, command_id: str) -> bool:
    assert stack.outcome(command_id) is None
    return stack.has_said(OFFER)


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
    person = stack.lockstep.twin.person
    person.take(CUP)  # which nobody has offered
    assert stack.lockstep.run_until(lambda: person.pulls_at is None, 6.0)
    assert person.document()["told"] == "the robot did not let go of the red_cup within 5 s"
    assert stack.status()["state"] == "stopped", "so hard a pull is a collision"
    stack.insist("reset")
    stack.insist("arm")
    kept = stack.say("hand me the cup")
    assert not kept["success"]
    assert "nobody took the cup" in kept["error"]
    assert CUP in stack.lockstep.truth()["held"]


@pytest.mark.timeout(240)
def test_a_cup_is_kept_over_a_restart_of_the_executor_and_until_somebody_pulls_at_it(
    make_stack_at_table: Callable[..., LockstepStack], coarse: str
) -> None:
    stack = make_stack_at_table(coarse, speech=True)
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
    assert stack.lockstep.run_until(lambda: _offers(stack, command), 10.0)
    _knock(stack)
    assert stack.outcome(command) is None
    assert CUP in stack.lockstep.truth()["held"]
    person = stack.lockstep.twin.person
    person.take(CUP)  # it still talks
    with pytest.raises(RefereeRefusal, match="pulls at red_cup; wait"):
        person.take("book")
    with pytest.raises(RefereeRefusal, match="touches the red_cup; take it first"):
        person.put(CUP, {"x_m": 2.0, "y_m": 1.6, "z_m": 0.5, "yaw_rad": 0.0})
    assert stack.lockstep.run_until(lambda: stack.outcome(command) is not None, 30.0)
    assert person.taken == (CUP,)
    outcome = stack.outcome(command)
    assert outcome is not None
    assert outcome["success"], outcome["error"]
    assert stack.status()["state"] == "armed"
