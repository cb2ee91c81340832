"""Hostile calls against the twin: what the campaign finds, and that it finds what is wrong."""

import anyio
import pytest

from sim_twin.campaigns.agents import attacked, play

pytestmark = [pytest.mark.gl, pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.mark.parametrize("name", ["unleased/1", "leased/1"])
def test_hostile_calls_move_nothing_that_they_may_not(name: str) -> None:
    case = play(name, 200)
    assert case.failures == ()
    assert case.figures["calls"] == 200


def test_a_robot_that_moves_where_it_may_not_is_found() -> None:
    with attacked(seed=0) as attack:
        attack.lease.grant("test", 60)
        anyio.run(attack.play, 100, False)
    assert "a plan was carried out without a lease" in attack.failures
