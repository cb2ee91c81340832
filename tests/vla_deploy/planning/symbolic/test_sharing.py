from vla_deploy.planning.plan import Action, Priority
from vla_deploy.planning.symbolic.simulation import in_turn, sharing_faults


def action(name: str, skill: str, *after: str, **changes: object) -> Action:
    return Action(id=name, skill=skill, depends_on=after, **changes)


def test_two_that_need_the_base_must_be_ordered() -> None:
    both = (action("a", "turn"), action("b", "move"))
    assert sharing_faults(both) == [
        'actions "a" and "b" need the base at a time; let "b" depend on "a"'
    ]
    assert sharing_faults((action("a", "turn"), action("b", "move", "a"))) == []


def test_what_shares_nothing_runs_side_by_side() -> None:
    assert sharing_faults((action("a", "navigate_to"), action("b", "speak"))) == []
    left = action("a", "open_gripper", parameters={"arm": "left"})
    right = action("b", "open_gripper", parameters={"arm": "right"})
    assert sharing_faults((left, right)) == []
    assert sharing_faults((left, action("c", "close_gripper")))


def test_an_order_by_way_of_a_third_is_an_order() -> None:
    three = (action("a", "turn"), action("s", "speak", "a"), action("b", "turn", "s"))
    assert sharing_faults(three) == []


def test_unordered_actions_are_put_in_turn_by_priority() -> None:
    actions = (
        action("a", "turn"),
        action("b", "move"),
        action("c", "stop", priority=Priority.HIGH),
        action("s", "speak"),
    )
    ordered = in_turn(actions)
    assert {one.id: one.depends_on for one in ordered} == {
        "c": (),
        "a": ("c",),
        "b": ("a",),
        "s": (),
    }
    assert sharing_faults(ordered) == []
