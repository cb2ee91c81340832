"""Plan one command by rules alone, grounded in what is known."""

from vla_deploy.planning.asking import Request
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.rules.drafting import draft_plan
from vla_deploy.planning.understanding.grounding import ground_plan


def plan_command(text: str, world: World, here: tuple[float, float, float] | None = None) -> Plan:
    """Plan one command; `here` is the robot's x, y, yaw in the map, to which "bring me" returns.

    Raises:
        NotUnderstood: no rule covers a clause.
        NotAble: the robot cannot do such a thing.
        UnknownPlace: a clause names a place that the robot file lacks.
        UnknownObject: a clause names an object the robot cannot recognise.
        Ambiguous: only the speaker can tell what is meant.
    """
    request = Request(command_id="", text=text, world=world, here=here)
    return ground_plan(draft_plan(request), request).plan
