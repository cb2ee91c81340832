from collections.abc import Callable
from pathlib import Path

import pytest

from vla_deploy.ipc import PackedField, SharedSpace, Topic, TopicKind

TOPICS = (
    Topic(
        name="pair",
        kind=TopicKind.CELL,
        owner="a",
        summary="two numbers and three",
        fields=(
            PackedField("x_m", "f8"),
            PackedField("count", "u4"),
            PackedField("values", "f4", 3),
        ),
    ),
    Topic(
        name="note",
        kind=TopicKind.CELL,
        owner="a",
        summary="a text",
        fields=(PackedField("document", "json", 200),),
    ),
    Topic(name="acts", kind=TopicKind.RING, owner="any", summary="events", slots=8, slot_bytes=128),
    Topic(name="view", kind=TopicKind.FRAME, owner="a", summary="images", slots=3, slot_bytes=96),
)


class StepClock:
    """Stand still until told otherwise."""

    def __init__(self) -> None:
        self.time_ns = 1_000

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)


@pytest.fixture
def clock() -> StepClock:
    return StepClock()


@pytest.fixture
def open_space(tmp_path: Path, clock: StepClock) -> Callable[[], SharedSpace]:
    """Open the same directory again, as another process would."""
    return lambda: SharedSpace(tmp_path / "ipc", clock, TOPICS)


@pytest.fixture
def space(open_space: Callable[[], SharedSpace]) -> SharedSpace:
    return open_space()
