"""The dashboard commands and stops the robot, and the robot does not need the dashboard."""

import json
import tempfile
from collections.abc import Callable, Iterator
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from sim_twin.harness.processes import ProcessStack, armed_processes
from vla_deploy.client.access.local_token import local_headers
from vla_deploy.runtime.net import SETTINGS_FILE
from vla_deploy.runtime.state_dir import config_dir_of

pytestmark = [
    pytest.mark.gl,
    pytest.mark.stack,
    pytest.mark.timeout(300),
]

MOVING_RAD_S = 1.0
STANDSTILL_RAD_S = 0.05


@pytest.fixture(scope="module")
def stack(coarse: str, unused_port: Callable[[], int]) -> Iterator[ProcessStack]:
    """The real processes, armed: each test leaves them so, but for the last."""
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:  # sockets want a short path
        base = Path(folder) / "base"
        settings = config_dir_of(base) / SETTINGS_FILE
        settings.parent.mkdir(parents=True)
        # Of its own: the usual one would be taken by another robot while its dashboard is away.
        settings.write_text(f"port = {unused_port()}\n", encoding="utf-8")
        with armed_processes(base, "--fast", "--profile", coarse) as stack:
            yield stack


class Page:
    """Ask the dashboard of a run as a page does."""

    def __init__(self, stack: ProcessStack) -> None:
        self._stack = stack
        assert stack.wait_until(lambda: stack.document("dashboard_status", 3.0), 60.0)
        self.url = stack.document("dashboard_status")["url"]

    def ask(self, method: str, path: str, body: Any = None) -> Any:
        connection = HTTPConnection(urlsplit(self.url).netloc, timeout=20)
        headers = {"origin": self.url, "content-type": "application/json"}
        headers |= local_headers(self._stack.base)
        content = None if body is None else json.dumps(body)
        connection.request(method, f"/api/v1/{path}", content, headers)
        with connection.getresponse() as answer:
            told = json.load(answer)
        connection.close()
        assert answer.status < 300, told
        return told

    def state(self, command_id: str) -> str:
        return str(self.ask("GET", f"commands/{command_id}")["state"])

    def alarms(self) -> list[str]:
        return [alarm["field"] for alarm in self.ask("GET", "alarms")["alarms"]]

    def drive(self, text: str = "go to the kitchen") -> str:
        command_id: str = self.ask("POST", "commands", {"text": text})["command_id"]
        moves = self._stack.wait_until(lambda: self._stack.fastest_rad_s() > MOVING_RAD_S)
        assert moves, self.ask("GET", f"commands/{command_id}")["events"][-1]
        return command_id


def press_the_door(stack: ProcessStack) -> Any:
    door = stack.document("stop_door_status")
    connection = HTTPConnection(door["host"], door["port"], timeout=5)
    connection.request("POST", "/stop")
    with connection.getresponse() as answer:
        told = json.load(answer)
    connection.close()
    return told


def stands(stack: ProcessStack) -> bool:
    return stack.wait_until(lambda: stack.fastest_rad_s() < STANDSTILL_RAD_S, 3.0)


def test_the_robot_drives_on_without_it_and_its_history_is_found_again(
    stack: ProcessStack,
) -> None:
    page = Page(stack)
    ended_id = page.ask("POST", "commands", {"text": "bring me the moon"})["command_id"]
    assert stack.wait_until(lambda: page.state(ended_id) == "rejected")
    # No longer than it takes: a busy computer loses a servo for a moment about once a minute.
    pid = stack.row("dashboard")["pid"]
    command_id = page.drive("turn left 180 degrees")
    stack.kill("dashboard")
    assert stack.wait_until(lambda: stack.fastest_rad_s() > MOVING_RAD_S, 2.0)
    assert stack.is_back("dashboard", pid)
    assert Page(stack).url == page.url
    is_done = stack.wait_until(lambda: page.state(command_id) == "succeeded", 60.0)
    assert is_done, page.ask("GET", f"commands/{command_id}")["events"][-1]
    assert page.state(ended_id) == "rejected"


def test_it_commands_the_robot_and_stops_it(stack: ProcessStack) -> None:
    page = Page(stack)
    stopped_id = page.drive()
    assert page.ask("POST", "stop", {"reason": "test"}) == {"pressed": True}
    assert stands(stack), stack.truth()
    assert stack.wait_until(lambda: stack.state() == "stopped", 3.0)
    control = page.ask("GET", "state")["control"]
    assert (control["estop_latched"], control["cause"]) == (True, "estop")
    assert stack.wait_until(lambda: page.state(stopped_id) == "failed")
    assert page.ask("POST", "reset", {})["control"]["state"] == "disarmed"
    assert page.ask("POST", "arm", {})["control"]["state"] == "armed"


def test_the_stop_door_stops_the_robot_while_it_hangs(stack: ProcessStack) -> None:
    page = Page(stack)
    page.drive()
    stack.freeze("dashboard")
    assert press_the_door(stack)["pressed"] is True
    assert stands(stack), stack.truth()
    assert press_the_door(stack)["control"]["estop_latched"] is True
    stack.thaw("dashboard")
    assert stack.wait_until(lambda: "estop" in page.alarms(), 10.0)
