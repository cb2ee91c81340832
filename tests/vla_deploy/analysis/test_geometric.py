import pytest

from vla_deploy.analysis.document import Distance, EvidenceSource, Side, SizeClass
from vla_deploy.analysis.geometric import NO_POSE


def test_things_are_told_as_the_robot_sees_them(geometric, ask, thing):
    cup, bottle, box = (
        thing("cup_1", "red", 2.2, 1.6),
        thing("bottle_1", "green", 2.6, 1.5),
        thing("box_1", "brown", 1.85, 1.5),
    )
    told = {one.id: one for one in geometric.analyse(ask(cup, bottle, box)).objects}
    assert (told["cup_1"].side, told["cup_1"].distance) == (Side.CENTRE, Distance.NEAR)
    # The robot looks south: what lies to the east is on its left.
    assert (told["bottle_1"].side, told["box_1"].side) == (Side.LEFT, Side.RIGHT)
    assert (told["cup_1"].size, told["box_1"].size) == (SizeClass.SMALL, SizeClass.MEDIUM)
    assert (told["cup_1"].graspable, told["box_1"].graspable) == (True, False)
    assert {one.source for one in told.values()} == {EvidenceSource.GEOMETRY}
    assert told["cup_1"].confidence == pytest.approx(0.9)


def test_relations_are_those_of_the_world_model(geometric, ask, thing):
    ball = thing("ball_1", "blue", 2.0, 1.5, bottom_m=0.46)
    analysis = geometric.analyse(ask(thing("box_1", "brown", 2.0, 1.5), ball))
    told = {(one.subject, one.relation, one.other) for one in analysis.relations}
    assert ("ball_1", "in", "box_1") in told
    assert ("box_1", "on", "coffee_table") in told


def test_without_a_pose_there_are_things_but_no_sides(geometric, ask, thing):
    analysis = geometric.analyse(ask(thing("cup_1", "red", 2.2, 1.6), robot=None))
    assert (analysis.objects[0].side, analysis.objects[0].distance) == (None, None)
    assert analysis.notes == (NO_POSE,)


def test_what_was_seen_long_ago_is_less_sure(geometric, ask, thing):
    old = thing("cup_1", "red", 2.2, 1.6, last_seen_ns=0)
    assert geometric.analyse(ask(old)).objects[0].confidence < 0.85


def test_an_empty_scene_is_an_analysis_too(geometric, ask):
    analysis = geometric.analyse(ask())
    assert (analysis.objects, analysis.relations, analysis.task) == ((), (), None)
