"""Follow a run whose topics the test writes."""

from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.rerun.entity_logger import EntityLogger
from vla_deploy.telemetry.rerun.live import RerunNode


def followed(run: Any, taken: Any, selection: ChannelSelection) -> EntityLogger:
    """Follow for six seconds, a value of each kind in every tenth."""
    logger = EntityLogger(taken)
    node = RerunNode(run.context, selection, logger, run.clock.wall_ns)
    node.start()
    for _ in range(60):
        run.clock.time_ns += NS_PER_S // 10
        run.write()
        node.step()
    node.stop()
    return logger


def test_a_run_is_shown_as_it_goes_on(run: Any, taken: Any) -> None:
    logger = followed(run, taken, ChannelSelection())
    assert not logger.unfit
    assert logger.shown["plots/pose/x_m"] == 60
    assert logger.shown["world/pose"] == 60
    assert logger.shown["logs/events/task_event"] == 60
    assert logger.shown["logs/planner"] > 50
    assert 25 <= logger.shown["world/base/camera/colour"] <= 31
    assert logger.shown["world/map"] == 1
    stamps = [stamp_ns for stamp_ns, _, one in taken.entities if one.path == "plots/pose/x_m"]
    assert stamps[-1] == run.clock.wall_ns()
    assert len(taken.entities) / 2 < taken.flushed < len(taken.entities)


def test_only_what_is_wanted_is_shown(run: Any, taken: Any) -> None:
    logger = followed(run, taken, ChannelSelection(topics=("pose", "view/pose")))
    tops = {path.rpartition("/")[0] for path in logger.shown}
    assert tops == {"plots/pose", "world"}
