"""Talk with the planner over several turns, by its own topics."""

from fnmatch import fnmatchcase

import pytest

RED = {
    "id": "cup_1",
    "class": "cup",
    "colour": "red",
    "position_m": [2.0, 1.5, 0.5],
    "size_m": [0.066, 0.066, 0.095],
    "rests": {"relation": "on", "of": "coffee_table"},
}
BLUE = RED | {"id": "cup_2", "colour": "blue", "position_m": [2.4, 1.5, 0.5]}
BALL = RED | {"id": "ball_1", "class": "ball", "colour": "green", "position_m": [2.2, 1.5, 0.475],
              "size_m": [0.05, 0.05, 0.05]}  # fmt: skip


# Before the coffee table, looking at it: the blue cup is on the left.
ROBOT = {"x_m": 2.15, "y_m": 2.05, "yaw_rad": -1.5708}


@pytest.fixture
def talk(desk):
    """Give one command after the other in a scene; return what the planner made of the last."""

    def talk(text: str) -> str:
        desk.clock.pass_s(1.0)
        desk.control("armed")
        seen = [one | {"last_seen_ns": desk.clock.now_ns()} for one in (RED, BLUE, BALL)]
        desk.shows(*seen, robot=ROBOT)
        answers, plans = desk.answers_to(text), desk.plans()
        if plans:
            desk.ends(plans[-1]["command_id"])
            return in_short(plans[-1]["plan"])
        last = answers[-1]
        return f"{last['event']}: {last.get('question') or last.get('reason')}"

    return talk


def in_short(plan: dict) -> str:
    """Return the last step of a plan and its parameters."""
    last = plan["actions"][-1]
    return " ".join([last["skill"], *(str(value) for value in last["parameters"].values())])


@pytest.mark.parametrize(
    "turns",
    [
        [("pick up the cup", "asked: Which cup, the red one or the blue one?"),
         ("the blue one", "pick_up cup_2")],
        [("pick up the cup", "asked: *"), ("not the red one", "pick_up cup_2")],
        [("pick up the cup", "asked: *"), ("the second one", "pick_up cup_2")],
        [("pick up the cup", "asked: *"), ("the one on the left", "pick_up cup_2")],
        [("pick up the cup", "asked: *"), ("the left one on the coffee table", "pick_up cup_2")],
        [("pick up the cup", "asked: *"), ("neither of them", "rejected: *")],
        [("pick up the cup", "asked: *"), ("never mind", "rejected: *")],
        [("go there", "asked: Where do you mean?"), ("over in the kitchen", "navigate_to kitchen")],
        [("look at the left cup", "look_at cup_2"), ("pick it up", "pick_up cup_2"),
         ("look at the other one", "look_at cup_1")],
        [("where is the ball?", "speak The green ball is on the coffee table, in view."),
         ("pick it up", "pick_up ball_1")],
        [("pick up the cup on my left",
          'rejected: "the cup on my left": left, right, in front and behind change*')],
        [("drive backwards 1.5 m",
          'rejected: the plan was refused: action "a1": move breaks "area allowed": -1.5 m asked, '
          "the map shows 1.1 m of room*")],
        [("pick up the red cap", 'rejected: I do not know the object "the red cap"*')],
    ],
    ids=lambda turns: turns[-1][0],
)  # fmt: skip
def test_what_is_said_is_understood_by_what_was_said_before(talk, turns) -> None:
    for said, answer in turns:
        told = talk(said)
        assert fnmatchcase(told, answer), told
