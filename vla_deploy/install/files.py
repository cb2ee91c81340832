"""Fill the templates in `systemd/` from robot file, profile and layout."""

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from platforms import Profile
from vla_deploy.install.errors import ArgumentRefused, TemplateBroken
from vla_deploy.install.layout import SERVICE_RUNTIME, InstallLayout
from vla_deploy.robots import RobotDescription
from vla_deploy.supervisor.profiles.profile_choice import (
    ProfileChoice,
    StartProfile,
    choice_of,
    detect,
    start_profile,
)
from vla_deploy.supervisor.systemd import (
    RESTART_S,
    START_BURST,
    start_limit_s,
    watchdog_s,
)

# In the source tree, or where a wheel puts it.
_IN_SOURCE: Final = Path(__file__).parents[2] / "systemd"
_INSTALLED: Final = Path(sys.prefix) / "share" / "vla-deploy" / "systemd"
_PLACEHOLDER: Final = re.compile(r"@([A-Z][A-Z0-9_]*)@")
_INTERFACE: Final = re.compile(r"[A-Za-z][A-Za-z0-9._-]{0,14}")
_BY_ID: Final = re.compile(r"/dev/(?P<kind>serial|input)/by-id/usb-(?P<serial>.+?)(?:-if\d|-event)")
_SUBSYSTEMS: Final = {"serial": ("tty", "tty*"), "input": ("input", "event*")}
_ARGUMENT: Final = re.compile(r"[A-Za-z0-9_./-]+")
# The kernel counts the page cache of recordings and models too, and what it then takes back it
# takes from control as well, which waits for it: the budgets, which count no cache, act first.
_HIGH_OVER_BUDGET: Final = 1.5
_MAX_OVER_BUDGET: Final = 1.75
_CONTROL_HEADROOM: Final = 10
_LIBEXEC: Final = ("release-guard", "set-power-mode", "wait-for-children")
_UNITS: Final = (
    "vla-deploy.service",
    "vla-deploy.slice",
    "vla-deploy-gave-up.service",
    "vla-deploy-power.socket",
    "vla-deploy-power@.service",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Credential:
    """Name a secret that the service reads from a file only root can read."""

    name: str
    path: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceChoice:
    """Choose what the service runs; robot and profile as `vla-deploy run` takes them.

    Without a profile each start takes the one chosen by `vla-deploy profile use`, or the detected.
    """

    robot: str = "butler"
    profile: str = ""
    twin: bool = False
    watchdog_s: int = watchdog_s()
    credentials: tuple[Credential, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class InstalledFile:
    """Hold one file as it should be on the robot's computer."""

    path: Path
    text: str
    mode: int = 0o644


def system_files(
    robot: RobotDescription, profile: Profile, choice: ServiceChoice, layout: InstallLayout
) -> tuple[InstalledFile, ...]:
    """Return every file that the service needs, in the order in which they are written.

    Raises:
        ArgumentRefused: a name or path cannot stand in a unit.
        TemplateBroken: a template is missing or names what is not filled in.
    """
    values = _values(robot, profile, choice, layout)
    units = Path("/etc/systemd/system")
    names = [*_UNITS]
    if values["CAN_INTERFACE"]:
        names.append("vla-deploy-can.service")
    return (
        *(_file(layout.prefix / "libexec" / name, name, values, 0o755) for name in _LIBEXEC),
        _file(Path("/usr/local/bin/vla-deploy"), "vla-deploy.sh", values, 0o755),
        _file(Path("/usr/lib/sysusers.d/vla-deploy.conf"), "vla-deploy.sysusers", values),
        _file(Path("/usr/lib/tmpfiles.d/vla-deploy.conf"), "vla-deploy.tmpfiles", values),
        _file(Path("/etc/udev/rules.d/70-vla-deploy.rules"), "vla-deploy.rules", values),
        *(_file(units / name, name, values) for name in names),
    )


def filled(text: str, values: Mapping[str, str], name: str) -> str:
    """Return a template with every `@NAME@` replaced; a line left empty by it is dropped.

    Raises:
        TemplateBroken: a placeholder has no value.
    """
    unknown = sorted({found for found in _PLACEHOLDER.findall(text) if found not in values})
    if unknown:
        raise TemplateBroken(f"template {name}: nobody fills in {', '.join(unknown)}")
    lines = []
    for line in text.splitlines():
        full = _PLACEHOLDER.sub(lambda match: values[match[1]], line).rstrip()
        if full or not line:
            lines.append(full)
    return "\n".join(lines) + "\n"


def _values(
    robot: RobotDescription, profile: Profile, choice: ServiceChoice, layout: InstallLayout
) -> dict[str, str]:
    memory_mb = profile.total.memory_mb
    return {
        "ROBOT": robot.name,
        "ROBOT_ARGUMENT": _argument(choice.robot),
        "PROFILE": profile.name,
        "RUN_OPTIONS": _run_options(choice),
        "PREFIX": _argument(str(layout.prefix)),
        "USER": _argument(layout.user),
        "IP": layout.ip,
        "NVPMODEL": layout.nvpmodel,
        "WATCHDOG_S": str(choice.watchdog_s),
        "RESTART_S": str(RESTART_S),
        "START_BURST": str(START_BURST),
        "START_LIMIT_S": str(start_limit_s()),
        "RT_PRIORITY": str(profile.realtime_priority + _CONTROL_HEADROOM),
        "MEMORY_HIGH_MB": f"{memory_mb * _HIGH_OVER_BUDGET:.0f}",
        "MEMORY_MAX_MB": f"{memory_mb * _MAX_OVER_BUDGET:.0f}",
        "CAN_INTERFACE": "" if choice.twin else _can_interface(robot),
        "CAN_BITRATE": str(robot.parts.can_bus.bitrate) if robot.parts.can_bus else "",
        "CREDENTIALS": "\n".join(
            f"LoadCredential={_argument(credential.name)}:{_argument(str(credential.path))}"
            for credential in choice.credentials
        ),
        "LINKS": "" if choice.twin else "\n".join(_links(robot)),
    }


def _run_options(choice: ServiceChoice) -> str:
    profile = f" --profile {_argument(choice.profile)}" if choice.profile else ""
    return profile + (" --twin" if choice.twin else "")


def _argument(text: str) -> str:
    if not _ARGUMENT.fullmatch(text):
        raise ArgumentRefused(
            f"{text!r} cannot stand in a unit: expected letters, digits and _ . / - only; "
            "move or rename it"
        )
    return text


def _can_interface(robot: RobotDescription) -> str:
    """Return the network interface; none for a serial adapter or a socket."""
    path = robot.parts.can_bus.path if robot.parts.can_bus else ""
    return path if _INTERFACE.fullmatch(path) else ""


def _links(robot: RobotDescription) -> list[str]:
    """Return one rule per USB device that the robot file names: `/dev/vla-deploy/<device>`."""
    sensors = [one for one in (robot.parts.lidar, robot.parts.imu) if one is not None]
    paths = {robot.servo_bus.device: robot.servo_bus.path}
    paths |= {sensor.device: sensor.path for sensor in sensors}
    if robot.estop is not None:
        paths[robot.estop.device] = robot.estop.path
    matches = {name: _BY_ID.match(path) for name, path in paths.items()}
    return [_link(name, match) for name, match in matches.items() if match]


def _link(name: str, match: re.Match[str]) -> str:
    subsystem, kernel = _SUBSYSTEMS[match["kind"]]
    conditions = (
        f'SUBSYSTEM=="{subsystem}"',
        f'KERNEL=="{kernel}"',
        f'ENV{{ID_SERIAL}}=="{match["serial"]}"',
    )
    return ", ".join((*conditions, f'SYMLINK+="vla-deploy/{name}"'))


def _file(path: Path, name: str, values: Mapping[str, str], mode: int = 0o644) -> InstalledFile:
    return InstalledFile(path=path, text=filled(_template(name), values, name), mode=mode)


def _template(name: str) -> str:
    for folder in (_IN_SOURCE, _INSTALLED):
        if (folder / name).is_file():
            return (folder / name).read_text()
    raise TemplateBroken(f"template {name}: expected in {_IN_SOURCE} or {_INSTALLED}; reinstall")


_SLICE: Final = Path("/etc/systemd/system/vla-deploy.slice")
_MEMORY_HIGH: Final = re.compile(r"^MemoryHigh=(\d+)M$", re.MULTILINE)


def service_profile(given: str, layout: InstallLayout) -> StartProfile:
    """Return the given profile, else the chosen one, else the one detected, and why."""
    if given:
        return StartProfile(name=given, why="given by --profile")
    if layout.is_this_computer:
        return start_profile(SERVICE_RUNTIME)
    chosen = ProfileChoice(layout.on_disk(choice_of(SERVICE_RUNTIME).path)).load()
    if chosen is None:
        name, why = detect(layout.root)
        return StartProfile(name=name, why=why)
    inside = str(layout.on_disk(Path(chosen))) if chosen.startswith("/") else chosen
    return StartProfile(name=inside, why=f"chosen in {layout.root}")


def slice_too_small(profile: Profile, layout: InstallLayout) -> str:
    """Return why the installed slice does not hold a profile's memory; "" where it does."""
    file = layout.on_disk(_SLICE)
    limit = _MEMORY_HIGH.search(file.read_text(errors="replace")) if file.is_file() else None
    if limit is None or profile.total.memory_mb <= int(limit[1]):
        return ""
    return (
        f"profile {profile.name} may use {profile.total.memory_mb:.0f} MB, the installed slice "
        f"allows {limit[1]} MB ({file}); install again to size it: sudo vla-deploy install"
    )
