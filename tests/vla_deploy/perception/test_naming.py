"""What becomes of a name when form and network agree, differ, or one of them is silent."""

import pytest

from vla_deploy.perception.naming.classes import BYSTANDERS, OTHER, Form
from vla_deploy.perception.naming.object_name import (
    ClassVote,
    Name,
    NameSource,
    by_both,
    by_form,
    chance_of,
)

POOR, GOOD = 0.55, 0.95


def form(name: str, *look_alikes: str, impossible: frozenset[str] = frozenset()) -> Form:
    fits = frozenset({name, *look_alikes}) - {OTHER}
    return Form(name=name, fits=fits, impossible=BYSTANDERS | impossible)


def said(class_name: str, chance: float) -> ClassVote:
    return ClassVote(class_name=class_name, chance=chance)


@pytest.mark.parametrize("chance", [0.05, POOR, GOOD])
def test_agreement_makes_a_name_surer_than_either(chance: float) -> None:
    name = by_both(form("ball"), [said("ball", chance)])
    assert (name.class_name, name.source) == ("ball", NameSource.BOTH)
    assert name.confidence > max(chance, by_form(form("ball")).confidence)


@pytest.mark.parametrize(
    "impossible", [frozenset(), frozenset({"bottle"})], ids=["possible", "ruled out by its size"]
)
def test_a_good_network_that_contradicts_the_form_leaves_no_sure_name(
    impossible: frozenset[str],
) -> None:
    disputed = by_both(form("keys", impossible=impossible), [said("bottle", GOOD)])
    assert disputed.confidence < 0.7
    doubted = by_both(form("keys", impossible=impossible), [said("bottle", POOR)])
    assert doubted.class_name == "keys"
    assert disputed.confidence < doubted.confidence < by_form(form("keys")).confidence


@pytest.mark.parametrize("chance", [POOR, GOOD])
def test_what_the_measures_rule_out_is_never_the_name(chance: float) -> None:
    for told in ("bottle", "person", "chair"):
        keys, unknown = (form(one, impossible=frozenset({"bottle"})) for one in ("keys", OTHER))
        assert by_both(keys, [said(told, chance)]).class_name in ("keys", OTHER)
        assert by_both(unknown, [said(told, chance)]).class_name == OTHER


def test_among_look_alikes_a_good_network_decides_and_a_poor_one_does_not() -> None:
    alike = form("cup", "can")
    poor, good = by_both(alike, [said("can", POOR)]), by_both(alike, [said("can", GOOD)])
    assert poor.class_name == "cup"
    assert poor.confidence < 0.6
    assert (good.class_name, good.source) == ("can", NameSource.BOTH)
    assert good.confidence > 0.8


def test_what_no_form_names_is_named_by_the_network_as_surely_as_it_is_right() -> None:
    assert by_both(form(OTHER), [said("cup", 0.8)]) == Name(
        class_name="cup", confidence=pytest.approx(0.8), source=NameSource.NETWORK
    )
    assert by_both(form(OTHER), [said("cup", 0.45)]).class_name == OTHER


def test_of_two_words_the_one_that_the_form_allows_is_the_name() -> None:
    words = [said("remote", 0.6), said("phone", 0.3)]
    only_a_phone = form("phone", impossible=frozenset({"remote"}))
    assert by_both(form(OTHER), words).class_name == "remote"
    assert by_both(only_a_phone, words).class_name == "phone"
    lone = by_both(only_a_phone, words[:1])
    assert by_both(only_a_phone, words).confidence > lone.confidence


def test_words_that_share_a_thing_are_no_surer_together_than_one_can_be() -> None:
    name = by_both(form(OTHER), [said("cup", 0.6), said("can", 0.4)])
    assert (name.class_name, name.confidence) == ("cup", pytest.approx(0.6 * 0.97))


def test_words_that_were_never_right_leave_the_form_as_it_is() -> None:
    words = [said("cup", 0.0), said("can", 0.0)]
    alone = by_form(form("ball")).confidence
    assert by_both(form("ball"), words).confidence == pytest.approx(alone)
    assert by_both(form(OTHER), words).class_name == OTHER


def test_a_weak_word_of_its_own_names_nothing_and_supports_the_form() -> None:
    weak = [said("cup", 0.3)]
    assert by_both(form(OTHER), weak).class_name == OTHER
    assert by_both(form("cup"), weak).confidence > by_form(form("cup")).confidence


def test_the_silence_of_a_network_that_finds_most_things_costs_confidence() -> None:
    sure = by_form(form("cup"))
    assert sure.confidence == pytest.approx(0.9)
    assert by_form(form("cup"), silence=0.43).confidence == pytest.approx(0.784, abs=1e-3)
    assert by_form(form("cup"), silence=0.95).confidence < 0.7
    assert by_form(form(OTHER), silence=0.95) == by_form(form(OTHER))


@pytest.mark.parametrize(
    ("score", "precision", "chance"),
    [(0.5, 0.6, 0.6), (0.9, 0.6, 0.6), (0.35, 0.6, 0.42), (1.0, 1.0, 0.97)],
)
def test_a_score_counts_for_no_more_than_the_model_was_measured_at(
    score: float, precision: float, chance: float
) -> None:
    assert chance_of(score, precision) == pytest.approx(chance)
