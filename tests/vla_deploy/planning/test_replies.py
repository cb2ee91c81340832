"""Talk gets a short true answer, and what the robot does not know is asked about or refused."""

import pytest

from benchmarks.planner_session import PlannerSession


@pytest.mark.parametrize(
    ("text", "outcome", "said"),
    [
        ("good evening", "plan", "Good evening."),
        (
            "How much battery do you have left?",
            "plan",
            "I cannot measure how full my battery is: nothing measures it now.",
        ),
        (
            "bring me my glasses",
            "refuse",
            'the object "my glasses"; I can handle: ball, block, book',
        ),
        ("put the glasses in the box", "refuse", 'the object "the glasses"; I can handle: ball'),
        ("where is my cap", "refuse", 'the object "my cap"; I can handle: ball, block, book'),
        ("pick up the cap", "refuse", 'the object "the cap"; I can handle: ball, block, book'),
        ("pick up the vase", "refuse", 'the object "the vase"; I can handle: ball, block, book'),
        ("bring me a cushion", "refuse", 'the object "a cushion"; I can handle: ball, block, book'),
        ("bring me something to drink", "refuse", "but I can look for things, bring them"),
        ("go to the moon", "refuse", 'the place "the moon"; I know: bedroom'),
    ],
)
def test_what_is_said_gets_a_true_answer(
    flat: PlannerSession, text: str, outcome: str, said: str
) -> None:
    answer = flat.say(text)[1]
    told = [one["parameters"].get("text", "") for one in (answer.plan or {}).get("actions", ())]
    assert answer.outcome == outcome, answer
    assert said in " ".join([answer.text, *told])
