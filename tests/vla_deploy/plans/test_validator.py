import pytest

from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.plans.validator import check_plan

WORLD = World(
    places={"kitchen": "kitchen", "galley": "kitchen"},
    poses=frozenset({"tuck"}),
    holding={},
    devices={"lamp": "lamp", "light": "lamp"},
)


def action(
    skill: str, name: str = "a1", depends_on: tuple[str, ...] = (), **given: object
) -> Action:
    return Action(id=name, skill=skill, parameters=given, depends_on=depends_on)


def faults_of(plan: Plan) -> list[str]:
    try:
        check_plan(plan, WORLD)
    except PlanInvalid as error:
        return list(error.faults)
    return []


def faults(*actions: Action) -> list[str]:
    return faults_of(Plan(goal="test", actions=actions))


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (action("fly"), 'unknown skill "fly"'),
        (action("pick_up"), 'needs "object"'),
        (action("pick_up", object="red cup", speed=3), 'no parameter "speed"'),
        (action("pick_up", object="dinosaur"), 'do not know the object "dinosaur"'),
        (action("pick_up", object="box"), "too large"),
        (action("pick_up", object="cup", arm="third"), "one of left, right"),
        (action("pick_up", object="cup", grasp="edge"), "one of top, side"),
        (action("pick_up", object="book", grasp="side"), "a book is not round; from the side I"),
        (action("pick_up", object="cup", careful="very"), "true or false"),
        (action("pick_up", object="cup", force_ratio=3.0), "in 0.5 to 1.3"),
        (action("navigate_to", place="moon"), 'unknown place "moon"'),
        (action("navigate_to"), "exactly one of place or object or x_m+y_m"),
        (action("navigate_to", place="kitchen", object="cup"), "exactly one of"),
        (action("navigate_to", x_m=1.0), 'needs "y_m" too'),
        (action("move", distance_m=99), "in -3 to 3"),
        (action("move", distance_m=float("nan")), "must be a number"),
        (action("move", distance_m=True), "must be a number"),
        (action("speak", text="  "), "1 to 500 characters"),
        (action("move_arm", pose="dance"), "unknown pose"),
        (action("turn_on"), 'turn_on needs "device", a known device of the home'),
        (action("turn_off", device="oven"), 'unknown device "oven"; known: lamp'),
        (action("turn_on", device=["lamp"]), "unknown device"),
        (action("place", destination="moon", relation="in"), "moon"),
    ],
)
def test_each_fault_is_named(bad: Action, said: str) -> None:
    found = faults(bad)
    assert len(found) == 1
    assert said in found[0]


def test_a_cycle_is_named_with_its_path() -> None:
    found = faults(
        action("stop", "a", depends_on=("c",)),
        action("stop", "b", depends_on=("a",)),
        action("stop", "c", depends_on=("b",)),
    )
    assert found == ["the dependencies form a cycle: a -> c -> b -> a"]


def test_all_faults_of_a_plan_are_told_at_once() -> None:
    plan = Plan(goal="x", actions=(action("fly"), action("wait", "a1", ("zz",), duration_s=-1)))
    with pytest.raises(PlanInvalid) as caught:
        check_plan(plan, WORLD)
    assert len(caught.value.faults) == 4


def test_an_infeasible_or_empty_plan_is_refused() -> None:
    assert faults_of(Plan(goal="x", feasible=False, reasoning="no arm"))
    assert faults_of(Plan(goal="x")) == ["it has no actions"]


def test_aliases_of_places_are_accepted() -> None:
    assert faults(action("navigate_to", place="the galley")) == []


def test_a_device_may_be_called_by_any_of_its_names() -> None:
    assert not faults(action("turn_on", device="the light"), action("turn_off", "b", device="lamp"))
