"""An analysis of what the robot's own perception tells, of a cup that is really there."""

from pathlib import Path

import pytest

from sim_twin.harness.lockstep_stack import LockstepStack
from vla_deploy.analysis.geometric import GeometricAnalyser
from vla_deploy.cli.observation.analyse import ask
from vla_deploy.cli.session import RobotSession
from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.verdict import Feasible

pytestmark = pytest.mark.gl


@pytest.mark.timeout(120)
def test_what_was_found_can_be_taken_and_what_was_not_is_unknown(
    stack: LockstepStack, tmp_path: Path
) -> None:
    assert stack.say("find the red cup")["success"]
    session = RobotSession(tmp_path / "run0", stack.lockstep.clock)
    measuring = GeometricAnalyser(Abilities.of(stack.robot))
    analysis = measuring.analyse(ask(session, "pick up the red cup"))
    cup = next(one for one in analysis.objects if one.id == "cup_1")
    assert (cup.colour, cup.graspable, cup.accessible) == ("red", True, True)
    assert analysis.task is not None
    assert analysis.task.feasible is Feasible.YES
    unseen = measuring.analyse(ask(session, "pick up the red cup and put it in the box")).task
    assert unseen is not None
    assert unseen.feasible is Feasible.UNKNOWN
    assert unseen.prerequisites == ("find the box: it has not been seen",)
    session.close()
