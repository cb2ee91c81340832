"""Find the Python environment of ROS 2 Jazzy, and decide how the gateway is started in it.

Of this project it sees three packages by links, never our own environment: ROS's Python may be of
another version, and its NumPy another one.
"""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vla_deploy.robots import RobotDescription
from vla_deploy.robots.ros_settings import RosSettings
from vla_deploy.supervisor.errors import RosNotFound

VARIABLE: Final = "VLA_DEPLOY_ROS_PYTHON"
WORKSPACE_VARIABLE: Final = "VLA_DEPLOY_ROS_WORKSPACE"
WHEELS: Final = ".venv-ros"
PACKAGES: Final = ("vla_deploy", "drivers", "platforms")
SETUP: Final = Path("/opt/ros/jazzy/setup.bash")
SYSTEM_PYTHON: Final = Path("/usr/bin/python3")
SETUP_TIMEOUT_S: Final = 20.0
_COMPLETE: Final = ".complete"  # scripts/ros-environment writes it last
_BOOTSTRAPPER: Final = "lib/python3*/site-packages/ros_wheels_bootstrapper.pth"
# Another ROS, or our own environment, may have set these for the supervisor. The bootstrapper of
# the wheels restarts the interpreter to set LD_LIBRARY_PATH, unless this variable says that it has.
_CLEARED: Final = ("PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
# A setup.bash puts its folders in front of what it finds here.
_PREFIXES: Final = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "COLCON_PREFIX_PATH")
_OF_THE_SHELL: Final = frozenset({"_", "SHLVL", "PWD", "OLDPWD"})
DOMAIN: Final = "ROS_DOMAIN_ID"
DISCOVERY: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PACKAGES_DIR: Final = "ros/packages"
LOGS_DIR: Final = "logs/ros"
TRANSPORT_PROFILE: Final = Path(__file__).with_name("fastdds_profile.xml")


@dataclass(frozen=True, slots=True, kw_only=True)
class RosEnvironment:
    """Hold the interpreter to start, the variables to add for it, and in words whence both are."""

    python: Path
    variables: Mapping[str, str]
    origin: str


def find_environment(
    configured: str = "",
    workspace: str = "",
    *,
    inherited: Mapping[str, str] = os.environ,
    places: tuple[Path, ...] | None = None,
    setup: Path = SETUP,
) -> RosEnvironment:
    """Return the environment of ROS: configured, or named by a variable, or found.

    `configured` is an interpreter or the folder of a virtual environment, `workspace` a colcon
    workspace on top of the ROS that `setup` sets up, or its folder `install`; both come from the
    robot file, else from variables. `places` are the folders in which an environment of wheels is
    looked for.

    Raises:
        RosNotFound: there is none, or what was named cannot be used.
    """
    named = configured or inherited.get(VARIABLE, "")
    workspace = workspace or inherited.get(WORKSPACE_VARIABLE, "")
    if named:
        origin = "the robot file" if configured else f"the variable {VARIABLE}"
        python = _interpreter(Path(named).expanduser(), origin)
        if any(python.parent.parent.glob(_BOOTSTRAPPER)):
            if workspace:
                raise RosNotFound(
                    f"the workspace {workspace} cannot be laid over the wheels of {python}: it was "
                    "built against another ROS; leave out one of [ros] python and workspace"
                )
            return _of_wheels(python, f"{python}, named by {origin}")
        layers = [setup] if setup.is_file() else []
        return _of_setup(python, layers, workspace, inherited, f"named by {origin}")
    candidates = _places() if places is None else places
    for folder in candidates if not workspace else ():
        if (folder / WHEELS / _COMPLETE).is_file():
            return _of_wheels(folder / WHEELS / "bin" / "python", str(folder / WHEELS))
    if setup.is_file():
        return _of_setup(SYSTEM_PYTHON, [setup], workspace, inherited, "the system's")
    looked_for = [f"variable {VARIABLE}: not set"]
    looked_for += [f"{folder / WHEELS}: not there, or not whole" for folder in candidates]
    raise RosNotFound(
        f"no ROS 2 Jazzy found; looked for: {'; '.join([*looked_for, f'{setup}: not there'])}. "
        "In a checkout: make ros; on a robot: sudo apt-get install -y ros-jazzy-ros-base; "
        'or name an interpreter in the robot file: [ros] python = "/path/to/python"'
    )


def link_packages(folder: Path) -> Path:
    """Make a folder of links to our packages that the gateway imports, and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        if spec is None or not spec.submodule_search_locations:
            raise RosNotFound(
                f"no package {name} next to {__file__}: the installation is not whole"
            )
        target = Path(spec.submodule_search_locations[0]).resolve()
        link = folder / name
        if not link.is_symlink() or link.readlink() != target:
            fresh = folder / f".{name}.{os.getpid()}"
            fresh.symlink_to(target)
            fresh.replace(link)
    return folder


def launch_environment(
    settings: RosSettings, run_dir: Path, inherited: Mapping[str, str] = os.environ
) -> tuple[Path, dict[str, str]]:
    """Return the interpreter, and what its environment has on top of the supervisor's.

    Raises:
        RosNotFound: this computer has no ROS 2 Jazzy, or not where the robot file says.
    """
    found = find_environment(settings.python, settings.workspace)
    variables = dict(found.variables)
    packages = link_packages(run_dir / PACKAGES_DIR)
    paths = (str(packages), variables.get("PYTHONPATH", ""))
    variables["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)
    variables[DISCOVERY] = settings.discovery.upper()
    if settings.domain_id is not None:
        variables[DOMAIN] = str(settings.domain_id)
    variables["ROS_LOG_DIR"] = str(run_dir / LOGS_DIR)
    # An image is larger than the shared memory that Fast DDS takes by itself.
    profile = inherited.get("FASTRTPS_DEFAULT_PROFILES_FILE", str(TRANSPORT_PROFILE))
    variables["FASTRTPS_DEFAULT_PROFILES_FILE"] = profile
    return found.python, variables


def require_environment(robot: RobotDescription) -> None:
    """See that a robot which is driven or moved over ROS can be.

    Raises:
        RosNotFound: it is, and this computer has no ROS 2 Jazzy, or not where the robot file says.
    """
    settings = robot.ros
    if not settings.is_needed:
        return
    try:
        find_environment(settings.python, settings.workspace)
    except RosNotFound as error:
        raise RosNotFound(
            f"robot {robot.name}: [ros] says navigation = {settings.navigation!r} and arms = "
            f'{settings.arms!r}, which needs ROS; set both to "own", or: {error}'
        ) from error


def _places() -> tuple[Path, ...]:
    """Return the checkout or the folder of the packages, then the one of our environment."""
    here = Path(__file__).resolve().parents[3]
    return tuple(dict.fromkeys((here, Path(sys.prefix).resolve().parent)))


def _interpreter(named: Path, origin: str) -> Path:
    python = named / "bin" / "python" if named.is_dir() else named
    if not os.access(python, os.X_OK) or python.is_dir():
        raise RosNotFound(
            f"{origin} names {named} as ROS's Python, expected an interpreter or the folder of a "
            f"virtual environment, but {python} cannot be run; mend it, or leave it out"
        )
    return python.absolute()


def _of_wheels(python: Path, origin: str) -> RosEnvironment:
    cleared = (*_CLEARED, *_PREFIXES)
    return RosEnvironment(python=python, variables=dict.fromkeys(cleared, ""), origin=origin)


def _of_setup(
    python: Path, layers: list[Path], workspace: str, inherited: Mapping[str, str], whose: str
) -> RosEnvironment:
    if workspace:
        layers = [*layers, _overlay(Path(workspace).expanduser())]
    words = " and ".join(map(str, layers)) or "no setup.bash"
    return RosEnvironment(
        python=python,
        variables=_sourced(layers, inherited),
        origin=f"{python} ({whose}) with {words}",
    )


def _overlay(workspace: Path) -> Path:
    files = [workspace / "install" / "setup.bash", workspace / "setup.bash"]
    for file in files:
        if file.is_file():
            return file
    raise RosNotFound(
        f"no {' and no '.join(map(str, files))}: [ros] workspace of the robot file, or "
        f"{WORKSPACE_VARIABLE}, names {workspace}; build it: cd {workspace} && colcon build"
    )


def _sourced(layers: list[Path], inherited: Mapping[str, str]) -> dict[str, str]:
    """Return what the setup scripts set, one after the other, in an environment without ROS."""
    left_out = {*_CLEARED, *_PREFIXES}
    before = {name: value for name, value in inherited.items() if name not in left_out}
    cleared = dict.fromkeys((name for name in left_out if name in inherited), "")
    if not layers:
        return cleared
    script = 'for file in "$@"; do source "$file" >&2 || exit; done; env -0'
    command = ["bash", "--noprofile", "--norc", "-c", script, "bash", *map(str, layers)]
    try:
        done = subprocess.run(
            command, env=before, capture_output=True, timeout=SETUP_TIMEOUT_S, check=True
        )
    except (OSError, subprocess.SubprocessError) as error:
        words = getattr(error, "stderr", b"") or b""
        detail = words.decode(errors="replace").strip() or str(error)
        raise RosNotFound(
            f"cannot set ROS up by {' and '.join(map(str, layers))}: {detail}; "
            f"try: bash -c 'source {layers[-1]}'"
        ) from error
    return cleared | dict(_changes(before, done.stdout.decode(errors="surrogateescape")))


def _changes(before: Mapping[str, str], after: str) -> Iterator[tuple[str, str]]:
    for row in after.split("\0"):
        name, equals, value = row.partition("=")
        if equals and name not in _OF_THE_SHELL and before.get(name) != value:
            yield name, value
