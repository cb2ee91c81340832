"""The home's broker and devices fail as the table says, and leave nothing behind."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_twin.errors import FaultRefused
from sim_twin.harness.lockstep import Lockstep
from vla_deploy.devices import DeviceError, DeviceReading, mqtt_link, transport_of
from vla_deploy.devices.transport import SwitchTransport


@pytest.fixture
def lamp(
    lockstep: Lockstep, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[SwitchTransport]:
    """The lamp of the twin's home, as the robot reaches it."""
    monkeypatch.setattr(mqtt_link, "STATE_S", 10.0)  # as a busy computer may take
    broker = tmp_path / "mqtt"
    lockstep.twin.begin_home(broker)
    link = transport_of(lockstep.robot, lockstep.robot.devices["lamp"], broker)
    yield link
    link.close()


@pytest.mark.parametrize(
    ("component", "instance", "fault", "told"),
    [
        ("broker", None, "off", "connection ended"),
        ("home_device", "lamp", "off", "waited 1 s"),
        ("home_device", "lamp", "stuck", False),
        ("home_device", "lamp", "wrong", False),
    ],
)
def test_what_fails_is_noticed_and_comes_back(
    lockstep: Lockstep,
    lamp: SwitchTransport,
    component: str,
    instance: str | None,
    fault: str,
    told: str | bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert not lamp.read().is_on
    handle = lockstep.faults.inject(component, instance, fault)
    with monkeypatch.context() as impatient:
        impatient.setattr(mqtt_link, "STATE_S", 1.0)
        _expect(lamp, told)
    handle.clear()
    assert lamp.switch(True) == DeviceReading(is_on=True)
    assert lockstep.twin.switched_on == ("lamp",)


def _expect(lamp: SwitchTransport, told: str | bool) -> None:
    if isinstance(told, str):
        with pytest.raises(DeviceError, match=told):
            lamp.switch(True)
    else:
        lamp.switch(True)
        assert lamp.read().is_on is told


def test_without_a_home_nothing_of_it_fails(lockstep: Lockstep) -> None:
    with pytest.raises(FaultRefused, match="begin_home"):
        lockstep.faults.inject("broker", None, "off")
    with pytest.raises(FaultRefused, match=r"expected a name or an id of lamp \(1\), socket \(2\)"):
        lockstep.faults.inject("home_device", "oven", "off")
