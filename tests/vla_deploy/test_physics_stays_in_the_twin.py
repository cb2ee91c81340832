"""Nothing on the robot can know what only the simulator knows: what it sees comes over wires."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ON_THE_ROBOT = ("vla_deploy", "drivers", "platforms")
# Reading the state of an MjData or the layout of an MjModel takes one of these names.
STATE_NAMES = frozenset(
    {
        "MjData", "MjModel", "MjSpec", "mj_step", "mj_forward", "mj_name2id",
        "qpos", "qvel", "qacc", "xpos", "xipos", "xquat", "xmat", "ximat", "cvel", "sensordata",
        "geom_xpos", "geom_xmat", "site_xpos", "site_xmat", "cam_xpos", "cam_xmat",
        "jnt_qposadr", "body_rootid", "mocap_pos", "qfrc_applied", "xfrc_applied",
    }
)  # fmt: skip
# Modules that know the state: physics, its engine, and the twin's referee.
STATE_MODULES = ("mujoco", "sim_twin", "benchmarks", "training")
# Benchmarks that are simulators themselves; the others ask the twin's referee.
OF_THE_ENGINE = {
    "twin.py": "its subject is the engine",
    "pushed_robot.py": "it pushes a robot about in a world without physics",
}


def reads(source: str) -> Iterator[str]:
    """Tell every way in which a module's source may get at the simulator's state."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Attribute(attr=name) | ast.Name(id=name) if name in STATE_NAMES:
                yield f"{node.lineno}: {name}"
            case ast.Import(names=names):
                yield from (f"{node.lineno}: {one.name}" for one in names if _knows(one.name))
            case ast.ImportFrom(module=str(module)) if _knows(module):
                yield f"{node.lineno}: {module}"
            case ast.Call(func=ast.Name(id="import_module" | "__import__"), args=[first, *_]):
                if isinstance(first, ast.Constant) and _knows(repr(first.value)):
                    yield f"{node.lineno}: {first.value!r}"


def _knows(module: str) -> bool:
    return module.strip("'").split(".")[0] in STATE_MODULES


@pytest.mark.parametrize("package", ON_THE_ROBOT)
def test_no_module_of_the_robot_reads_the_state_of_the_physics(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    assert len(files) > 5
    found = {str(file.relative_to(ROOT)): list(reads(file.read_text())) for file in files}
    assert {file: lines for file, lines in found.items() if lines} == {}


def test_benchmarks_ask_the_referee_for_the_truth() -> None:
    files = sorted((ROOT / "benchmarks").glob("*.py"))
    assert OF_THE_ENGINE.keys() <= {file.name for file in files}
    state = {
        file.name: [line for line in reads(file.read_text()) if line.split()[1] in STATE_NAMES]
        for file in files
        if file.name not in OF_THE_ENGINE
    }
    assert {file: lines for file, lines in state.items() if lines} == {}


@pytest.mark.parametrize(
    "line",
    [
        "import mujoco",
        "from mujoco import viewer",
        "from sim_twin.physics.truth import Referee",
        "import_module('mujoco')",
        "height = engine.data.xpos[3]",
        "data = MjData(model)",
    ],
)
def test_the_scan_finds_it(line: str) -> None:
    assert list(reads(f"from __future__ import annotations\n{line}\n"))


def test_perception_runs_where_there_is_neither_simulator_nor_twin() -> None:
    code = (
        "import sys\n"
        "for name in ('mujoco', 'sim_twin', 'benchmarks', 'training'): sys.modules[name] = None\n"
        "import vla_deploy.perception.node, vla_deploy.skills.node, vla_deploy.control.node\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr == ""
