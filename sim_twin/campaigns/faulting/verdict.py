"""Compare what a scenario expects with what was seen."""

from collections.abc import Iterator, Mapping

from sim_twin.campaigns.faulting.witness import FaultWitness
from sim_twin.faults.scenario import NO_CAUSE, Expectation


def failures(expect: Expectation, seen: FaultWitness, before: Mapping[str, int]) -> Iterator[str]:
    """Yield everything that is not as it must be at the end of the fault."""
    yield from _cause(expect, seen)
    if expect.rest_within_s is not None and not seen.rest_s <= expect.rest_within_s:
        yield f"at rest after {seen.rest_s:.3f} s, expected within {expect.rest_within_s:g} s"
    aged = tuple(seen.torques()) if expect.stale_joints == ("all",) else expect.stale_joints
    yield from _same("stale joints", seen.aged, aged)
    yield from _same("stale topics", seen.silent, expect.stale_topics)
    if expect.alert is not None and expect.alert not in seen.alerts:
        yield f"hardware errors of {sorted(seen.alerts)}, expected {expect.alert}"
    yield from _torque(expect, seen)
    after = seen.counters()
    for name in expect.counts:
        if after.get(name, 0) <= before.get(name, 0):
            yield f"{name} did not rise from {before.get(name)}; there are {', '.join(after)}"


def _cause(expect: Expectation, seen: FaultWitness) -> Iterator[str]:
    if seen.cause != expect.cause:
        yield f"cause {seen.cause}, expected {expect.cause}"
    elif expect.cause == NO_CAUSE and seen.states != {"armed"}:
        yield f"states {sorted(seen.states)}, expected armed all the time"
    elif expect.cause != NO_CAUSE and not seen.cause_s <= expect.within_s:
        yield f"cause after {seen.cause_s:.3f} s, expected within {expect.within_s:g} s"


def _same(what: str, seen: set[str], wanted: tuple[str, ...] | None) -> Iterator[str]:
    if wanted is not None and seen != set(wanted):
        yield f"{what}: {sorted(seen)}, expected {sorted(wanted)}"


def _torque(expect: Expectation, seen: FaultWitness) -> Iterator[str]:
    on = {joint for joint, has_torque in seen.torques().items() if has_torque}
    if expect.torque == "kept" and on != set(seen.torques()):
        yield f"torque was lost on {sorted(set(seen.torques()) - on)}"
    if expect.torque == "off" and on:
        yield f"torque is on at {sorted(on)}"
