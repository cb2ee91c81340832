"""What a model claims beside what was measured: names and doubts yes, abilities no."""

import pytest

from vla_deploy.analysis.claims import (
    ClaimedObject,
    ClaimedRelation,
    ClaimedTask,
    SceneClaims,
    weighed,
)
from vla_deploy.analysis.document import EvidenceSource
from vla_deploy.feasibility.verdict import Feasible


def claim(name: str, **changes) -> ClaimedObject:
    fields = {
        "id": None,
        "name": name,
        "colour": "red",
        "side": "centre",
        "distance": "near",
        "size": "small",
        "confidence": 0.95,
    }
    return ClaimedObject.model_validate(fields | changes)


def opinion(feasible: bool, **changes) -> ClaimedTask:
    fields = {"feasible": feasible, "confidence": 1.0, "reason": "so it seems"}
    lists = dict.fromkeys(("prerequisites", "obstacles", "alternatives"), ())
    return ClaimedTask.model_validate(fields | lists | changes)


@pytest.fixture
def weigh(geometric, ask, thing):
    """Weigh claims against a red cup and something unrecognised; return the analysis by name."""

    def weigh(*claims: ClaimedObject, relations=(), task=None, goal: str = ""):
        cup = thing("cup_1", "red", 2.2, 1.6)
        unknown = thing("object_1", "grey", 2.4, 1.6)
        measured = geometric.analyse(ask(cup, unknown, goal=goal))
        given = SceneClaims(objects=claims, relations=relations, task=task)
        return weighed(measured, given, "server bench")

    return weigh


def by_id(analysis):
    return {one.id: one for one in analysis.objects}


def test_a_thing_not_recognised_gets_the_model_s_name_and_no_more_confidence_than_either(weigh):
    named = by_id(weigh(claim("remote control", id="object_1", colour="grey", confidence=0.6)))
    assert (named["object_1"].name, named["object_1"].source) == (
        "remote control",
        EvidenceSource.BOTH,
    )
    assert named["object_1"].confidence == 0.6
    assert named["object_1"].graspable


@pytest.mark.parametrize("name", ["cup", "coffee mug", "Red Mug"])
def test_an_agreeing_name_is_vouched_for_by_both(weigh, name):
    cup = by_id(weigh(claim(name, id="cup_1")))["cup_1"]
    assert (cup.name, cup.source, cup.confidence) == ("cup", EvidenceSource.BOTH, 0.9)


def test_a_contradicting_name_costs_confidence_and_changes_nothing_else(weigh):
    cup = by_id(weigh(claim("bottle", id="cup_1")))["cup_1"]
    assert (cup.name, cup.source, cup.confidence) == ("cup", EvidenceSource.GEOMETRY, 0.45)


def test_a_thing_that_was_not_measured_can_never_be_taken(weigh):
    extra = weigh(claim("golden key", side="left", confidence=1.0)).objects[-1]
    assert (extra.id, extra.graspable, extra.accessible) == (None, False, False)
    assert (extra.source, extra.confidence) == (EvidenceSource.MODEL, 0.3)


@pytest.mark.parametrize("false_id", ["cup_7", "door_1", ""])
def test_an_id_that_the_robot_did_not_give_means_nothing(weigh, false_id):
    extra = weigh(claim("door", id=false_id)).objects[-1]
    assert (extra.id, extra.graspable) == (None, False)


def test_an_id_claimed_elsewhere_than_measured_is_another_thing(weigh):
    analysis = weigh(claim("cup", id="object_1", side="right", colour="grey"))
    assert by_id(analysis)["object_1"].name == "object"
    assert analysis.objects[-1].id is None


def test_an_id_claimed_twice_counts_once(weigh):
    analysis = weigh(claim("mug", id="cup_1"), claim("mug", id="cup_1"))
    assert [one.id for one in analysis.objects] == ["cup_1", "object_1", None]


def test_a_claim_without_id_is_matched_by_what_it_is_and_where(weigh):
    analysis = weigh(claim("mug"))
    assert len(analysis.objects) == 2
    assert by_id(analysis)["cup_1"].source is EvidenceSource.BOTH


def test_relations_are_taken_only_where_nothing_was_measured(weigh):
    relations = tuple(
        ClaimedRelation(subject=subject, relation="in", other=other)
        for subject, other in (
            ("cup_1", "object_1"), ("poster", "cup_1"), ("poster", "poster"), ("ghost", "cup_1"),
        )
    )  # fmt: skip
    analysis = weigh(claim("poster", side="left"), relations=relations)
    added = [one for one in analysis.relations if one.source is EvidenceSource.MODEL]
    assert [(one.subject, one.relation, one.other) for one in added] == [("poster", "in", "cup_1")]


def test_a_model_can_doubt_a_goal_but_not_refuse_it(weigh):
    doubt = opinion(False, reason="the cup is full", prerequisites=["empty the cup"])
    task = weigh(task=doubt, goal="pick up the red cup").task
    assert (task.feasible, task.confidence) == (Feasible.YES, 0.45)
    assert task.prerequisites == ("model: empty the cup",)
    assert "model: doubts it: the cup is full" in task.reason


@pytest.mark.parametrize(
    ("goal", "feasible"),
    [
        ("put the object in the red cup", Feasible.NO),
        ("water the plants", Feasible.UNKNOWN),
        ("pick up the green bottle", Feasible.UNKNOWN),
    ],
)
def test_a_model_cannot_make_a_goal_feasible(weigh, goal, feasible):
    before, after = weigh(goal=goal).task, weigh(task=opinion(True), goal=goal).task
    assert (after.feasible, after.confidence) == (feasible, before.confidence)


def test_without_a_goal_there_is_no_verdict_whatever_the_model_says(weigh):
    assert weigh(task=opinion(True)).task is None
