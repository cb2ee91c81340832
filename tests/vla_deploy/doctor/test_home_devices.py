"""The doctor asks each device of the home; the stack runs without them."""

from dataclasses import replace
from pathlib import Path

from sim_twin.home.appliances import EmulatedHome
from vla_deploy.doctor import home_devices
from vla_deploy.doctor.finding import FindingLevel
from vla_deploy.robots.home_devices import MqttBroker


def test_a_device_that_answers_is_well_and_one_that_is_away_a_warning(
    computer, tmp_path: Path
) -> None:
    context = computer.context(robot="butler")
    nobody = MqttBroker(host="127.0.0.1", port=1)
    context = replace(context, robot=replace(context.robot, broker=nobody))
    levels = {one.name: one.level for one in home_devices.reachable(context)}
    assert levels == {"lamp": FindingLevel.WARN, "socket": FindingLevel.WARN}
    emulated = EmulatedHome(context.robot, tmp_path / "mqtt")
    # A port of 0 means the path of a socket, as the twin has it.
    there = MqttBroker(host=str(tmp_path / "mqtt"), port=0)
    context = replace(context, robot=replace(context.robot, broker=there))
    found = list(home_devices.reachable(context))
    assert [one.level for one in found] == [FindingLevel.OK, FindingLevel.OK]
    assert found[0].measured.startswith("off, floor_lamp on the MQTT broker")
    emulated.close()


def test_without_a_robot_nothing_is_asked(computer) -> None:
    assert not list(home_devices.reachable(computer.context()))
