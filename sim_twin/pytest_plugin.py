"""Give tests a robot: pytest finds these fixtures wherever the package is installed.

- `twin`: the whole robot in lock-step on simulated time, armed; same seed, same bits
- `twin_stack`: the real processes on the wall clock, armed
- `faults`: the fault injector of the one that the test uses
- `lockstep`, `make_lockstep`: a twin without nodes, for tests of single parts

`@pytest.mark.twin(seed=7)` chooses robot, world, seed and profile of the first two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_twin.lockstep import Lockstep
    from sim_twin.process_stack import ProcessStack
    from sim_twin.stack import LockstepStack

MARKER = "twin(robot, world, seed, profile): choose what `twin` and `twin_stack` start with"
_CHOICES = ("robot", "world", "seed", "profile")


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marker."""
    config.addinivalue_line("markers", MARKER)


@pytest.fixture
def make_lockstep(tmp_path: Path) -> Iterator[Callable[..., Lockstep]]:
    """Build robots in lock-step with the arguments of `Lockstep`; all are closed at the end."""
    from sim_twin.lockstep import Lockstep  # MuJoCo loads only where a test asks for a robot

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
    from sim_twin.stack import LockstepStack

    run_dir = tmp_path / "twin"
    run_dir.mkdir()
    stack = LockstepStack(run_dir, **_chosen(request))
    try:
        stack.arm()
        yield stack
    finally:
        stack.close()


@pytest.fixture
def twin_stack(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[ProcessStack]:
    """Give the real processes on the wall clock, armed."""
    from sim_twin.process_stack import ProcessStack

    options = (f"--{name}={value}" for name, value in _chosen(request).items())
    stack = ProcessStack(tmp_path / "twin_stack", *options)
    try:
        stack.wait_until_armed()
        yield stack
    finally:
        stack.close()


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
