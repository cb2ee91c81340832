"""Draw the views of a run: of each new value of a topic, and of what stays as it is."""

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.ipc import BY_NAME
from vla_deploy.ipc.memory.layout import is_document, record_dtype
from vla_deploy.navigation.errors import NavigationError
from vla_deploy.robots import RobotDescription
from vla_deploy.telemetry.schemas.robot_views import RobotViews
from vla_deploy.telemetry.schemas.views import STILL, VIEWS, View

Wanted = Callable[[str], bool]
_BY_TOPIC: Final[Mapping[str, tuple[View, ...]]] = {
    topic: tuple(view for view in VIEWS if view.topic == topic)
    for topic in {view.topic for view in VIEWS}
}
_log = logging.getLogger(__name__)


class Pictures:
    """Draw for one reader; each view at its own pace, and only those that are wanted."""

    def __init__(self, robot: RobotDescription) -> None:
        """Build the robot's kinematics.

        Raises:
            RobotFileError: pinocchio does not find the robot file's joints in the MJCF.
        """
        self._robot = robot
        self._views = RobotViews(robot)
        self._drawn_ns: dict[str, int] = {}

    def of(
        self, topic: str, payload: bytes, stamp_ns: int, wanted: Wanted
    ) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of the views of one value; `stamp_ns` is wall clock."""
        due = [view for view in _BY_TOPIC.get(topic, ()) if self._is_due(view, stamp_ns)]
        due = [view for view in due if wanted(view.channel)]
        if not due:
            return
        declared = BY_NAME[topic]
        value = (
            json.loads(payload)
            if is_document(declared)
            else np.frombuffer(payload, record_dtype(declared))[0]
        )
        for view in due:
            self._drawn_ns[view.channel] = stamp_ns
            yield view.channel, _text(view.draw(self._views, value, stamp_ns))

    def still(self, stamp_ns: int, wanted: Wanted) -> Iterator[tuple[str, bytes]]:
        """Yield channel and JSON of what stays as it is; a map that cannot be read is left out."""
        for one in STILL:
            if not wanted(one.channel):
                continue
            try:
                yield one.channel, _text(one.draw(self._robot, stamp_ns))
            except NavigationError as error:
                _log.warning("degraded: no %s: %s", one.channel, error)

    def _is_due(self, view: View, stamp_ns: int) -> bool:
        """Tell whether a view's time has come; a clock that was set back begins anew."""
        gone_ns = stamp_ns - self._drawn_ns.get(view.channel, -NS_PER_S)
        return not 0 <= gone_ns < round(view.period_s * NS_PER_S)


def _text(drawn: object) -> bytes:
    return json.dumps(drawn, separators=(",", ":"), allow_nan=False).encode()
