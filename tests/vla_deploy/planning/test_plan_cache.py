"""A plan is given again only while everything that it depends on is the same."""

from dataclasses import replace

import pytest

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.errors import Declined
from vla_deploy.planning.plan_cache import PlanCache, normalised
from vla_deploy.planning.understanding import Conversation, Turn
from vla_deploy.world.thing import Lost, Rest

PICK = ("pick_up", {"object": "cup"})
TIDY = "tidy up the cup"
SPEAK = ("speak", {"text": "The cup is 2 m away."})


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
        assert (proposal.back_end, proposal.origin) == ("cache", "model")
        return True

    return look


def test_the_same_command_in_the_same_world_is_planned_once(cache, look, ask, propose):
    assert not look(ask(TIDY))
    cache.keep(ask(TIDY), propose(PICK, may_be_kept=True))
    assert look(ask("  Tidy up  the CUP. "))
    assert cache.document() == {
        "hits": 1, "misses": 1, "changed": 0, "plans": 1, "hit_rate": 0.5
    }  # fmt: skip


@pytest.mark.parametrize("other", ["move 1.5 m", "move -15 m", "move 1 5 m", "put it there"])
def test_numbers_signs_and_small_words_are_not_lost(other):
    assert normalised(other) != normalised("move 15 m")


def with_things(scene, *things):
    return replace(scene, things=things)


def moved(scene, distance_m: float):
    """The scene with its first thing somewhere else on the same table."""
    x_m, y_m, z_m = scene.things[0].position_m
    first = replace(scene.things[0], position_m=(x_m + distance_m, y_m, z_m))
    return with_things(scene, first, *scene.things[1:])


BEFORE = Conversation().after(Turn(said="find the cup"))
LATER = BEFORE.after(Turn(said="find the ball"))
CHANGES = {
    "nothing": (lambda scene, thing: {}, True),
    "a hand holds something": (
        lambda scene, thing: {"holding": {"left": "cup", "right": None}}, False
    ),
    "a thing more": (
        lambda scene, thing: {"scene": with_things(scene, *scene.things, thing("book_1"))}, False
    ),
    "a thing less": (lambda scene, thing: {"scene": with_things(scene, scene.things[0])}, False),
    "a thing rests elsewhere": (
        lambda scene, thing: {"scene": with_things(
            scene, replace(scene.things[0], rests=Rest("in", "box_1")), scene.things[1]
        )}, False
    ),
    "a thing is gone": (
        lambda scene, thing: {"scene": replace(
            scene, lost=(Lost(thing=thing("ball_1"), cause="its place was seen without it"),)
        )}, False
    ),
    "a thing moved a little": (lambda scene, thing: {"scene": moved(scene, 0.1)}, True),
    "a thing moved": (lambda scene, thing: {"scene": moved(scene, 0.4)}, False),
    "the robot moved a little": (lambda scene, thing: {"here": (0.1, 0.1, 0.1)}, True),
    "the robot moved": (lambda scene, thing: {"here": (0.4, 0.0, 0.0)}, False),
    "the robot turned": (lambda scene, thing: {"here": (0.0, 0.0, 0.5)}, False),
    "the robot turned once around": (lambda scene, thing: {"here": (0.0, 0.0, 6.25)}, True),
    "nobody knows where the robot is": (lambda scene, thing: {"here": None}, False),
    "the speaker chose": (
        lambda scene, thing: {"conversation": Conversation(choices={"cup": "cup_2"})}, False
    ),
    "something was said before": (lambda scene, thing: {"conversation": LATER}, True),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_a_plan_is_given_again_while_the_situation_is_the_same(
    cache, look, ask, propose, scene, thing, change
):
    changes, is_hit = CHANGES[change]
    cache.keep(ask(TIDY), propose(PICK, may_be_kept=True))
    assert look(ask(TIDY, **changes(scene, thing))) == is_hit
    assert look(ask(TIDY)) == is_hit, "what has changed is forgotten"


@pytest.mark.parametrize(
    ("steps", "told"),
    [
        pytest.param((PICK,), {"may_be_kept": False}, id="made in milliseconds"),
        pytest.param((SPEAK,), {}, id="an answer"),
    ],
)
def test_what_holds_for_a_moment_or_costs_nothing_is_not_kept(
    cache, look, ask, propose, steps, told
):
    cache.keep(ask(TIDY), propose(*steps, **({"may_be_kept": True} | told)))
    assert not look(ask(TIDY))


def test_what_was_said_before_counts_where_words_refer_to_it(cache, look, ask, propose):
    cache.keep(ask("pick it up", conversation=BEFORE), propose(PICK, may_be_kept=True))
    assert look(ask("pick it up", conversation=BEFORE))
    assert not look(ask("pick it up", conversation=LATER))


def test_plans_grow_old_and_are_few_and_those_that_failed_are_dropped(
    cache, look, ask, propose, clock
):
    for text in ("one", "two", "three"):
        cache.keep(ask(text), propose(PICK, may_be_kept=True))
    assert [look(ask(text)) for text in ("one", "two", "three")] == [False, True, True]
    cache.forget("Two")
    assert not look(ask("two"))
    clock.pass_s(3601.0)
    assert not look(ask("three"))
