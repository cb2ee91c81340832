import pytest

from vla_deploy.perception.naming.class_fusion import MOST_EVIDENCE, Belief


def of(*names: str, **weights: float) -> Belief:
    belief = Belief("object", weights)
    for name in names:
        belief.add(name)
    return belief


def test_the_majority_of_looks_is_believed_not_the_last_one() -> None:
    belief = of("cup", "cup", "cup", "ball")
    assert belief.best == "cup"
    assert belief.shares(2) == {"cup": 0.75, "ball": 0.25}


def test_nothing_seen_is_nothing_believed() -> None:
    assert (of().best, of().share("cup"), of().shares(3)) == ("object", 0.0, {})


def test_not_to_recognise_a_thing_says_little() -> None:
    assert of("ball", *["object"] * 3, object=0.25).best == "ball"
    assert of("ball", *["object"] * 5, object=0.25).best == "object"


def test_a_look_that_shows_less_counts_less() -> None:
    belief = of("cup")
    belief.add("ball", 0.5)
    assert belief.share("cup") == pytest.approx(2 / 3)


def test_after_a_thing_was_exchanged_new_looks_win_in_bounded_time() -> None:
    belief = of(*["cup"] * 1000)
    for _ in range(round(MOST_EVIDENCE)):
        belief.add("ball")
    assert belief.best == "ball"
