"""Check that the gateway to ROS 2 can run, and who can reach the robot through it."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, missing, ok, warn
from vla_deploy.gateways.ros.imports import IMPORTS, MESSAGES, remedy
from vla_deploy.gateways.ros.shared_memory import find_leftovers
from vla_deploy.robots.ros_settings import Accepts, RosSettings
from vla_deploy.supervisor.errors import RosNotFound
from vla_deploy.supervisor.processes.ros_environment import find_environment

TESTED_RMW: Final = "rmw_fastrtps_cpp"
HIGHEST_DOMAIN: Final = 101
"""Above it, DDS takes ports that Linux hands out by itself."""
MOST_LOG_BYTES: Final = 1 << 30
_MB: Final = 1e6
_INSTALL: Final = "sudo apt-get install -y ros-jazzy-ros-base   # in a checkout: make ros"
_PROBE: Final = """
import importlib, importlib.metadata, json, platform, sys
absent = {}
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except Exception as error:
        absent[name] = f"{type(error).__name__}: {error}"
report = {"python": platform.python_version(), "absent": absent, "rclpy": "", "rmw": ""}
if "rclpy" not in absent:
    import rclpy
    report["rclpy"] = importlib.metadata.version("rclpy")
    try:
        report["rmw"] = rclpy.get_rmw_implementation_identifier()
    except Exception as error:
        report["rmw_fault"] = str(error)
print(json.dumps(report))
"""


def environment(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Start ROS's interpreter and import in it all that the gateway needs."""
    settings = _asked(context)
    if settings is None:
        return
    try:
        found = find_environment(settings.python, settings.workspace)
    except RosNotFound as error:
        yield fail("interpreter", str(error), _INSTALL)
        return
    variables = [f"{name}={value}" for name, value in found.variables.items()]
    try:
        report = json.loads(
            context.ask(["env", *variables, str(found.python), "-c", _PROBE, *IMPORTS])
        )
    except (ValueMissing, ValueError) as error:
        yield fail("interpreter", f"{found.python} cannot be used: {error}", f"{found.python} -VV")
        return
    yield ok("interpreter", f"Python {report['python']}, {found.origin}")
    yield from _imported(report)
    yield from _middleware(report)


def usage(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return whether anything asks for ROS, and in which domain the robot would be."""
    settings = _asked(context)
    if settings is None:
        why = "not in use: neither the robot file ([ros] enabled) nor the profile (ros) asks for it"
        yield ok("ROS", why)
        return
    yield _domain(settings)
    yield _reach(settings)


def leftovers(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Count what ROS processes have left in shared memory when they were killed."""
    if _asked(context) is None:
        return
    found = find_leftovers(context.tree.root / "dev/shm")
    if found:
        size_mb = sum(one.size_bytes for one in found) / _MB
        measured = f"{size_mb:.1f} MB of dead processes in {len(found)} segments and ports"
        yield warn("DDS leftovers", measured, "fastdds shm clean   # the next start does so, too")
    else:
        yield ok("DDS leftovers", "none in /dev/shm")


def logs(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Measure the logs of ROS, which never removes any."""
    if _asked(context) is None:
        return
    home = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")
    folder = Path(os.environ.get("ROS_LOG_DIR") or home / "log")
    size = sum(file.lstat().st_size for file in folder.rglob("*") if file.is_file())
    measured = f"{size / _MB:.0f} MB in {folder}"
    if size > MOST_LOG_BYTES:
        yield warn("ROS logs", measured, f"find {folder} -mtime +7 -delete")
    else:
        yield ok("ROS logs", measured)


def _asked(context: DoctorContext) -> RosSettings | None:
    """Return the robot's settings where it or the profile asks for ROS."""
    settings = RosSettings() if context.robot is None else context.robot.ros
    by_profile = context.profile is not None and context.profile.ros
    return settings if settings.enabled or by_profile else None


def _imported(report: dict[str, Any]) -> Iterator[DoctorFinding]:
    absent: dict[str, str] = report["absent"]
    if "rclpy" not in absent:
        yield ok("rclpy", report["rclpy"])
    for module, why in absent.items():
        yield fail(module, f"cannot be imported: {why}", remedy(module))
    if not absent:
        yield ok("ROS messages", f"all {len(MESSAGES)} packages")


def _middleware(report: dict[str, Any]) -> Iterator[DoctorFinding]:
    choose = f"export RMW_IMPLEMENTATION={TESTED_RMW}"
    if report["rmw"] == TESTED_RMW:
        yield ok("RMW", TESTED_RMW)
    elif report["rmw"]:
        yield warn("RMW", f"{report['rmw']}: the gateway was tested with {TESTED_RMW} only", choose)
    elif "rclpy" in report["absent"]:
        yield missing("RMW", "unknown without rclpy")
    else:
        yield fail("RMW", f"cannot be loaded: {report.get('rmw_fault', '')}", choose)


def _domain(settings: RosSettings) -> DoctorFinding:
    text = os.environ.get("ROS_DOMAIN_ID", "")
    of_variable = settings.domain_id is None and text
    value = text if of_variable else str(settings.domain_id or 0)
    measured = f"{value}, of the variable ROS_DOMAIN_ID" if of_variable else value
    if value.isdecimal() and int(value) <= HIGHEST_DOMAIN:
        return ok("ROS domain", measured)
    expected = f"{measured}; expected 0 to {HIGHEST_DOMAIN}"
    return fail("ROS domain", expected, "export ROS_DOMAIN_ID=0   # or [ros] domain_id")


def _reach(settings: RosSettings) -> DoctorFinding:
    """Report who else can take part: DDS has no password."""
    name, peers = "ROS discovery", os.environ.get("ROS_STATIC_PEERS", "")
    can = {
        Accepts.ALL: "see the robot, and command it",
        Accepts.STOP: "see the robot, and stop it",
        Accepts.NOTHING: "see the robot",
    }[settings.accept]
    keep_in = 'set discovery = "localhost" under [ros]; or encrypt: docs/ros.md'
    if settings.discovery not in ("localhost", "off"):
        reach = f"{settings.discovery}: every computer on this network can {can}"
        return warn(name, reach, keep_in)
    if peers and settings.discovery != "off":
        return warn(name, f"{settings.discovery}, and {peers} can {can}", "unset ROS_STATIC_PEERS")
    return ok(name, f"{settings.discovery}: every user of this computer can {can}")
