"""What the robot says is brief, plain, polite, and promises nothing."""

import pytest

from vla_deploy.planning.dialogue.phrasing import _PHRASES, Says, steps_in_words
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.plan import PUT_IN, Plan


@pytest.mark.parametrize("sentence", Says)
def test_every_sentence_is_brief_and_promises_nothing(sentence):
    assert len(sentence.split()) <= 15
    assert sentence.endswith((".", "?", "}"))
    for promise in ("I will", "I'll", "promise", "always", "certainly", "sure"):
        assert promise not in sentence


def test_every_skill_can_be_put_into_words():
    assert set(_PHRASES) == set(SKILLS)


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ([("navigate_to", {"place": "living_room"})], "go to the living room"),
        (
            [
                ("pick_up", {"object": "cup_1"}),
                ("navigate_to", {"place": "kitchen"}),
                ("place", {"destination": "box", "relation": "in"}),
            ],
            "pick up the red cup, go to the kitchen and put it in the box",
        ),
        ([("move", {"distance_m": -0.5}), ("turn", {"angle_rad": -1.0})],
         "drive 0.5 metres back and turn right by 57 degrees"),
        ([("wait", {"duration_s": 1.0})] * 9,
         "wait 1 seconds, wait 1 seconds, wait 1 seconds, wait 1 seconds, wait 1 seconds, "
         "wait 1 seconds and do 3 things more"),
    ],
)  # fmt: skip
def test_a_plan_is_said_as_a_person_would(propose, steps, words):
    assert steps_in_words(propose(*steps).plan, {"cup_1": "red cup"}) == words


def test_a_way_that_was_put_in_is_not_told(propose):
    go, take = propose(
        ("navigate_to", {"object": "red cup"}), ("pick_up", {"object": "red cup"})
    ).plan.actions
    plan = Plan(goal="x", actions=(go.model_copy(update={"description": PUT_IN}), take))
    assert steps_in_words(plan, {}) == "pick up the red cup"
