import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from sim_twin.harness.lockstep_stack import LockstepStack
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR

START = 'start = "charging_station"'
CUP_ON_THE_TABLE = (2.25, 1.6, 0.4975, 0.0)
BOX_ON_THE_TABLE = (1.93, 1.5, 0.45, 0.0)


@pytest.fixture
def make_stack(tmp_path: Path) -> Iterator[Callable[..., LockstepStack]]:
    """Build whole robots in the flat with a seed, and a robot file or profile if one is named."""
    built: list[LockstepStack] = []

    def make(seed: int = 0, **chosen: Any) -> LockstepStack:
        run_dir = tmp_path / f"run{len(built)}"
        run_dir.mkdir()
        built.append(LockstepStack(run_dir, seed=seed, **chosen))
        return built[-1]

    yield make
    for stack in built:
        stack.close()


@pytest.fixture
def stack(make_stack: Callable[..., LockstepStack]) -> LockstepStack:
    """The whole robot, armed, in the flat with seed 0."""
    made = make_stack()
    made.arm()
    return made


@pytest.fixture
def coarse_stack(make_stack: Callable[..., LockstepStack], coarse: str) -> LockstepStack:
    """The whole robot, armed, in the flat, in fewer ticks."""
    made = make_stack(profile=coarse)
    made.arm()
    return made


@pytest.fixture
def make_stack_at_table(
    make_stack: Callable[..., LockstepStack], tmp_path: Path
) -> Callable[..., LockstepStack]:
    """Switch the robot on before a table with the red cup and the box on it, and arm it.

    It knows where it stands and has still to see the things: only the drive there is left out.
    """
    robot_dir = tmp_path / "butler"
    shutil.copytree(ROBOTS_DIR / "butler", robot_dir)
    text = (robot_dir / ROBOT_FILE).read_text(encoding="utf-8")
    assert START in text
    moved = text.replace(START, 'start = "coffee_table"')
    (robot_dir / ROBOT_FILE).write_text(moved, encoding="utf-8")

    def make(profile: str, **chosen: Any) -> LockstepStack:
        made = make_stack(robot=str(robot_dir), profile=profile, **chosen)
        engine = made.lockstep.twin.engine
        engine.pose(made.robot.poses["tuck"])
        engine.place("red_cup", *CUP_ON_THE_TABLE)
        engine.place("box", *BOX_ON_THE_TABLE)
        made.arm()
        return made

    return make


@pytest.fixture
def coarse_at_table(
    make_stack_at_table: Callable[..., LockstepStack], coarse: str
) -> LockstepStack:
    """The robot before the table, in fewer ticks."""
    return make_stack_at_table(coarse)
