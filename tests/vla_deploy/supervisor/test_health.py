from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.health import Health

RATE_HZ = 250.0


class Control:
    """Play a control that writes its status, and let time pass meanwhile."""

    def __init__(self, directory: Path) -> None:
        self.clock = ManualClock(NS_PER_S)
        space = SharedSpace(directory, self.clock)
        self.cell = space.cell_writer("control_status")
        self.health = Health(space, self.clock, lambda: RATE_HZ)
        self.status = {
            "tick": 0,
            "judged_tick": 0,
            "late_ticks": 0,
            "estop_latched": False,
            "buses": {"servos": {"budget": {"bus": "ok", "lost": []}}, "can": {"lost_nodes": 0}},
        }

    def work(self, seconds: float, rate_hz: float = RATE_HZ, late_ratio: float = 0.0):
        """Tick for a while, 20 looks a second, and return the last troubles."""
        for _ in range(round(seconds * 20)):
            self.clock.ns += NS_PER_S // 20
            self.status["tick"] += round(rate_hz / 20)
            self.status["judged_tick"] = self.status["tick"]
            self.status["late_ticks"] += round(late_ratio * rate_hz / 20)
            self.cell.put_document(self.status)
            troubles = self.health.troubles()
        return troubles

    def look(self):
        self.cell.put_document(self.status)
        return self.health.troubles()


@pytest.fixture
def control(tmp_path) -> Control:
    return Control(tmp_path / "ipc")


def test_a_control_that_has_never_spoken_is_in_trouble(control):
    assert control.health.troubles() == ("control: has not told its status yet",)


def test_a_control_in_time_is_in_no_trouble(control):
    assert control.work(10.0) == ()


def test_a_silent_control_is_told_with_age_and_limit(control):
    control.work(3.0)
    for _ in range(20):
        control.clock.ns += NS_PER_S // 20
        troubles = control.health.troubles()
    assert not any("age" in trouble for trouble in troubles)
    control.clock.ns += NS_PER_S // 20
    assert control.health.troubles() == ("control: control_status: age 1.05 s, limit 1 s",)


def test_too_slow_a_control_is_told_with_its_tick_rate(control):
    control.work(3.0)
    assert control.work(3.0, rate_hz=140.0) == ()
    assert control.work(3.0, rate_hz=100.0) == ("control: tick rate 100 Hz, limit 125 Hz",)
    assert control.work(3.0) == ()


def test_too_many_late_ticks_are_told(control):
    assert control.work(3.0, rate_hz=200.0, late_ratio=0.5) == ()
    assert control.work(3.0, rate_hz=200.0, late_ratio=0.6) == (
        "control: late ticks 60%, limit 50%",
    )


def test_ticks_that_safety_has_not_judged_are_told(control):
    control.work(3.0)
    control.status["judged_tick"] = control.status["tick"] - 2
    assert control.look() == ()
    control.status["judged_tick"] -= 1
    assert control.look() == ("safety: the last 3 ticks were not judged, limit 2",)


@pytest.mark.parametrize(
    ("bus", "counters", "words"),
    [
        ("servos", {}, "not open"),
        ("servos", {"budget": {"bus": "lost", "lost": []}}, "too many answers missing or damaged"),
        ("servos", {"budget": {"bus": "ok", "lost": ["head_pan"]}}, "lost head_pan"),
        ("can", {"lost_nodes": 2}, "lost 2 nodes"),
    ],
)
def test_a_lost_bus_is_told_by_name(control, bus, counters, words):
    control.work(3.0)
    control.status["buses"][bus] = counters
    assert control.look() == (f"bus {bus}: {words}",)


def test_a_bus_that_the_emergency_stop_may_have_made_dark_is_no_trouble(control):
    control.work(3.0)
    control.status["buses"]["servos"] = {}
    control.status["estop_latched"] = True
    assert control.look() == ()


def test_a_supervisor_that_was_held_up_tells_so_once(control):
    control.work(3.0)
    control.clock.ns += 3 * NS_PER_S
    assert "supervisor: held up for 3.0 s, limit 2 s" in control.look()
    assert not any("held up" in trouble for trouble in control.look())


def test_a_new_instance_of_control_is_not_measured_by_the_ticks_of_the_old(control, monkeypatch):
    control.work(3.0)
    control.status["tick"] = control.status["judged_tick"] = 1
    writer = control.health._history[-1]
    assert writer.tick > 1
    control.health._history[-1] = type(writer)(
        now_ns=writer.now_ns, pid=writer.pid + 1, tick=writer.tick, late_ticks=0
    )
    assert control.look() == ()
