"""Check the robot's devices: presence, rights, supplies, set-up, calibration, the spoken stop."""

import grp
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, missing, ok, trouble, warn
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.camera import CameraMounting, LensCalibration
from vla_deploy.runtime.one_line import one_line
from vla_deploy.runtime.state_dir import engines_dir_of
from vla_deploy.speech.stop_words.listener import OFF
from vla_deploy.speech.stop_words.spotter import open_spotter
from vla_deploy.supervisor.runs.runtime import default_base

LATENCY_MS: Final = 1
_NAME_ONE: Final = "vla-deploy doctor --robot butler"
_OS_ACCESS: Final = os.R_OK | os.W_OK
_GOOD_CAN_STATES: Final = frozenset({"ERROR-ACTIVE"})


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceNode:
    """Name one device file of a robot, its group, and the access that its driver needs."""

    name: str
    path: str
    group: str
    access: int = _OS_ACCESS


_GROUPS: Mapping[str, str] = {
    "servo_bus": "dialout",
    "lidar": "dialout",
    "imu": "dialout",
    "camera": "video",
    "estop": "input",
    "power_relay": "gpio",
    "microphone": "audio",
    "speaker": "audio",
}
_READ_ONLY: Final = frozenset({"estop"})


def device_files(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that each device file of the robot is there and open to us."""
    if context.robot is None:
        yield missing("devices", "no robot was named", _NAME_ONE)
        return
    for node in _nodes(context.robot):
        yield _judged(context, node)


def _nodes(robot: RobotDescription) -> Iterator[DeviceNode]:
    for attribute, group in _GROUPS.items():
        owner = robot.parts if hasattr(robot.parts, attribute) else robot
        device = getattr(owner, attribute)
        if device is not None and device.path.startswith("/"):
            access = os.R_OK if attribute in _READ_ONLY else _OS_ACCESS
            yield DeviceNode(name=device.device, path=device.path, group=group, access=access)


def _judged(context: DoctorContext, node: DeviceNode) -> DoctorFinding:
    path = context.tree.root / node.path.lstrip("/")
    folder, _, file = node.path.rpartition("/")
    if not os.access(path, os.F_OK, effective_ids=True):
        there = [name for name in context.tree.names(folder) if name.startswith("usb-")]
        instead = f"; there is {', '.join(there)}" if there else ""
        remedy = f"ls -l {folder}   # is it plugged in?"
        return fail(node.name, f"there is no {file}{instead}", remedy)
    if not os.access(path, node.access, effective_ids=True):
        remedy = f"sudo usermod -aG {_group(path, node.group)} $USER   # then log in anew"
        return fail(node.name, f"no right to open {file}", remedy)
    return ok(node.name, file)


def _group(path: Path, usual: str) -> str:
    """Return the group that the device file has, or the usual one where that is root's."""
    try:
        owner = grp.getgrgid(path.stat().st_gid).gr_name
    except (OSError, KeyError):
        return usual
    return usual if owner == "root" else owner


def latency_timers(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check how long FTDI adapters wait for more bytes before they hand over what they have."""
    folder = "/sys/bus/usb-serial/devices"
    for port in context.tree.names(folder):
        path = f"{folder}/{port}/latency_timer"
        if not context.tree.exists(path):
            continue
        name = f"{port} latency"
        try:
            wait_ms = context.tree.number(path)
        except ValueMissing as gone:
            yield missing(name, str(gone))
            continue
        judge = ok(name, f"{wait_ms:g} ms")
        if wait_ms > LATENCY_MS:
            judge = _late_adapter(context, name, wait_ms, path)
        yield judge


def _late_adapter(context: DoctorContext, name: str, wait_ms: float, path: str) -> DoctorFinding:
    rate_hz = context.profile.control_rate_hz if context.profile else 250.0
    measured = f"{wait_ms:g} ms, expected {LATENCY_MS} ms at {rate_hz:g} Hz"
    remedy = f"echo {LATENCY_MS} | sudo tee {path}"
    return trouble(name, measured, remedy, fatal=wait_ms >= 1000 / rate_hz)


def can_link(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the wheel drives' CAN link is up, in good health, and has the right bit rate."""
    if context.robot is None or context.robot.parts.can_bus is None:
        return
    name, bitrate = context.robot.can_bus.path, context.robot.can_bus.bitrate
    up = f"sudo ip link set {name} up type can bitrate {bitrate} restart-ms 100"
    if "/" in name or ":" in name:
        yield missing("CAN link", f"{name} is no network link; its driver opens it")
    elif not context.tree.exists(f"/sys/class/net/{name}"):
        driver = "sudo modprobe mttcan; ip link" if context.board.l4t else "ip -details link"
        yield fail("CAN link", f"there is no link {name}", f"{driver}   # is it plugged in?")
    else:
        yield _link(context, name, bitrate, up)


def _link(context: DoctorContext, name: str, bitrate: int, up: str) -> DoctorFinding:
    try:
        link = json.loads(context.ask(("ip", "-details", "-json", "link", "show", name)))[0]
        data: dict[str, Any] = link["linkinfo"].get("info_data", {})
        flags, kind = link["flags"], link["linkinfo"]["info_kind"]
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        return missing("CAN link", f"`ip` tells nothing of {name}: {error}")
    if "UP" not in flags:
        return fail("CAN link", f"{name} is down", up)
    if kind == "vcan":
        return ok("CAN link", f"{name} is up (virtual)")
    state, found = data.get("state"), data.get("bittiming", {}).get("bitrate")
    if found != bitrate:
        measured = f"{name} runs at {found} bit/s, expected {bitrate}"
        return fail("CAN link", measured, f"sudo ip link set {name} down; {up}")
    if state not in _GOOD_CAN_STATES:
        return warn("CAN link", f"{name} is {state}", f"sudo ip link set {name} down; {up}")
    return ok("CAN link", f"{name} is {state} at {bitrate} bit/s")


def sound(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the sound cards that the robot file names are there."""
    robot = context.robot
    devices = [] if robot is None else [one for one in (robot.microphone, robot.speaker) if one]
    named = [one for one in devices if not one.path.startswith("/") and not Path(one.path).suffix]
    if not named:
        return
    cards = context.tree.text("/proc/asound/cards")
    for device in named:
        if device.path in cards:
            yield ok(device.device, device.path)
        else:
            yield warn(device.device, f"no sound card is called {device.path!r}", "aplay -l")


def camera_calibration(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return whether lens and mounting of the robot's camera were calibrated, and how well."""
    if context.robot is None or context.robot.parts.camera is None:
        return
    name, camera = context.robot.name, context.robot.camera
    yield _lens(camera.lens, name)
    yield _mounting(camera.mounting, name)


def _lens(lens: LensCalibration | None, name: str) -> DoctorFinding:
    if lens is None:
        remedy = f"vla-deploy camera calibrate --robot {name}"
        return warn("camera lens", "as the camera itself tells it, never measured", remedy)
    error_px = lens.reprojection_error_px
    error = "error not told" if error_px is None else f"error {error_px:.2f} px"
    made_at = lens.made_at or "at a time not told"
    return ok("camera lens", f"calibrated {made_at}, f {lens.intrinsics.fx:.1f} px, {error}")


def _mounting(mounting: CameraMounting | None, name: str) -> DoctorFinding:
    if mounting is None:
        remedy = f"vla-deploy camera hand-eye --robot {name}"
        return warn("camera mounting", "as the MJCF draws it, never measured", remedy)
    shift_mm = 1000.0 * float(np.linalg.norm(mounting.translation_m))
    measured = f"calibrated {mounting.made_at}, {shift_mm:.1f} mm from where it is drawn"
    return ok("camera mounting", measured)


_SPOKEN_STOP: Final = "spoken stop"


def spoken_stop(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that stop words are switched on and that their model runs."""
    profile, robot = context.profile, context.robot
    if profile is None:
        yield missing(_SPOKEN_STOP, "no profile to look at", "vla-deploy doctor --profile desktop")
    elif robot is not None and robot.microphone is None:
        yield missing(_SPOKEN_STOP, f"{robot.name} has no microphone: nobody can stop it by voice")
    elif profile.speech.stop_words == OFF:
        remedy = 'set speech.stop_words = "normal" in the profile'
        yield warn(_SPOKEN_STOP, "switched off: nobody can stop the robot by voice", remedy)
    else:
        engines = engines_dir_of(default_base())
        shelf = ModelShelf(store=context.models, engines=engines, clock=context.clock)
        try:
            spotter = open_spotter(shelf, profile)
        except InferenceError as error:
            yield warn(_SPOKEN_STOP, one_line(error), "vla-deploy models list")
            return
        chosen = profile.speech.stop_words
        words = ", ".join(spotter.words)
        yield ok(
            _SPOKEN_STOP, f"{words}; sensitivity {chosen}, from {spotter.thresholds[chosen]:g} on"
        )
