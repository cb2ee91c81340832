"""Hold that an emergency stop comes through at once, whatever else arrives."""

from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.control.operator_desk import Act, OperatorDesk
from vla_deploy.ipc import RingWriter, SharedSpace


@pytest.fixture
def ring(tmp_path: Path) -> tuple[OperatorDesk, RingWriter]:
    space = SharedSpace(tmp_path, MonotonicClock())
    writer = space.ring_writer("operator")
    return OperatorDesk(space.ring_reader("operator", from_start=False)), writer


def ask(writer: RingWriter, *acts: str) -> None:
    for act in acts:
        writer.publish({"act": act, "source": "page", "reason": ""})


def test_acts_are_handed_out_one_by_one_in_order(ring: tuple[OperatorDesk, RingWriter]) -> None:
    desk, writer = ring
    ask(writer, "reset", "arm")
    desk.listen()
    assert desk.estop_source is None
    assert [desk.next_act(), desk.next_act(), desk.next_act()] == [Act.RESET, Act.ARM, None]


def test_an_estop_acts_for_one_tick_and_drops_what_came_before(
    ring: tuple[OperatorDesk, RingWriter],
) -> None:
    desk, writer = ring
    ask(writer, "arm", "estop", "reset")
    desk.listen()
    assert desk.estop_source == "page"
    assert [desk.next_act(), desk.next_act()] == [Act.RESET, None]
    desk.listen()
    assert desk.estop_source is None


def test_lost_events_count_as_an_estop(ring: tuple[OperatorDesk, RingWriter]) -> None:
    desk, writer = ring
    ask(writer, *["reset"] * 200)
    desk.listen()
    assert desk.estop_source == "operator events were lost"
    assert desk.next_act() is None


def test_an_unknown_act_is_told_and_does_nothing(ring: tuple[OperatorDesk, RingWriter]) -> None:
    desk, writer = ring
    ask(writer, "dance")
    desk.listen()
    assert desk.next_act() is None
    assert desk.estop_source is None
    assert desk.complaint == (
        "operator act 'dance' from page: expected one of estop, reset, arm, disarm"
    )
