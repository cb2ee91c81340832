"""Follow a run whose topics the test writes."""

from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.recording.selection import Selection
from vla_deploy.telemetry.rerun.live import RerunNode
from vla_deploy.telemetry.rerun.showing import Showing


def followed(run: Any, taken: Any, selection: Selection) -> Showing:
    """Follow for six seconds, a value of each kind in every tenth."""
    context = NodeContext(
        run_dir=run.run_dir, robot="butler", profile="desktop", devices_dir=None, clock=run.clock
    )
    showing = Showing(taken)
    node = RerunNode(context, selection, showing, run.clock.wall_ns)
    node.start()
    for _ in range(60):
        run.clock.time_ns += NS_PER_S // 10
        run.write()
        node.step()
    node.stop()
    return showing


def test_a_run_is_shown_as_it_goes_on(run: Any, taken: Any) -> None:
    showing = followed(run, taken, Selection())
    assert not showing.unfit
    assert showing.shown["plots/pose/x_m"] == 60
    assert showing.shown["world/pose"] == 60
    assert showing.shown["logs/events/task_event"] == 60
    assert showing.shown["logs/planner"] > 50
    assert 25 <= showing.shown["world/base/camera/colour"] <= 31
    assert showing.shown["world/map"] == 1
    stamps = [stamp_ns for stamp_ns, _, one in taken.entities if one.path == "plots/pose/x_m"]
    assert stamps[-1] == run.clock.wall_ns()
    assert len(taken.entities) / 2 < taken.flushed < len(taken.entities)


def test_only_what_is_wanted_is_shown(run: Any, taken: Any) -> None:
    showing = followed(run, taken, Selection(topics=("pose", "view/pose")))
    tops = {path.rpartition("/")[0] for path in showing.shown}
    assert tops == {"plots/pose", "world"}
