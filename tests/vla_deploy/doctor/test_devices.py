import grp
import json
import os
import shutil
from dataclasses import replace
from typing import Any

import pytest

from platforms import load_profile
from vla_deploy.doctor import DoctorContext, FindingLevel
from vla_deploy.doctor.devices import (
    camera_calibration,
    can_link,
    device_files,
    latency_timers,
    sound,
    spoken_stop,
)
from vla_deploy.inference.store import EMBEDDED, ModelStore
from vla_deploy.robots import load_robot
from vla_deploy.robots.camera import CameraMounting, LensCalibration

SERVOS = load_robot("butler").servo_bus.path
TIMER = "/sys/bus/usb-serial/devices/ttyUSB0/latency_timer"


def test_without_a_robot_its_devices_are_not_judged(computer) -> None:
    (finding,) = device_files(computer.context())
    assert (finding.level, finding.remedy) == (
        FindingLevel.MISSING,
        "vla-deploy doctor --robot butler",
    )
    assert list(can_link(computer.context())) == []


def test_a_device_that_is_there_is_fine_and_others_fail(computer) -> None:
    computer.write(SERVOS)
    levels = {one.name: one.level for one in device_files(computer.context(robot="butler"))}
    assert levels.pop("servos") is FindingLevel.OK
    assert levels
    assert set(levels.values()) == {FindingLevel.FAIL}


def in_group(name: str) -> Any:
    """Return what tells that every file is of a group; only root may give a file to another."""
    return lambda _number: grp.struct_group((name, "x", 1, []))


def test_a_device_that_we_may_not_open_names_its_group(computer, monkeypatch) -> None:
    computer.write(SERVOS)
    monkeypatch.setattr(grp, "getgrgid", in_group("root"))

    def only_there(path: Any, mode: int, *, effective_ids: bool) -> bool:
        return effective_ids and mode == os.F_OK

    monkeypatch.setattr(os, "access", only_there)
    findings = {one.name: one for one in device_files(computer.context(robot="butler"))}
    assert findings["servos"].level is FindingLevel.FAIL
    assert findings["servos"].remedy.startswith("sudo usermod -aG dialout $USER")
    assert findings["estop"].remedy.startswith("sudo usermod -aG input $USER")


@pytest.mark.parametrize(
    ("text", "level"),
    [
        ("1\n", FindingLevel.OK),
        ("2\n", FindingLevel.WARN),
        ("16\n", FindingLevel.FAIL),
        ("soon\n", FindingLevel.MISSING),
    ],
)
def test_the_latency_timer_is_judged_by_the_control_period(computer, text, level) -> None:
    computer.write(TIMER, text)
    (finding,) = latency_timers(computer.context())
    assert finding.level is level
    if level in (FindingLevel.WARN, FindingLevel.FAIL):
        assert finding.remedy == f"echo 1 | sudo tee {TIMER}"


def test_the_group_of_the_device_file_itself_is_named(computer, monkeypatch) -> None:
    computer.write(SERVOS)
    monkeypatch.setattr(grp, "getgrgid", in_group("daemon"))
    monkeypatch.setattr(os, "access", lambda path, mode, *, effective_ids: mode == os.F_OK)
    findings = {one.name: one for one in device_files(computer.context(robot="butler"))}
    assert "usermod -aG daemon" in findings["servos"].remedy


def test_an_adapter_without_latency_timer_is_passed_over(computer) -> None:
    computer.write("/sys/bus/usb-serial/devices/ttyUSB0/port_number", "0")
    assert list(latency_timers(computer.context())) == []


def link(**changes: Any) -> str:
    data = {"state": "ERROR-ACTIVE", "bittiming": {"bitrate": 1_000_000}} | changes
    row = {
        "ifname": "can0",
        "flags": ["NOARP", "UP", "LOWER_UP"],
        "linkinfo": {"info_kind": changes.pop("kind", "can"), "info_data": data},
    }
    return json.dumps([row])


@pytest.mark.parametrize(
    ("answer", "level", "words"),
    [
        (link(), FindingLevel.OK, "ERROR-ACTIVE at 1000000 bit/s"),
        (link(kind="vcan"), FindingLevel.OK, "virtual"),
        (link(bittiming={"bitrate": 500_000}), FindingLevel.FAIL, "500000 bit/s, expected 1000000"),
        (link(state="ERROR-PASSIVE"), FindingLevel.WARN, "ERROR-PASSIVE"),
        (link(state="BUS-OFF"), FindingLevel.WARN, "BUS-OFF"),
        (link().replace('"UP", ', ""), FindingLevel.FAIL, "can0 is down"),
        ("[]", FindingLevel.MISSING, "tells nothing of can0"),
        ("[{}]", FindingLevel.MISSING, "tells nothing of can0"),
        ("[[]]", FindingLevel.MISSING, "tells nothing of can0"),
        ("not json", FindingLevel.MISSING, "tells nothing of can0"),
        ('[{"linkinfo": [], "flags": 3}]', FindingLevel.MISSING, "tells nothing of can0"),
    ],
)
def test_the_can_link_is_judged_by_state_and_bit_rate(computer, answer, level, words) -> None:
    computer.write("/sys/class/net/can0/flags", "0x1")
    computer.answers["ip"] = answer
    (finding,) = can_link(computer.context(robot="butler"))
    assert finding.level is level
    assert words in finding.measured
    if level in (FindingLevel.WARN, FindingLevel.FAIL):
        assert "ip link set can0 up type can bitrate 1000000" in finding.remedy


def test_a_can_link_that_is_not_there_fails(computer) -> None:
    (finding,) = can_link(computer.context(robot="butler"))
    assert (finding.level, finding.measured) == (FindingLevel.FAIL, "there is no link can0")
    assert finding.remedy == "ip -details link   # is it plugged in?"


def test_sound_cards_are_found_by_their_name(computer) -> None:
    computer.write("/proc/asound/cards", " 1 [Array]: USB-Audio - ReSpeaker 4 Mic Array\n")
    levels = {one.name: one.level for one in sound(computer.context(robot="butler"))}
    assert levels == {"microphone": FindingLevel.OK, "speaker": FindingLevel.WARN}


def test_a_camera_that_was_never_measured_is_told_with_the_command(computer) -> None:
    findings = list(camera_calibration(computer.context(robot="butler")))
    assert [one.level for one in findings] == [FindingLevel.WARN, FindingLevel.WARN]
    assert [one.remedy.split()[2] for one in findings] == ["calibrate", "hand-eye"]
    assert list(camera_calibration(computer.context())) == []


def test_a_measured_camera_is_told_with_date_and_error(computer) -> None:
    robot = load_robot("butler")
    lens = LensCalibration(
        intrinsics=robot.camera.intrinsics,
        distortion_model="plumb_bob",
        reprojection_error_px=0.213,
        views=12,
        made_at="2026-11-22",
        tool="",
    )
    mounting = CameraMounting(
        site=robot.camera.site,
        model=robot.camera.model,
        focal_px=robot.camera.focal_px,
        translation_m=(0.003, 0.0, 0.004),
        quaternion_xyzw=(0.0, 0.0, 0.0, 1.0),
        residual_m=0.001,
        made_at="2026-11-22",
    )
    camera = replace(robot.camera, lens=lens, mounting=mounting)
    context = replace(
        computer.context(), robot=replace(robot, parts=replace(robot.parts, camera=camera))
    )
    first, second = camera_calibration(context)
    assert (first.level, second.level) == (FindingLevel.OK, FindingLevel.OK)
    assert "2026-11-22" in first.measured
    assert "0.21 px" in first.measured
    assert "5.0 mm" in second.measured


def with_stop_words(context: DoctorContext, sensitivity: str) -> DoctorContext:
    profile = load_profile("desktop")
    speech = replace(profile.speech, stop_words=sensitivity)
    profile = replace(profile, speech=speech)
    store = ModelStore(context.models.user, system=context.models.user.parent / "system")
    return replace(context, profile=profile, models=store)


def test_the_shipped_model_is_opened_and_its_words_are_told(computer) -> None:
    (finding,) = spoken_stop(with_stop_words(computer.context(robot="butler"), "normal"))
    assert finding.level is FindingLevel.OK
    assert finding.measured.startswith("stop, halt, freeze; sensitivity normal, from 0.")


def test_a_model_that_root_has_added_is_found(computer) -> None:
    context = with_stop_words(computer.context(robot="butler"), "normal")
    assert context.profile is not None
    folder = computer.root / "system" / "louder"
    shutil.copytree(EMBEDDED / "stop_words", folder)
    manifest = folder / "model.toml"
    manifest.write_text(manifest.read_text().replace("stop_words", "louder", 1))
    choice = replace(context.profile.models["key_words"], tiers=("louder",))
    profile = replace(context.profile, models={"key_words": choice})
    (finding,) = spoken_stop(replace(context, profile=profile))
    assert finding.level is FindingLevel.OK


def test_switched_off_is_a_warning_that_says_how_to_switch_it_on(computer) -> None:
    (finding,) = spoken_stop(with_stop_words(computer.context(robot="butler"), "off"))
    assert finding.level is FindingLevel.WARN
    assert "nobody can stop the robot by voice" in finding.measured
    assert "speech.stop_words" in finding.remedy


def test_without_a_model_it_is_a_warning(computer) -> None:
    context = with_stop_words(computer.context(robot="butler"), "normal")
    assert context.profile is not None
    bare = replace(context, profile=replace(context.profile, models={}))
    (finding,) = spoken_stop(bare)
    assert finding.level is FindingLevel.WARN
    assert "[models.key_words]" in finding.measured


def test_a_robot_without_a_microphone_says_so(computer) -> None:
    context = with_stop_words(computer.context(robot="butler"), "normal")
    assert context.robot is not None
    deaf = replace(context, robot=replace(context.robot, microphone=None))
    (finding,) = spoken_stop(deaf)
    assert (finding.level, finding.name) == (FindingLevel.MISSING, "spoken stop")
