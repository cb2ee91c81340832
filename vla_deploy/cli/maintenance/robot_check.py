"""Judge of a robot file what takes more than reading it: kinematics, words, the twin's worlds."""

import tomllib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from vla_deploy.manipulation.downward_reach import reach_faults
from vla_deploy.robots import RobotDescription, RobotFileError
from vla_deploy.robots.loader import robot_file
from vla_deploy.runtime.table_schema import TableFault
from vla_deploy.world.own_words import word_faults


def require_usable(robot: RobotDescription, name: str) -> None:
    """Refuse a robot whose hands do not get to its `[reach]`, or whose words or world are none.

    Raises:
        RobotFileError: with all faults; `name` is how the command named the robot.
    """
    faults = (*reach_faults(robot, name), *word_faults(robot), *_world_faults(robot))
    if faults:
        raise RobotFileError(robot_file(name), faults)


def _world_faults(robot: RobotDescription) -> Iterator[TableFault]:
    """Yield why the twin has no place for the robot; nothing where the twin is not installed."""
    worlds = {file.stem: file for file in _worlds()}
    if not worlds:
        return
    world = robot.twin.world
    fixed = robot.parts.base is None
    fitting = [name for name, file in worlds.items() if not fixed or _has_mount(file)]
    if world not in worlds:
        got = repr(world)
    elif world not in fitting:
        got = f"{world!r}, which has no [mount] for a robot that does not drive"
    else:
        return
    expected = f"a world of the twin: {', '.join(sorted(fitting))}"
    yield TableFault(key="twin.world", got=got, expected=expected)


def _worlds() -> list[Path]:
    # Found, not imported: nothing here may look into the twin.
    found = find_spec("sim_twin")
    if found is None or found.origin is None:
        return []
    return sorted((Path(found.origin).parent / "worlds").glob("*.toml"))


def _has_mount(file: Path) -> bool:
    return "mount" in tomllib.loads(file.read_text(encoding="utf-8"))
