"""Examples are right by construction: copied words are in the command, answers in the schema."""

import json
from random import Random

import pytest

from training.planner.sentences.clause import load_groups
from training.planner.sentences.composing import Composer
from training.planner.sentences.grammar import PatternInvalid, expand, parse
from training.planner.sentences.telling import load_told
from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS, IMPLIED, STEPS, field_names


def test_a_pattern_gives_one_of_its_forms() -> None:
    pattern = parse("(pick|lift) [up] the cup")
    forms = {" ".join(map(str, expand(pattern, Random(seed)))) for seed in range(40)}
    assert forms == {"pick the cup", "lift the cup", "pick up the cup", "lift up the cup"}


@pytest.mark.parametrize("pattern", ["(pick|lift", "pick) up", "[a"])
def test_a_pattern_with_an_open_bracket_is_refused(pattern: str) -> None:
    with pytest.raises(PatternInvalid):
        parse(pattern)


@pytest.mark.parametrize("held_out", [False, True])
def test_every_copied_word_is_in_the_command_in_its_order(held_out: bool) -> None:
    composer, random = Composer(held_out=held_out), Random(4)
    for _ in range(600):
        example = composer.example(random)
        command = example.command.split()
        for step in json.loads(example.answer)["steps"]:
            for field in COPIED_FIELDS & step.keys():
                if step[field].strip() not in IMPLIED:
                    rest = iter(command)
                    assert all(word in rest for word in step[field].split()), example


def test_every_answer_has_the_fields_of_its_step() -> None:
    composer, random = Composer(), Random(5)
    for _ in range(600):
        for step in json.loads(composer.example(random).answer)["steps"]:
            names = dict(field_names(step["do"]))
            assert {name for name, is_needed in names.items() if is_needed} <= step.keys()
            assert step.keys() <= {"do", *names}


def test_the_same_seed_gives_the_same_examples() -> None:
    first, second = ((Composer(), Random(9)) for _ in range(2))
    for _ in range(3):
        assert first[0].example(first[1]) == second[0].example(second[1])


def test_every_step_has_phrases_and_those_kept_back_are_others() -> None:
    trained, kept = load_groups(held_out=False), load_groups(held_out=True)
    told = {step["do"] for frame in load_told(held_out=False) for step in frame.steps}
    assert set(trained) | told == set(STEPS)
    for do, groups in kept.items():
        own = {form for one in trained[do] for form in (*one.imperative, *one.free)}
        assert own.isdisjoint(form for one in groups for form in (*one.imperative, *one.free))
