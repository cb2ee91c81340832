"""Hold that every source of a stop reaches the latch, with control and shared memory alone."""

import subprocess
import sys
from typing import Any as Rig  # the class in conftest.py, which no test can import

from vla_deploy.ipc.stop_button import StopButton

SOURCES = ("voice", "dashboard", "cli", "button", "ros")
FORBIDDEN = (
    *("vla_deploy.planning", "vla_deploy.skills", "vla_deploy.perception", "vla_deploy.speech"),
    *("vla_deploy.supervisor", "vla_deploy.cli", "onnxruntime", "cv2", "llguidance"),
    *("requests", "urllib.request", "http.server", "zenoh", "aiohttp"),
)


def press(rig: Rig, source: str) -> None:
    StopButton(rig.space, source, rig.lockstep.clock).press("test")


def test_each_source_stops_within_two_ticks_with_only_control_running(armed: Rig) -> None:
    for number, source in enumerate(SOURCES, start=1):
        armed.go(number, left_elbow=2.0 if number % 2 else 1.0)
        armed.run(0.3)
        press(armed, source)
        armed.tick()
        armed.tick()
        assert [(r["motion_id"], r["status"]) for r in armed.results()] == [(number, "stopped")]
        armed.run(0.6)
        assert (armed.status["estop_latched"], armed.status["subject"]) == (True, source)
        assert armed.true_speeds().max() < 0.02
        armed.ask("reset", "arm", within_s=0.4)
        assert armed.state == "armed"


def test_a_source_that_never_stops_pressing_is_not_lost_and_floods_nothing(armed: Rig) -> None:
    button = StopButton(armed.space, "voice", armed.lockstep.clock)
    for _ in range(100):
        button.press()
        armed.tick()
    assert armed.status["estop_latched"]
    armed.run(0.2)
    armed.ask("reset", "arm", within_s=0.4)
    assert armed.state == "armed"
    button.press()
    armed.run(0.1)
    assert armed.status["estop_latched"]


def test_a_latched_stop_outlives_control(armed: Rig) -> None:
    press(armed, "button")
    armed.run(0.5)
    armed.lockstep.kill(armed.control)
    armed.run(0.3)
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    assert armed.status["estop_latched"]
    assert armed.status["subject"] == "latched before control was restarted"
    armed.ask("arm")
    assert armed.state != "armed"
    armed.ask("reset", "arm", within_s=1.5)
    assert armed.state == "armed"


def test_a_press_while_control_is_away_is_not_lost(armed: Rig) -> None:
    armed.lockstep.kill(armed.control)
    armed.run(0.1)
    press(armed, "dashboard")
    armed.ask("arm", within_s=0.1)
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    assert armed.status["estop_latched"]
    assert armed.status["subject"] == "dashboard"


def test_control_imports_nothing_of_planner_models_or_network() -> None:
    probe = (
        "import sys, vla_deploy.control.node\n"
        f"bad = [name for name in {FORBIDDEN!r} if name in sys.modules]\n"
        "assert not bad, bad\n"
    )
    subprocess.run([sys.executable, "-c", probe], check=True, timeout=30)
