"""Hold that an emergency stop comes through at once, whatever else arrives."""

from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.control.modes.operator_acts import (
    LATCHED_BEFORE,
    LOST,
    MOST_WAITING,
    OperatorAct,
    OperatorInbox,
)
from vla_deploy.ipc import RingWriter, SharedSpace


@pytest.fixture
def ring(tmp_path: Path) -> tuple[OperatorInbox, RingWriter]:
    space = SharedSpace(tmp_path, MonotonicClock())
    writer = space.ring_writer("operator")
    return OperatorInbox(space.ring_reader("operator", from_start=False)), writer


def ask(writer: RingWriter, *acts: str) -> None:
    for act in acts:
        writer.publish({"act": act, "source": "page", "reason": ""})


def test_acts_are_handed_out_one_by_one_in_order(ring: tuple[OperatorInbox, RingWriter]) -> None:
    desk, writer = ring
    ask(writer, "reset", "arm")
    desk.listen()
    assert desk.estop_source is None
    assert [desk.next_act(), desk.next_act(), desk.next_act()] == [
        OperatorAct.RESET,
        OperatorAct.ARM,
        None,
    ]


def test_an_estop_acts_for_one_tick_and_drops_what_came_before(
    ring: tuple[OperatorInbox, RingWriter],
) -> None:
    desk, writer = ring
    ask(writer, "arm", "estop", "reset")
    desk.listen()
    assert desk.estop_source == "page"
    assert [desk.next_act(), desk.next_act()] == [OperatorAct.RESET, None]
    desk.listen()
    assert desk.estop_source is None


def test_lost_events_count_as_an_estop(ring: tuple[OperatorInbox, RingWriter]) -> None:
    desk, writer = ring
    ask(writer, *["reset"] * 200)
    desk.listen()
    assert desk.estop_source == "operator events were lost"
    assert desk.next_act() is None


def test_a_damaged_event_counts_as_an_estop(
    ring: tuple[OperatorInbox, RingWriter], tmp_path: Path
) -> None:
    desk, writer = ring
    ask(writer, "reset")
    (file,) = (path for path in tmp_path.iterdir() if b'"reset"' in path.read_bytes())
    with file.open("r+b") as memory:
        memory.seek(file.read_bytes().index(b'"reset"'))
        memory.write(b'"arm"')
    desk.listen()
    assert desk.estop_source == LOST
    assert desk.next_act() is None


def test_whoever_floods_the_desk_delays_nobody_for_long(
    ring: tuple[OperatorInbox, RingWriter],
) -> None:
    desk, writer = ring
    for _ in range(100):
        ask(writer, "arm")
        desk.listen()
    assert desk.complaint == f"arm from page was dropped: {MOST_WAITING} acts wait already"
    assert [desk.next_act() for _ in range(MOST_WAITING + 1)] == [
        *[OperatorAct.ARM] * MOST_WAITING,
        None,
    ]


def test_an_unknown_act_is_told_and_does_nothing(ring: tuple[OperatorInbox, RingWriter]) -> None:
    desk, writer = ring
    ask(writer, "dance")
    desk.listen()
    assert desk.next_act() is None
    assert desk.estop_source is None
    assert desk.complaint == (
        "operator act 'dance' from page: expected one of estop, reset, arm, disarm"
    )


def reopened(tmp_path: Path, *, latched: bool | None, before: bool) -> OperatorInbox:
    """Return the desk of a control that starts after a press, told of `before` it or not."""
    space = SharedSpace(tmp_path, MonotonicClock())
    writer, status = space.ring_writer("operator"), space.cell_writer("control_status")
    if latched is not None and not before:
        status.put_document({"estop_latched": latched})
    ask(writer, "estop", "arm")
    if latched is not None and before:
        status.put_document({"estop_latched": latched})
    ring = space.ring_reader("operator", from_start=True)
    return OperatorInbox(ring, last_status=space.cell_reader("control_status").latest())


@pytest.mark.parametrize(
    ("latched", "before", "source"),
    [
        (None, False, "page"),
        (False, False, "page"),
        (True, False, "page"),
        (True, True, LATCHED_BEFORE),
        (False, True, None),
    ],
)
def test_a_stop_that_no_control_saw_to_its_end_outlives_a_restart(
    tmp_path: Path, latched: bool | None, before: bool, source: str | None
) -> None:
    desk = reopened(tmp_path, latched=latched, before=before)
    desk.listen()
    assert desk.estop_source == source
    assert desk.next_act() is None
    desk.listen()
    assert desk.estop_source is None


def test_events_lost_while_control_was_away_count_as_an_estop(tmp_path: Path) -> None:
    space = SharedSpace(tmp_path, MonotonicClock())
    ask(space.ring_writer("operator"), *["arm"] * 100)
    desk = OperatorInbox(space.ring_reader("operator", from_start=True))
    desk.listen()
    assert desk.estop_source == LOST


def test_a_long_history_that_control_had_seen_is_no_loss(tmp_path: Path) -> None:
    space = SharedSpace(tmp_path, MonotonicClock())
    ask(space.ring_writer("operator"), *["arm"] * 100)
    space.cell_writer("control_status").put_document({"estop_latched": False})
    last = space.cell_reader("control_status").latest()
    desk = OperatorInbox(space.ring_reader("operator", from_start=True), last_status=last)
    ask(space.ring_writer("operator"), "arm")
    desk.listen()
    assert desk.estop_source is None
    assert desk.next_act() is OperatorAct.ARM
