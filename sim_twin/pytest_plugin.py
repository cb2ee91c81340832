"""Give tests a robot in lock-step: `pytest_plugins = ["sim_twin.pytest_plugin"]` in a conftest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim_twin.lockstep import Lockstep


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
