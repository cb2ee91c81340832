"""A robot whose battery runs low says so, refuses other work, goes to charge and charges."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sim_twin.contracts.payloads import payload_faults
from sim_twin.harness.lockstep_stack import LockstepStack
from vla_deploy.ipc import topics
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR

SMALL_WH = 1.5
"""So small that seconds of driving show."""


Drained = Callable[..., LockstepStack]


@pytest.fixture
def drained(make_stack: Callable[..., LockstepStack], coarse: str) -> Drained:
    """Build whole robots, armed, off their dock, with a small pack of that charge."""

    def make(charge_ratio: float, robot: str = "butler") -> LockstepStack:
        stack = make_stack(profile=coarse, robot=robot)
        stack.arm()
        assert stack.say("move forward 0.4 m")["success"]
        pack = stack.lockstep.twin.battery
        assert pack is not None
        pack.capacity_wh, pack.charge_ratio = SMALL_WH, charge_ratio
        return stack

    return make


@pytest.fixture
def goes_by_itself(tmp_path: Path) -> str:
    """A robot whose file lets it go to charge by itself."""
    folder = Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler"))
    text = (folder / ROBOT_FILE).read_text(encoding="utf-8")
    changed = text.replace('at_low = "announce"', 'at_low = "charge"')
    assert changed != text
    (folder / ROBOT_FILE).write_text(changed, encoding="utf-8")
    return str(folder)


def battery(stack: LockstepStack) -> dict[str, Any]:
    return stack.document(topics.BATTERY)


def told(outcome: dict[str, Any]) -> str:
    return str(outcome["actions"][0]["parameters"].get("text", ""))


def test_it_drains_says_so_goes_to_charge_and_the_charge_rises(drained: Drained) -> None:
    stack = drained(0.262)
    said = stack.space.ring_reader(topics.SAY, from_start=True)
    full = battery(stack)["charge_ratio"]
    assert stack.wait_until(lambda: battery(stack)["low"], 30.0)
    assert battery(stack)["charge_ratio"] < full
    stack.pause(1.1)
    assert [one.payload["text"] for one in said.drain() if "text" in one.payload] == [
        "My battery is low."
    ]
    assert "That is low." in told(stack.say("how full is your battery"))
    refused = stack.say("go to the kitchen")
    assert (refused["event"], "the battery is low (" in refused["reason"]) == ("rejected", True)

    went = stack.say("go and charge")
    assert went["success"], went["error"]
    assert [one["skill"] for one in went["actions"]] == ["charge"]
    docked = battery(stack)
    assert docked["is_charging"]
    assert docked["current_a"] > 0.0
    assert stack.wait_until(
        lambda: battery(stack)["charge_ratio"] > docked["charge_ratio"] + 0.02, 10.0
    )
    assert "It is charging." in told(stack.say("are you charging"))
    assert payload_faults(stack.space)["battery"] == []


def doing(stack: LockstepStack) -> str:
    return str(stack.document(topics.EXECUTOR_STATUS).get("skill") or "")


def test_it_goes_by_itself_where_its_file_says_so_but_never_out_of_an_emergency_stop(
    drained: Drained, goes_by_itself: str
) -> None:
    stack = drained(0.2, goes_by_itself)
    stack.operate("estop")
    assert stack.wait_until(lambda: battery(stack)["low"], 10.0)
    assert not stack.wait_until(lambda: doing(stack), 3.0)
    stack.insist("reset")
    assert not stack.wait_until(lambda: doing(stack), 2.0), "it is disarmed"
    stack.insist("arm")
    assert stack.wait_until(lambda: doing(stack) == "charge", 5.0)
    assert stack.wait_until(lambda: battery(stack)["is_charging"], 30.0)


def test_a_nearly_empty_battery_ends_what_goes_on_in_an_orderly_way(drained: Drained) -> None:
    stack = drained(0.095)
    command = stack.give(text="wait 600 seconds and then look around")
    assert stack.wait_until(lambda: doing(stack) == "wait", 5.0)
    assert stack.wait_until(lambda: battery(stack)["critical"], 15.0)
    assert stack.wait_until(lambda: stack.outcome(command) is not None, 5.0)
    ended = stack.outcome(command)
    assert ended is not None
    assert not ended["success"]
    assert stack.state() == "armed", "no stop of safety's was needed"
