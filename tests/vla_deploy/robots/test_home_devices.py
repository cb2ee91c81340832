"""Devices of the home in a robot file: every fault is named, and what is right is read."""

import shutil
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.home_devices import DeviceKind, GpioLine
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR

MQTT = 'mqtt = { command_topic = "a/set", state_topic = "a/state" }'
FAN = f'[[devices]]\nname = "fan"\nkind = "fan"\n{MQTT}\n'


def robot_with(folder: Path, devices: str) -> Path:
    shutil.copytree(ROBOTS_DIR / "butler", folder)
    file = folder / ROBOT_FILE
    file.write_text(f"{file.read_text(encoding='utf-8')}\n{devices}\n", encoding="utf-8")
    return folder


def device(*rows: str) -> str:
    return "\n".join(["[[devices]]", 'name = "fan"', 'kind = "fan"', *rows])


@pytest.mark.parametrize(
    ("devices", "fault"),
    [
        (FAN + FAN, r"devices\[3\]: got 'fan', expected a value not used by devices\[2\]"),
        (FAN.replace('"fan"\nkind', '"lamp"\nkind'), r"devices\[2\]: got 'lamp'"),
        (FAN + 'aliases = ["Floor lamp"]', r"devices\[2\]: got 'floor lamp'"),
        (FAN + 'place = "moon"', r"devices\[2\]\.place: got 'moon', expected a place"),
        (FAN.replace('= "fan"\nm', '= "oven"\nm'), r"kind: got 'oven', expected one of lamp"),
        (FAN.replace('name = "fan"', 'name = "a fan"'), r"devices\[2\]\.name: got 'a fan'"),
        (FAN + 'zigbee = "x"', r"devices\[2\]\.zigbee: got an unknown key"),
        (device(), r"devices\[2\]: got none, expected exactly one transport: mqtt, http, gpio"),
        (device(MQTT, 'gpio = { chip = "c", line = 1 }'), "got mqtt and gpio"),
        (device('mqtt = { command_topic = "a" }'), "got command_topic, expected discovery, or"),
        (device("mqtt = { }"), "got neither, expected discovery, or"),
        (device('mqtt = { discovery = "a", state_topic = "b" }'), "nothing beside discovery"),
        (device('mqtt = { discovery = "a/#" }'), "expected a discovery id"),
        (device(MQTT.replace("a/set", "a/+/set")), "expected one topic, without"),
        (device(MQTT.replace("a/set", "a/\\u0007")), "expected one topic, without"),
        (device('http = { on = "ftp://a/", off = "http://a", state = "http://a" }'), "http.on"),
        (
            device('http = { on = "http://a:b@c/", off = "http://c", state = "http://c" }'),
            "no user or password in it",
        ),
        (device('gpio = { chip = "/dev/gpiochip0", line = -1 }'), "gpio.line: got -1"),
    ],
)
def test_every_fault_is_named(tmp_path: Path, devices: str, fault: str) -> None:
    with pytest.raises(RobotFileError, match=fault) as refused:
        load_robot(robot_with(tmp_path / "robot", devices))
    assert "a:b@c" not in str(refused.value)


def test_a_device_on_mqtt_needs_a_broker(tmp_path: Path) -> None:
    folder = robot_with(tmp_path / "robot", "")
    file = folder / ROBOT_FILE
    whole = file.read_text(encoding="utf-8")
    file.write_text(whole.replace('[mqtt]\nhost = "homeassistant.local"\n', ""), encoding="utf-8")
    with pytest.raises(RobotFileError, match=r"mqtt: got nothing, expected a broker"):
        load_robot(folder)


def test_each_transport_is_read_and_files_lie_beside_the_robot_file(tmp_path: Path) -> None:
    url = 'on = "http://plug/on", off = "http://plug/off", state = "http://plug/"'
    rows = (
        device(f'http = {{ {url}, pointer = "/ison", credentials = "plug.toml" }}'),
        device('gpio = { chip = "/dev/gpiochip0", line = 7, active_low = true }').replace(
            '"fan"', '"switch"'
        ),
    )
    robot = load_robot(robot_with(tmp_path / "robot", "\n".join(rows)))
    fan, switch = robot.devices["fan"], robot.devices["switch"]
    assert fan.kind is DeviceKind.FAN
    assert fan.http is not None
    assert fan.http.credentials == tmp_path / "robot" / "plug.toml"
    assert switch.gpio == GpioLine(chip="/dev/gpiochip0", line=7, active_low=True)
