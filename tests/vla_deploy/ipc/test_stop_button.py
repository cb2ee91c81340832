"""Hold that a press reaches control's latch with nothing but shared memory, however often."""

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.control.modes.operator_acts import OperatorAct, OperatorInbox
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.stop_button import StopButton

FORBIDDEN = (
    *("vla_deploy.planning", "vla_deploy.skills", "vla_deploy.perception", "vla_deploy.navigation"),
    *("vla_deploy.supervisor", "vla_deploy.cli", "onnxruntime", "cv2", "socketserver", "http"),
    *("pinocchio", "requests", "urllib.request", "zenoh"),
)


class StepClock:
    """Stand still until a test moves it on."""

    def __init__(self, now_ns: int) -> None:
        self._now_ns = now_ns

    def now_ns(self) -> int:
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self._now_ns = max(self._now_ns, deadline_ns)

    def advance(self, step_ns: int) -> None:
        self._now_ns += step_ns


@pytest.fixture
def clock() -> StepClock:
    return StepClock(NS_PER_S)


@pytest.fixture
def space(tmp_path: Path, clock: StepClock) -> SharedSpace:
    return SharedSpace(tmp_path, clock)


def acts(space: SharedSpace) -> list[tuple[str, str, str]]:
    ring = space.ring_reader("operator", from_start=True)
    return [
        (one.payload["act"], one.payload["source"], one.payload["reason"]) for one in ring.drain()
    ]


def test_a_press_is_one_event_that_names_its_source(space: SharedSpace, clock: StepClock) -> None:
    assert StopButton(space, "voice", clock).press("stop!")
    assert acts(space) == [("estop", "voice", "stop!")]


def test_a_source_that_repeats_itself_does_not_flood_the_ring(
    space: SharedSpace, clock: StepClock
) -> None:
    button = StopButton(space, "page", clock)
    for _ in range(1000):
        button.press()
        clock.advance(NS_PER_S // 1000)
    assert 9 <= len(acts(space)) <= 11


def test_sources_share_one_press(space: SharedSpace, clock: StepClock) -> None:
    assert StopButton(space, "voice", clock).press()
    assert not StopButton(space, "page", clock).press()
    assert len(acts(space)) == 1


def test_a_press_waits_for_no_writer_that_is_frozen_in_the_middle(
    space: SharedSpace, clock: StepClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    frozen, press = space.ring_writer("operator"), StopButton(space, "page", clock).press
    desk = OperatorInbox(space.ring_reader("operator", from_start=False))
    go_on = frozen._slots.write

    def freeze(*slot: Any) -> None:
        began_ns = clock.now_ns()
        assert press()
        assert clock.now_ns() - began_ns < NS_PER_S // 50
        desk.listen()
        assert desk.estop_source is not None
        go_on(*slot)

    monkeypatch.setattr(frozen._slots, "write", freeze)
    frozen.publish({"act": "arm", "source": "cli", "reason": ""})
    space.ring_writer("operator").publish({"act": "reset", "source": "cli", "reason": ""})
    desk.listen()
    assert desk.next_act() is OperatorAct.RESET


def test_a_writer_that_is_frozen_as_it_tells_of_its_event_does_not_take_the_press_back(
    space: SharedSpace, clock: StepClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    press = StopButton(space, "page", clock).press
    desk = OperatorInbox(space.ring_reader("operator", from_start=False))
    newest, tell = Segment.newest, Segment.newest.fset
    assert tell is not None

    def freeze(segment: Segment, sequence: int) -> None:
        monkeypatch.setattr(Segment, "newest", newest)
        assert press()
        tell(segment, sequence)

    monkeypatch.setattr(Segment, "newest", property(newest.fget, freeze))
    space.ring_writer("operator").publish({"act": "arm", "source": "cli", "reason": ""})
    desk.listen()
    assert desk.estop_source is not None
    assert desk.next_act() is None


@pytest.mark.parametrize("passing", [1, 7, 8, 20])
def test_a_press_that_is_frozen_itself_counts_though_others_went_on(
    space: SharedSpace, clock: StepClock, monkeypatch: pytest.MonkeyPatch, passing: int
) -> None:
    button, other = StopButton(space, "page", clock), space.ring_writer("operator")
    desk = OperatorInbox(space.ring_reader("operator", from_start=False))
    go_on = button._out._slots.write
    other_writes = ExitStack()

    def freeze(*slot: Any) -> None:
        monkeypatch.setattr(button._out._slots, "write", go_on)
        other_writes.close()
        for _ in range(passing):
            other.publish({"act": "disarm", "source": "cli", "reason": ""})
        desk.listen()
        assert desk.estop_source is None
        go_on(*slot)

    monkeypatch.setattr(button._out._slots, "write", freeze)
    other_writes.enter_context(other._segment.locked())
    assert button.press()
    desk.listen()
    assert desk.estop_source is not None


def test_a_writer_of_a_ring_that_is_there_is_held_up_by_nobody_else(space: SharedSpace) -> None:
    with space.ring_writer("operator")._segment.locked():
        assert space.ring_writer("operator") is not None


@pytest.mark.parametrize("act", ["reset", "arm", "disarm"])
def test_a_press_right_after_another_act_counts(
    space: SharedSpace, clock: StepClock, act: str
) -> None:
    button = StopButton(space, "page", clock)
    button.press()
    space.ring_writer("operator").publish({"act": act, "source": "cli", "reason": ""})
    assert button.press()
    assert [told[0] for told in acts(space)] == ["estop", act, "estop"]


def test_a_press_counts_again_after_a_tenth_of_a_second(
    space: SharedSpace, clock: StepClock
) -> None:
    button = StopButton(space, "page", clock)
    button.press()
    clock.advance(NS_PER_S // 10 - 1)
    assert not button.press()
    clock.advance(1)
    assert button.press()


def test_words_of_any_length_fit_the_ring(space: SharedSpace, clock: StepClock) -> None:
    assert StopButton(space, "s" * 5000, clock).press("\u00e4" * 5000)
    assert len(acts(space)) == 1


def test_a_closed_button_leaves_its_press(space: SharedSpace, clock: StepClock) -> None:
    button = StopButton(space, "page", clock)
    button.press()
    button.close()
    assert len(acts(space)) == 1


def test_it_measures_time_by_itself_where_nobody_gives_it_a_clock(space: SharedSpace) -> None:
    assert StopButton(space, "page").press()


def test_the_button_imports_nothing_of_planner_models_or_network() -> None:
    probe = (
        "import sys, vla_deploy.ipc.stop_button\n"
        f"bad = [name for name in {FORBIDDEN!r} if name in sys.modules]\n"
        "assert not bad, bad\n"
    )
    subprocess.run([sys.executable, "-c", probe], check=True, timeout=30)
