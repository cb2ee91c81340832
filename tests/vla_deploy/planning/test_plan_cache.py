"""A plan is given again only while everything that it depends on is the same."""

from dataclasses import replace

import pytest

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.asking import Proposal, Sureness
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.plan_cache import PlanCache, normalised
from vla_deploy.planning.understanding import Conversation, Turn
from vla_deploy.world.thing import Lost, Rest

PICK = ("pick_up", {"object": "cup"})
TIDY = "tidy up the cup"


@pytest.fixture
def cache(clock):
    return PlanCache(clock, most=2)


@pytest.fixture
def look(cache, clock):
    """Look up a request: True for a hit."""

    def look(request) -> bool:
        try:
            proposal = cache.propose(request, Deadline.within(clock, 1.0))
        except Declined:
            return False
        assert (proposal.rung, proposal.origin) == ("cache", "model")
        return True

    return look


def test_the_same_command_in_the_same_world_is_planned_once(cache, look, ask, propose):
    assert not look(ask(TIDY))
    cache.keep(ask(TIDY), propose(PICK))
    assert look(ask("  Tidy up  the CUP. "))
    assert cache.document() == {
        "hits": 1, "misses": 1, "changed": 0, "plans": 1, "hit_rate": 0.5
    }  # fmt: skip


@pytest.mark.parametrize("other", ["move 1.5 m", "move -15 m", "move 1 5 m", "put it there"])
def test_numbers_signs_and_small_words_are_not_lost(other):
    assert normalised(other) != normalised("move 15 m")


def test_what_a_hand_holds_counts(cache, look, ask, propose):
    cache.keep(ask(TIDY), propose(PICK))
    assert not look(ask(TIDY, holding={"left": "cup", "right": None}))
    assert not look(ask(TIDY)), "it was forgotten"


def test_things_that_are_spoken_of_count_and_others_do_not(cache, look, ask, propose, scene, thing):
    cache.keep(ask(TIDY), propose(PICK))
    with_book = replace(scene, things=(*scene.things, thing("book_1")))
    assert look(ask(TIDY, scene=with_book))
    assert not look(ask(TIDY, scene=replace(scene, things=scene.things[:1])))


def test_for_whoever_saw_the_scene_every_thing_counts(cache, look, ask, propose, scene, thing):
    cache.keep(ask(TIDY), propose(PICK, saw_scene=True))
    assert look(ask(TIDY))
    assert not look(ask(TIDY, scene=replace(scene, things=(*scene.things, thing("book_1")))))


def test_a_thing_that_was_put_elsewhere_counts(cache, look, ask, propose, scene, thing):
    cache.keep(ask(TIDY), propose(PICK))
    moved = replace(scene.things[0], rests=Rest("in", "box_1"))
    assert not look(ask(TIDY, scene=replace(scene, things=(moved, scene.things[1]))))


def test_where_the_robot_stands_counts_for_a_plan_with_coordinates(cache, look, ask, propose):
    back = ("navigate_to", {"x_m": 0.0, "y_m": 0.0})
    cache.keep(ask("fetch"), propose(PICK, back))
    assert look(ask("fetch", here=(0.05, 0.0, 0.0)))
    assert not look(ask("fetch", here=(1.0, 0.0, 0.0)))
    cache.keep(ask(TIDY), propose(PICK))
    assert look(ask(TIDY, here=(1.0, 0.0, 0.0)))


def test_for_whoever_saw_the_scene_the_part_of_the_room_counts(cache, look, ask, propose):
    cache.keep(ask(TIDY), propose(PICK, saw_scene=True))
    assert look(ask(TIDY, here=(0.4, 0.0, 2.0)))
    assert not look(ask(TIDY, here=(2.0, 0.0, 0.0)))


CHOSEN = ("pick_up", {"object": "cup_1"})
SPEAK = ("speak", {"text": "The cup is 2 m away."})


def moved(scene, distance_m: float):
    """The scene with its first thing somewhere else on the same table."""
    x_m, y_m, z_m = scene.things[0].position_m
    first = replace(scene.things[0], position_m=(x_m + distance_m, y_m, z_m))
    return replace(scene, things=(first, *scene.things[1:]))


@pytest.mark.parametrize("steps", [(CHOSEN,), (PICK, SPEAK)])
@pytest.mark.parametrize(
    ("moved_m", "here", "is_hit"),
    [
        (0.1, (0.1, 0.1, 0.1), True),
        (0.4, (0.0, 0.0, 0.0), False),
        (0.0, (0.4, 0.0, 0.0), False),
        (0.0, (0.0, 0.0, 0.5), False),
    ],
)
def test_an_id_that_a_model_chose_and_what_it_says_count_where_all_is_close(
    cache, look, ask, propose, scene, steps, moved_m, here, is_hit
):
    cache.keep(ask(TIDY), propose(*steps, saw_scene=True))
    assert look(ask(TIDY, scene=moved(scene, moved_m), here=here)) == is_hit


def test_an_id_that_was_said_is_the_same_thing_wherever_it_is(cache, look, ask, propose, scene):
    cache.keep(ask("take cup_1"), propose(CHOSEN))
    assert look(ask("take cup_1", scene=moved(scene, 2.0), here=(0.4, 0.0, 2.0)))


def test_a_robot_that_turned_once_around_looks_the_same_way(cache, look, ask, propose):
    cache.keep(ask(TIDY, here=(0.0, 0.0, 3.1)), propose(CHOSEN, saw_scene=True))
    assert look(ask(TIDY, here=(0.0, 0.0, -3.1)))


def test_what_is_gone_counts_for_whoever_was_told(cache, look, ask, propose, scene, thing):
    cache.keep(ask(TIDY), propose(PICK, saw_scene=True))
    lost = (Lost(thing=thing("ball_1"), cause="its place was seen without it"),)
    assert not look(ask(TIDY, scene=replace(scene, lost=lost)))


def test_a_robot_that_knows_its_place_now_is_asked_anew(cache, look, ask, propose):
    cache.keep(ask("bring me the cup", here=None), propose(PICK))
    assert not look(ask("bring me the cup"))


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        pytest.param((PICK,), {"is_momentary": True}, id="read when it was planned"),
        pytest.param((SPEAK,), {"saw_scene": True}, id="an answer of a model"),
    ],
)
def test_what_holds_for_a_moment_only_is_not_kept(cache, look, ask, propose, steps, told):
    cache.keep(ask(TIDY), propose(*steps, **told))
    assert not look(ask(TIDY))


def sure(confidence: float) -> Sureness:
    return Sureness(
        confidence=confidence, question="Shall I?", read_back_below=0.8, decline_below=0.3
    )


def test_a_kept_plan_is_as_sure_as_its_words_were_heard_this_time(cache, ask, propose, clock):
    def found(heard: float | None) -> Proposal:
        request = ask(TIDY, heard_confidence=heard)
        return cache.propose(request, Deadline.within(clock, 1.0))

    first = propose(PICK, sureness=sure(0.95)).as_heard(0.5)
    assert (first.confidence, first.read_back) == (0.5, "Shall I?")
    cache.keep(ask(TIDY, heard_confidence=0.5), first)
    told = [(found(heard).confidence, found(heard).read_back) for heard in (None, 0.9, 0.6)]
    assert told == [(0.95, ""), (0.9, ""), (0.6, "Shall I?")]
    with pytest.raises(Declined, match="not sure"):
        found(0.2)
    assert found(0.9).confidence == 0.9, "it was not forgotten for that"


def test_what_was_said_before_counts_where_words_refer_to_it(cache, look, ask, propose):
    talk = Conversation().after(Turn(said="find the cup"))
    later = talk.after(Turn(said="find the ball"))
    cache.keep(ask("pick it up", conversation=talk), propose(PICK))
    assert look(ask("pick it up", conversation=talk))
    assert not look(ask("pick it up", conversation=later))
    cache.keep(ask(TIDY, conversation=talk), propose(PICK))
    assert look(ask(TIDY, conversation=later))


def test_what_the_speaker_chose_counts(cache, look, ask, propose):
    cache.keep(ask(TIDY, conversation=Conversation(choices={"cup": "cup_1"})), propose(PICK))
    assert not look(ask(TIDY, conversation=Conversation(choices={"cup": "cup_2"})))


def test_plans_grow_old_and_are_few_and_those_that_failed_are_dropped(
    cache, look, ask, propose, clock
):
    for text in ("one", "two", "three"):
        cache.keep(ask(text), propose(PICK))
    assert [look(ask(text)) for text in ("one", "two", "three")] == [False, True, True]
    cache.forget("Two")
    assert not look(ask("two"))
    clock.pass_s(3601.0)
    assert not look(ask("three"))
