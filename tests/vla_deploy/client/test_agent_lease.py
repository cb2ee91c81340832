from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.client.agent_lease import LeaseKeeper, LeaseRule, is_agent, judge_lease, sender_of
from vla_deploy.ipc import SharedSpace

MINUTE_NS = 60 * NS_PER_S


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(100 * MINUTE_NS)


@pytest.fixture
def space(tmp_path: Path, clock: ManualClock) -> Iterator[SharedSpace]:
    space = SharedSpace(tmp_path / "ipc", clock)
    yield space
    space.close()


@pytest.mark.parametrize(
    ("granted_min", "lasts_min", "revoked_by", "rule"),
    [
        (100, 10, "", LeaseRule.LEASED),
        (95, 10, "", LeaseRule.LEASED),
        (40, 60, "", LeaseRule.EXPIRED),
        (90, 10, "", LeaseRule.EXPIRED),
        (100, 60, "", LeaseRule.LEASED),
        (100, 61, "", LeaseRule.INVALID),
        (101, 10, "", LeaseRule.INVALID),
        (100, 0, "", LeaseRule.INVALID),
        (100, -5, "", LeaseRule.INVALID),
        (100, 10, "cli:anna", LeaseRule.REVOKED),
    ],
)
def test_a_lease_counts_by_the_clock_and_never_longer_than_an_hour(
    granted_min, lasts_min, revoked_by, rule
):
    until_ns = (granted_min + lasts_min) * MINUTE_NS
    lease = {
        "granted_ns": granted_min * MINUTE_NS,
        "until_ns": until_ns,
        "granted_by": "cli:anna",
        "revoked_by": revoked_by,
    }
    state = judge_lease(lease, 100 * MINUTE_NS)
    assert (state.rule, state.is_live) == (rule, rule is LeaseRule.LEASED)
    assert bool(state.refusal) is not state.is_live


@pytest.mark.parametrize("lease", [{}, {"granted_ns": "now", "until_ns": None}, {"until_ns": 1e30}])
def test_a_document_that_is_no_lease_permits_nothing(lease):
    assert judge_lease(lease, 1).rule is LeaseRule.INVALID


def test_a_lease_is_granted_shown_and_taken_back(space, clock):
    desk, other = LeaseKeeper(space, clock), LeaseKeeper(space, clock)
    assert other.state().rule is LeaseRule.NOT_LEASED
    assert other.revoke("cli:anna").rule is LeaseRule.NOT_LEASED
    desk.grant("cli:anna", 10)
    clock.ns += 4 * MINUTE_NS
    assert (other.state().left_s, other.state().granted_by) == (360.0, "cli:anna")
    assert other.revoke("cli:ben").rule is LeaseRule.REVOKED
    desk.grant("cli:anna", 1)
    clock.ns += MINUTE_NS
    assert other.state().rule is LeaseRule.EXPIRED


def test_a_lease_ends_with_the_run(tmp_path, space, clock):
    LeaseKeeper(space, clock).grant("cli:anna", 60)
    next_run = SharedSpace(tmp_path / "next" / "ipc", clock)
    assert LeaseKeeper(next_run, clock).state().rule is LeaseRule.NOT_LEASED
    next_run.close()


@pytest.mark.parametrize("minutes", [0, -1, 60.1, float("nan"), float("inf")])
def test_no_lease_is_granted_for_longer_than_an_hour(space, clock, minutes):
    with pytest.raises(ValueError, match="at most 60"):
        LeaseKeeper(space, clock).grant("cli:anna", minutes)


@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("claude-desktop", "agent:claude-desktop"),
        ("", "agent:unnamed"),
        ("\x1b[2J\nagent:root \u202e", "agent:2J_agent_root"),
        ("x" * 10_000, "agent:" + "x" * 40),
    ],
)
def test_an_agent_is_named_in_plain_letters(name, source):
    assert sender_of(name) == source
    assert is_agent(source)


@pytest.mark.parametrize("source", ["cli", "page", "voice", "ros:/agent", "agents", ""])
def test_people_and_other_programs_are_no_agents(source):
    assert not is_agent(source)
