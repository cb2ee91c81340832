from typing import TYPE_CHECKING

from vla_deploy.planning.rules import draft_plan
from vla_deploy.planning.understanding import Conversation, Role, Turn
from vla_deploy.planning.understanding.grounding import ground_plan
from vla_deploy.planning.understanding.mentioned import mentions_of

if TYPE_CHECKING:
    from conftest import Home


def test_a_plan_mentions_what_it_moves_and_where_to(home: "Home") -> None:
    request = home.ask("cup_1", "box_1", text="go to the kitchen and put the red cup in the box")
    plan = ground_plan(draft_plan(request), request).plan
    assert [(one.means, one.thing_id, one.role) for one in mentions_of(plan, request.scene)] == [
        ("kitchen", "", Role.PLACE),
        ("red cup", "cup_1", Role.OBJECT),
        ("orange box", "box_1", Role.DESTINATION),
    ]


def test_the_next_command_goes_on_with_what_the_last_was_about(home: "Home") -> None:
    first = home.ask("cup_1", "cup_2", "box_1", text="pick up the left cup")
    plan = ground_plan(draft_plan(first), first).plan
    turn = Turn(said=first.text, command_id="c1", mentioned=mentions_of(plan, first.scene))
    talk = Conversation().after(turn)
    second = home.ask("cup_1", "cup_2", "box_1", text="look at the other one", conversation=talk)
    steps = ground_plan(draft_plan(second), second).plan.actions
    assert steps[-1].parameters == {"object": "cup_1"}
