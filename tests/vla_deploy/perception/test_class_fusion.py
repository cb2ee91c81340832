"""What becomes of a name when form and network agree, differ, or one of them is silent."""

import pytest

from vla_deploy.perception.naming.class_fusion import (
    MAX_EVIDENCE,
    ClassVote,
    Name,
    NameEvidence,
    NameSource,
    chance_of,
    fuse_name,
    name_by_form,
)
from vla_deploy.perception.naming.classes import BYSTANDERS, OTHER, Form

POOR, GOOD = 0.55, 0.95


def form(name: str, *look_alikes: str, impossible: frozenset[str] = frozenset()) -> Form:
    fits = frozenset({name, *look_alikes}) - {OTHER}
    return Form(name=name, fits=fits, impossible=BYSTANDERS | impossible)


def said(class_name: str, chance: float) -> ClassVote:
    return ClassVote(class_name=class_name, chance=chance)


@pytest.mark.parametrize("chance", [0.05, POOR, GOOD])
def test_agreement_makes_a_name_surer_than_either(chance: float) -> None:
    name = fuse_name(form("ball"), [said("ball", chance)])
    assert (name.class_name, name.source) == ("ball", NameSource.BOTH)
    assert name.confidence > max(chance, name_by_form(form("ball")).confidence)


@pytest.mark.parametrize(
    "impossible", [frozenset(), frozenset({"bottle"})], ids=["possible", "ruled out by its size"]
)
def test_a_good_network_that_contradicts_the_form_leaves_no_sure_name(
    impossible: frozenset[str],
) -> None:
    disputed = fuse_name(form("keys", impossible=impossible), [said("bottle", GOOD)])
    assert disputed.confidence < 0.7
    doubted = fuse_name(form("keys", impossible=impossible), [said("bottle", POOR)])
    assert doubted.class_name == "keys"
    assert disputed.confidence < doubted.confidence < name_by_form(form("keys")).confidence


@pytest.mark.parametrize("chance", [POOR, GOOD])
def test_what_the_measures_rule_out_is_never_the_name(chance: float) -> None:
    for told in ("bottle", "person", "chair"):
        keys, unknown = (form(one, impossible=frozenset({"bottle"})) for one in ("keys", OTHER))
        assert fuse_name(keys, [said(told, chance)]).class_name in ("keys", OTHER)
        assert fuse_name(unknown, [said(told, chance)]).class_name == OTHER


def test_among_look_alikes_a_good_network_decides_and_a_poor_one_does_not() -> None:
    alike = form("cup", "can")
    poor, good = fuse_name(alike, [said("can", POOR)]), fuse_name(alike, [said("can", GOOD)])
    assert poor.class_name == "cup"
    assert poor.confidence < 0.6
    assert (good.class_name, good.source) == ("can", NameSource.BOTH)
    assert good.confidence > 0.8


def test_what_no_form_names_is_named_by_the_network_as_surely_as_it_is_right() -> None:
    assert fuse_name(form(OTHER), [said("cup", 0.8)]) == Name(
        class_name="cup", confidence=pytest.approx(0.8), source=NameSource.NETWORK
    )
    assert fuse_name(form(OTHER), [said("cup", 0.45)]).class_name == OTHER


def test_of_two_words_the_one_that_the_form_allows_is_the_name() -> None:
    words = [said("remote", 0.6), said("phone", 0.3)]
    only_a_phone = form("phone", impossible=frozenset({"remote"}))
    assert fuse_name(form(OTHER), words).class_name == "remote"
    assert fuse_name(only_a_phone, words).class_name == "phone"
    lone = fuse_name(only_a_phone, words[:1])
    assert fuse_name(only_a_phone, words).confidence > lone.confidence


def test_words_that_share_a_thing_are_no_surer_together_than_one_can_be() -> None:
    name = fuse_name(form(OTHER), [said("cup", 0.6), said("can", 0.4)])
    assert (name.class_name, name.confidence) == ("cup", pytest.approx(0.6 * 0.97))


def test_words_that_were_never_right_leave_the_form_as_it_is() -> None:
    words = [said("cup", 0.0), said("can", 0.0)]
    alone = name_by_form(form("ball")).confidence
    assert fuse_name(form("ball"), words).confidence == pytest.approx(alone)
    assert fuse_name(form(OTHER), words).class_name == OTHER


def test_a_weak_word_of_its_own_names_nothing_and_supports_the_form() -> None:
    weak = [said("cup", 0.3)]
    assert fuse_name(form(OTHER), weak).class_name == OTHER
    assert fuse_name(form("cup"), weak).confidence > name_by_form(form("cup")).confidence


def test_the_silence_of_a_network_that_finds_most_things_costs_confidence() -> None:
    sure = name_by_form(form("cup"))
    assert sure.confidence == pytest.approx(0.9)
    assert name_by_form(form("cup"), missed_recall=0.43).confidence == pytest.approx(
        0.784, abs=1e-3
    )
    assert name_by_form(form("cup"), missed_recall=0.95).confidence < 0.7
    assert name_by_form(form(OTHER), missed_recall=0.95) == name_by_form(form(OTHER))


@pytest.mark.parametrize(
    ("score", "precision", "chance"),
    [(0.5, 0.6, 0.6), (0.9, 0.6, 0.6), (0.35, 0.6, 0.42), (1.0, 1.0, 0.97)],
)
def test_a_score_counts_for_no_more_than_the_model_was_measured_at(
    score: float, precision: float, chance: float
) -> None:
    assert chance_of(score, precision) == pytest.approx(chance)


def evidence_of(*names: str, **weights: float) -> NameEvidence:
    evidence = NameEvidence("object", weights)
    for name in names:
        evidence.add(name)
    return evidence


def test_the_majority_of_looks_is_believed_not_the_last_one() -> None:
    evidence = evidence_of("cup", "cup", "cup", "ball")
    assert evidence.best == "cup"
    assert evidence.shares(2) == {"cup": 0.75, "ball": 0.25}


def test_nothing_seen_is_nothing_believed() -> None:
    nothing = evidence_of()
    assert (nothing.best, nothing.share("cup"), nothing.shares(3)) == ("object", 0.0, {})


def test_not_to_recognise_a_thing_says_little() -> None:
    assert evidence_of("ball", *["object"] * 3, object=0.25).best == "ball"
    assert evidence_of("ball", *["object"] * 5, object=0.25).best == "object"


def test_after_a_thing_was_exchanged_new_looks_win_in_bounded_time() -> None:
    evidence = evidence_of(*["cup"] * 1000)
    for _ in range(round(MAX_EVIDENCE)):
        evidence.add("ball")
    assert evidence.best == "ball"
