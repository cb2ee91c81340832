"""turn_on and turn_off: what was read back decides; a broker that goes and comes is survived."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.home.appliances import ApplianceFault, EmulatedHome
from tests.vla_deploy.skills.conftest import StepClock
from vla_deploy.devices import mqtt_link, open_home
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import load_robot
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NodeContext
from vla_deploy.skills.node import ExecutorNode

LONGEST_S = 120.0


class Butler:
    """The executor beside an emulated home, which can be left; control is the test's to play."""

    def __init__(self, run_dir: Path) -> None:
        self.clock = StepClock()
        self.robot = load_robot("butler")
        self.socket = run_dir / "mqtt"
        self.home: EmulatedHome | None = None
        devices = open_home(self.robot, self.clock, lambda _: InlineExecutor(), self.socket)
        context = NodeContext(
            run_dir=run_dir, robot="butler", profile="desktop", devices_dir=None, clock=self.clock
        )
        self.space = SharedSpace(run_dir / "ipc", self.clock)
        self.node = ExecutorNode(context, self.robot, 20.0, 0.1, devices)
        self.node.start()
        self.events = self.space.ring_reader("task_event", from_start=True)
        self.control = self.space.cell_writer("control_status")
        self.devices = self.space.cell_reader("device_status")
        self.plans = self.space.ring_writer("plan")
        self.said: list[dict[str, Any]] = []

    def begin_home(self) -> EmulatedHome:
        self.home = EmulatedHome(self.robot, self.socket)
        return self.home

    def leave_home(self) -> None:
        if self.home is not None:
            self.home.close()
        self.home = None

    def step(self) -> None:
        self.clock.ns += NS_PER_S // 20
        armed = {"state": "armed", "estop_latched": False, "cause": "", "detail": ""}
        self.control.put_document(armed)
        self.node.step()
        self.said += [event.payload for event in self.events.drain()]

    def give(self, *skills: tuple[str, str]) -> None:
        actions = [
            {"id": f"a{n}", "skill": skill, "parameters": {"device": device}}
            for n, (skill, device) in enumerate(skills)
        ]
        plan = {"goal": "test", "actions": actions}
        self.plans.publish({"command_id": "c1", "plan": plan})

    def finish(self) -> dict[str, Any]:
        end_ns = self.clock.ns + round(LONGEST_S * NS_PER_S)
        while self.clock.ns < end_ns:
            self.step()
            ends = [one for one in self.said if one["event"] == "finished"]
            if ends:
                self.said.clear()
                return ends[-1]
        raise AssertionError(f"it did not end: {self.said}")

    def do(self, *skills: tuple[str, str]) -> dict[str, Any]:
        self.give(*skills)
        return self.finish()

    def status(self) -> dict[str, Any]:
        sample = self.devices.latest()
        assert sample is not None
        return {one["name"]: one for one in sample.document()["devices"]}

    def close(self) -> None:
        self.node.stop()
        self.space.close()
        self.leave_home()


@pytest.fixture
def butler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Butler]:
    monkeypatch.setattr(mqtt_link, "STATE_S", 10.0)  # as a busy computer may take
    butler = Butler(tmp_path)
    yield butler
    butler.close()


def test_devices_are_switched_side_by_side_and_what_is_known_of_them_is_published(
    butler: Butler,
) -> None:
    home = butler.begin_home()
    end = butler.do(("turn_on", "floor lamp"), ("turn_on", "socket"))
    assert end["success"]
    assert [one["note"] for one in end["actions"]] == [
        "lamp is on, as read back",
        "socket is on, as read back",
    ]
    assert home.switched_on == {"lamp", "socket"}
    assert butler.do(("turn_off", "lamp"))["success"]
    assert butler.do(("turn_off", "lamp"))["success"], "it was off already"
    home.appliances["socket"].press()
    for _ in range(100):
        butler.step()
    assert {name: one["is_on"] for name, one in butler.status().items()} == {
        "lamp": False,
        "socket": False,
    }
    assert all(one["age_s"] < 3.0 for one in butler.status().values())


@pytest.mark.parametrize(
    ("fault", "why"),
    [
        (ApplianceFault.STUCK, "tells that it is off after it was switched on"),
        (ApplianceFault.FLIPS_BACK, "tells that it is off"),
        (ApplianceFault.SILENT, r"waited 1 s for its state on home/floor_lamp/state after 'ON'"),
    ],
)
def test_what_was_not_read_back_is_no_success(
    butler: Butler, fault: ApplianceFault, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt_link, "STATE_S", 1.0)
    lamp = butler.begin_home().appliances["lamp"]
    lamp.fault = fault
    end = butler.do(("turn_on", "lamp"))
    assert not end["success"]
    (action,) = end["actions"]
    assert action["status"] == "aborted"
    assert action["retries"] == 1
    assert why in end["error"]
    assert "lamp: floor_lamp on the MQTT broker" in end["error"]


def test_a_broker_that_is_away_at_the_start_hinders_nothing(butler: Butler) -> None:
    for _ in range(20):
        butler.step()
    assert "cannot be reached" in butler.status()["lamp"]["fault"]
    end = butler.do(("turn_on", "lamp"))
    assert not end["success"]
    assert "floor_lamp on the MQTT broker" in end["error"]
    butler.begin_home()
    assert butler.do(("turn_on", "lamp"))["success"]


def test_a_broker_that_goes_in_the_middle_is_named_and_the_action_tried_again(
    butler: Butler,
) -> None:
    home = butler.begin_home()
    assert butler.do(("turn_on", "socket"))["success"]
    home.appliances["lamp"].fault = ApplianceFault.SILENT
    home.broker.on_message("home/floor_lamp/set", lambda _: home.broker.abandon())
    butler.give(("turn_on", "lamp"))
    while not any("trying again" in str(one.get("error")) for one in butler.said):
        butler.step()
    assert "connection ended waiting for its state on home/floor_lamp/state" in str(butler.said)
    butler.leave_home()
    home = butler.begin_home()
    end = butler.finish()
    assert end["success"]
    assert end["actions"][0]["retries"] == 1
    assert home.switched_on == {"lamp"}


def test_an_unknown_device_is_refused_with_those_there_are(butler: Butler) -> None:
    end = butler.do(("turn_on", "radio"))
    assert 'no device "radio" to switch; known: lamp, socket' in end["error"]
