"""Talk with the planner over several turns, by its own topics."""

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
def talk(open_desk):
    """Give one command after the other in a scene; return what the planner made of the last."""
    desk = open_desk()
    told = iter(range(100))

    def talk(text: str) -> str:
        desk.clock.pass_s(1.0)
        desk.control("armed")
        seen = [one | {"last_seen_ns": desk.clock.now_ns()} for one in (RED, BLUE, BALL)]
        desk.shows(*seen, robot=ROBOT)
        desk.give(text=text, command_id=f"c{next(told)}")
        answers = desk.answers()
        plans = desk.plans()
        if plans:
            return in_short(plans[-1]["plan"])
        last = answers[-1]
        return f"{last['event']}: {last.get('question') or last.get('reason')}"

    return talk


def in_short(plan: dict) -> str:
    """Return the last step of a plan and its parameters."""
    last = plan["actions"][-1]
    return " ".join([last["skill"], *(str(value) for value in last["parameters"].values())])


def test_a_question_is_answered_and_the_command_goes_on(talk) -> None:
    assert talk("pick up the cup") == "asked: Which cup, the red one or the blue one?"
    assert talk("the blue one") == "pick_up cup_2"


@pytest.mark.parametrize(
    "answer", ["not the red one", "the second one", "the left one", "the one on the left"]
)
def test_an_answer_may_count_or_leave_out(talk, answer: str) -> None:
    talk("pick up the cup")
    assert talk(answer) == "pick_up cup_2"


def test_neither_drops_the_command_that_waits(talk) -> None:
    talk("pick up the cup")
    assert talk("neither of them").startswith("rejected: ")


def test_never_mind_drops_the_command_that_waits(talk) -> None:
    talk("pick up the cup")
    assert talk("never mind").startswith("rejected: ")


def test_it_and_the_other_one_are_what_was_spoken_of_before(talk) -> None:
    assert talk("look at the left cup") == "look_at cup_2"
    assert talk("pick it up") == "pick_up cup_2"
    assert talk("look at the other one") == "look_at cup_1"


def test_a_question_about_a_thing_mentions_it(talk) -> None:
    assert talk("where is the ball?") == "speak The green ball is on the coffee table, in view."
    assert talk("pick it up") == "pick_up ball_1"


def test_what_the_speaker_sees_is_not_guessed(talk) -> None:
    assert "left, right, in front and behind change" in talk("pick up the cup on my left")


def test_the_map_is_asked_before_a_straight_way(talk) -> None:
    assert "the map shows 1.1 m of room" in talk("drive backwards 1.5 m")


def test_a_misheard_name_is_refused_with_what_is_known(talk) -> None:
    assert "I do not know" in talk("pick up the red cap")


def test_an_unclear_answer_may_say_where_it_is(talk) -> None:
    assert talk("pick up the cup").startswith("asked: Which cup")
    assert talk("the left one on the coffee table") == "pick_up cup_2"


def test_a_place_may_be_answered_with_the_way_there(talk) -> None:
    assert talk("go there") == "asked: Where do you mean?"
    assert talk("over in the kitchen") == "navigate_to kitchen"
