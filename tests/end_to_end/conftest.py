from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sim_twin.stack import LockstepStack


@pytest.fixture
def make_stack(tmp_path: Path) -> Iterator[Callable[[int], LockstepStack]]:
    built: list[LockstepStack] = []

    def make(seed: int = 0) -> LockstepStack:
        run_dir = tmp_path / f"run{len(built)}"
        run_dir.mkdir()
        built.append(LockstepStack(run_dir, seed=seed))
        return built[-1]

    yield make
    for stack in built:
        stack.close()


@pytest.fixture
def stack(make_stack: Callable[[int], LockstepStack]) -> LockstepStack:
    """The whole robot, armed, in the flat with seed 0."""
    made = make_stack(0)
    made.arm()
    return made
