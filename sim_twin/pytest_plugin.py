"""Give tests a robot: pytest finds these fixtures wherever the package is installed.

- `twin`: the whole robot in lock-step on simulated time, armed; same seed, same bits
- `twin_stack`: the real processes on the twin's time, as fast as this computer can, armed
- `faults`: the fault injector of the one that the test uses
- `lockstep`, `make_lockstep`: a twin without nodes, for tests of single parts
- `hardware`: the devices of a real robot, where `--hardware` names its file

`@pytest.mark.twin(seed=7)` chooses robot, world, seed and profile of the first two;
`@pytest.mark.twin(speech=True)` lets `twin` hear and speak, which `twin_stack` always does.
`pytest --hardware robot.toml` alone runs the device contracts on that robot.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_twin.contracts.hardware import Hardware
    from sim_twin.faults import FaultInjector
    from sim_twin.harness.lockstep import Lockstep
    from sim_twin.harness.lockstep_stack import LockstepStack
    from sim_twin.harness.processes import ProcessStack
    from sim_twin.harness.remote_faults import RemoteFaults

MARKERS = (
    "twin(robot, world, seed, profile): choose what `twin` and `twin_stack` start with; "
    "speech=True lets `twin` hear and speak",
    "energises: switches motors of a real robot on; runs only with --energise",
)
_CHOICES = ("robot", "world", "seed", "profile", "speech")

# The contracts are tests: a failed assertion shows its values.
pytest.register_assert_rewrite("sim_twin.contracts")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what a real robot needs."""
    group = parser.getgroup("robot", "a real robot")
    group.addoption("--hardware", type=Path, metavar="ROBOT_TOML", help="test this robot's devices")
    group.addoption("--devices-dir", type=Path, help="take every device from here instead")
    group.addoption("--hardware-profile", default="desktop", help="its platform profile")
    group.addoption(
        "--energise",
        action="store_true",
        help="let tests switch motors on: they hold where they are; keep clear",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Declare the markers, and choose the contracts where only a robot is named."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    _require_a_robot(config.option)
    if config.option.hardware and config.args_source is not config.ArgsSource.ARGS:
        from sim_twin.contracts.hardware import CONTRACTS

        config.args = [str(CONTRACTS)]


def _require_a_robot(option: argparse.Namespace) -> None:
    """Refuse a robot that is not there, once and before every test asks for it.

    Raises:
        UsageError: `--hardware` is missing beside its companions, or names no robot.
    """
    from vla_deploy.robots import RobotFileError, load_robot

    if option.hardware is None:
        if option.energise or option.devices_dir is not None:
            raise pytest.UsageError(
                "--energise and --devices-dir choose how to test a robot: add --hardware robot.toml"
            )
        return
    try:
        load_robot(option.hardware)
    except RobotFileError as error:
        raise pytest.UsageError(f"--hardware: {error}") from error
    if option.devices_dir is not None and not option.devices_dir.is_dir():
        raise pytest.UsageError(
            f"--devices-dir: {option.devices_dir} is no folder; start a twin: "
            "python -m sim_twin --run-dir DIR, its devices are in DIR/dev"
        )


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave out what would switch motors on without leave."""
    if item.get_closest_marker("energises") and not item.config.option.energise:
        pytest.skip("switches motors on: keep clear of the robot and add --energise")


@pytest.fixture
def make_lockstep(tmp_path: Path) -> Iterator[Callable[..., Lockstep]]:
    """Build robots in lock-step with the arguments of `Lockstep`; all are closed at the end."""
    from sim_twin.harness.lockstep import (
        Lockstep,  # MuJoCo loads only where a test asks for a robot
    )

    built: list[Lockstep] = []

    def make(**arguments: Any) -> Lockstep:
        run_dir = tmp_path / f"run{len(built)}"
        run_dir.mkdir()
        built.append(Lockstep(tmp_path=run_dir, **arguments))
        return built[-1]

    yield make
    for lockstep in built:
        lockstep.close()


@pytest.fixture
def lockstep(make_lockstep: Callable[..., Lockstep]) -> Lockstep:
    """Give butler in the flat with seed 0."""
    return make_lockstep()


@pytest.fixture
def twin(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[LockstepStack]:
    """Give the whole robot in lock-step, armed."""
    from sim_twin.harness.lockstep_stack import armed_lockstep

    run_dir = tmp_path / "twin"
    run_dir.mkdir()
    with armed_lockstep(run_dir, **_chosen(request)) as stack:
        yield stack


@pytest.fixture
def twin_stack(request: pytest.FixtureRequest) -> Iterator[ProcessStack]:
    """Give the real processes on the twin's time, armed."""
    from sim_twin.harness.processes import armed_processes

    chosen = _chosen(request)
    chosen.pop("speech", None)  # the processes always have it
    options = (f"--{name}={value}" for name, value in chosen.items())
    # Sockets want a short path, which pytest's own folders are not.
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        armed_processes(Path(folder) / "base", "--fast", *options) as stack,
    ):
        yield stack


@pytest.fixture
def faults(request: pytest.FixtureRequest) -> FaultInjector | RemoteFaults:
    """Give the fault injector of the test's `twin_stack`, `lockstep` or else `twin`."""
    names = (name for name in ("twin_stack", "lockstep") if name in request.fixturenames)
    robot: ProcessStack | Lockstep | LockstepStack = request.getfixturevalue(next(names, "twin"))
    return robot.faults


@pytest.fixture(scope="session")
def hardware(request: pytest.FixtureRequest) -> Hardware:
    """Give the robot that `--hardware` names."""
    from sim_twin.contracts.hardware import Hardware
    from vla_deploy.robots import RobotFileError

    option = request.config.option
    if option.hardware is None:
        pytest.skip("needs a real robot: add --hardware robot.toml")
    try:
        return Hardware(option.hardware, option.devices_dir, option.hardware_profile)
    except RobotFileError as error:
        pytest.fail(str(error), pytrace=False)


def _chosen(request: pytest.FixtureRequest) -> dict[str, Any]:
    marker = request.node.get_closest_marker("twin")
    chosen: dict[str, Any] = {} if marker is None else dict(marker.kwargs)
    unknown = sorted(set(chosen) - set(_CHOICES))
    if unknown or (marker is not None and marker.args):
        wrong = ", ".join(map(repr, [*unknown, *marker.args])) if marker is not None else ""
        raise pytest.UsageError(
            f"{request.node.nodeid}: mark.twin: expected {', '.join(_CHOICES)} by name, got {wrong}"
        )
    return chosen
