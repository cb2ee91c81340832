"""Carry the camera's faults from the twin to the process that renders its frames."""

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, cast

from sim_twin.faults.injector import FaultInjector
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.faults.plug import Plug
from sim_twin.faults.vocabulary import Component
from sim_twin.pictures.head_camera import HeadCamera
from vla_deploy.robots import RobotDescription

if TYPE_CHECKING:
    from sim_twin.twin import Twin

NO_FAULTS = "[]"


def faults_in_force(injector: FaultInjector) -> str:
    """Return the camera's faults of this moment, one that comes and goes only while it is there."""
    if not injector.pending:
        return NO_FAULTS
    requests = [handle.request for handle in injector.pending if handle.is_on]
    return json.dumps(
        [
            {"fault": (each.of or each.fault).value, "seed": each.timing.seed, **each.values}
            for each in requests
            if each.component is Component.CAMERA
        ]
    )


class CameraBench:
    """Be as much of a twin as the camera's effects touch."""

    def __init__(
        self,
        robot: RobotDescription,
        camera: HeadCamera,
        line: LineTamper,
        now_ns: Callable[[], int],
    ) -> None:
        self.robot = robot
        self.camera = camera
        self.camera_line = line
        self.plugs = {robot.camera.device: Plug()}
        self._now_ns = now_ns

    @property
    def now_ns(self) -> int:
        """Return the time of the newest state."""
        return self._now_ns()


class CameraFaults:
    """Put in force what the twin says is in force."""

    def __init__(self, bench: CameraBench) -> None:
        # The camera's effects touch no more of a twin than the bench has.
        self._injector = FaultInjector(cast("Twin", bench))
        self._in_force = NO_FAULTS

    def follow(self, in_force: str) -> None:
        """Take over the twin's word; most of the time nothing has changed."""
        if in_force == self._in_force:
            return
        self._in_force = in_force
        self._injector.clear_all()
        for fault in json.loads(in_force):
            self._injector.inject(Component.CAMERA, None, fault.pop("fault"), **fault)
