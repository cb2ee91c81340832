"""Injections cover every process and signal; the robot must rest in time and stay at rest."""

import math
import signal
from collections import Counter

import pytest

from sim_twin.campaigns.killing.jobs import jobs_of
from sim_twin.campaigns.killing.rest import STILL_RAD, RestWatch
from sim_twin.campaigns.killing.rules import (
    GRAVEST,
    RULES,
    SIGNALS,
    WITH_A_FULL_HAND,
    KillMoment,
    injections,
)
from vla_deploy.planning.patterns.backend import plan_command
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import load_robot


def test_every_process_gets_every_signal() -> None:
    processes = {process for process, _ in RULES}
    assert set(RULES) == {(process, number) for process in processes for number in SIGNALS}


def test_two_hundred_injections_take_all_pairs_about_equally_often() -> None:
    drawn = injections(200, seed=3)
    counts = Counter((each.process, each.signal) for each in drawn)
    assert len(drawn) == 200
    assert set(counts) == set(RULES)
    assert max(counts.values()) - min(counts.values()) <= 1


@pytest.mark.parametrize("seed", range(5))
def test_every_process_is_hit_once_before_any_is_hit_again(seed: int) -> None:
    processes = {process for process, _ in RULES}
    drawn = [one.process for one in injections(len(RULES), seed)]
    rounds = [drawn[at : at + len(processes)] for at in range(0, len(drawn), len(processes))]
    assert all(set(each) == processes for each in rounds)


def test_the_same_seed_draws_the_same_and_another_one_others() -> None:
    assert injections(30, seed=1) == injections(30, seed=1)
    assert injections(30, seed=1) != injections(30, seed=2)


@pytest.mark.parametrize("seed", range(20))
def test_twenty_have_the_gravest_ends_and_while_carrying(seed: int) -> None:
    drawn = injections(20, seed, latest_s=3.0)
    carrying = {(one.process, one.signal) for one in drawn if one.moment is KillMoment.CARRYING}
    pairs = {(one.process, one.signal) for one in drawn}
    assert len(pairs) == 20
    assert pairs >= set(GRAVEST)
    assert carrying == set(WITH_A_FULL_HAND)
    assert max(one.after_s for one in drawn) <= 3.0


@pytest.mark.parametrize("name", ["butler", "so101"])
def test_every_command_of_the_campaign_is_planned_by_patterns_alone(name: str) -> None:
    robot = load_robot(name)
    jobs = jobs_of(robot)
    asked = [(text, "pick_up", None) for text in jobs.commands]
    for text, skill, held in (*asked, *((text, "place", "object") for text in jobs.put_down)):
        world = world_of(robot, dict.fromkeys(robot.hands, held))
        assert skill in [action.skill for action in plan_command(text, world).actions], text


def test_processes_that_the_robot_does_not_have_are_not_hit() -> None:
    drawn = injections(len(RULES), 0, without=("speech",))
    assert {one.process for one in drawn} == {process for process, _ in RULES} - {"speech"}


KILLED = RULES["control", signal.SIGKILL]


@pytest.mark.parametrize(
    ("ready_s", "state", "failures"),
    [
        (KILLED.ready_s, "stopped", []),
        (math.inf, "stopped", ["ready after inf s, limit 30 s"]),
        (1.0, "armed", ["control is armed (why), expected disarmed or stopped or fault"]),
    ],
)
def test_what_is_ready_too_late_or_in_a_wrong_state_is_a_failure(
    ready_s: float, state: str, failures: list[str]
) -> None:
    assert list(KILLED.judge(ready_s, state, "why")) == failures


def seen(watch: RestWatch, *looks: tuple[float, float, float]) -> list[str]:
    """Feed the watch one joint's position and speed over time; return its failures."""
    for since_s, place, speed in looks:
        if watch.wants(since_s):
            joint = {"position": place, "velocity": speed}
            watch.look(since_s, {"joints": {"elbow": joint}})
    return list(watch.failures())


def test_a_robot_that_rests_in_time_and_stays_is_well() -> None:
    watch = RestWatch(KILLED)
    assert not seen(watch, (0.1, 0.0, 1.0), (1.5, 0.1, 0.0), (1.7, 0.1, 0.0), (9.0, 0.1, 0.0))
    assert watch.rest_s == KILLED.rest_s == 1.5


def test_one_that_never_rests_is_late() -> None:
    (failure,) = seen(RestWatch(KILLED), (0.1, 0.0, 1.0), (1.7, 0.4, 1.0), (9.0, 3.0, 1.0))
    assert failure.startswith("at rest after inf s")
    assert "elbow moves" in failure


@pytest.mark.parametrize("jerk", [STILL_RAD + 0.01, -1.0])
def test_a_jerk_when_the_process_comes_back_is_a_failure_though_it_ends(jerk: float) -> None:
    looks = [(0.5, 0.1, 0.0), (6.0, 0.1 + jerk, 0.0), (7.0, 0.1, 0.0)]
    (failure,) = seen(RestWatch(KILLED), *looks)
    assert failure.startswith("elbow moved by")


def test_where_no_hand_is_wanted_motion_goes_on_and_lowered_arms_lie_limp() -> None:
    carried_on = RestWatch(RULES["planner", signal.SIGKILL])
    assert not seen(carried_on, (0.1, 0.0, 1.0), (5.0, 2.0, 1.0))
    assert math.isnan(carried_on.rest_s)
    lowered = RestWatch(RULES["supervisor", signal.SIGTERM])
    assert not seen(lowered, (9.0, 0.0, 0.0), (20.0, 1.0, 0.0))


def test_a_limp_arm_may_slide_on_slowly_and_one_with_power_may_not() -> None:
    slides = ((1.0, 0.0, 0.04), (20.0, 0.5, 0.0))
    assert not seen(RestWatch(RULES["supervisor", signal.SIGTERM]), *slides)
    assert seen(RestWatch(KILLED), *slides)
