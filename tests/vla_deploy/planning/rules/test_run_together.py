import pytest

from vla_deploy.planning.rules.run_together import with_commas


@pytest.mark.parametrize(
    ("heard", "said"),
    [
        ("pick up the red cup no wait the blue one", "pick up the red cup, no wait the blue one"),
        ("turn left thirty degrees sorry i meant sixty",
         "turn left thirty degrees, sorry i meant sixty"),
        ("count from the left and give me the third book", "give me the third book from the left"),
    ],
)  # fmt: skip
def test_commas_stand_where_a_new_thought_begins(heard: str, said: str) -> None:
    assert with_commas(heard) == said


@pytest.mark.parametrize(
    "text",
    [
        "could you bring me the cup",
        "please can you get the keys",
        "say my keys are lost can you bring them",
    ],
)
def test_what_belongs_together_stays_together(text: str) -> None:
    assert with_commas(text) == text
