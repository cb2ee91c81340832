"""Tell control what the lidar sees where perception, which needs a camera, does not run."""

from drivers import registry
from drivers.clock import NS_PER_S
from drivers.lidar.base import Lidar
from drivers.opener import DeviceOpener
from vla_deploy.ipc import SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.robots import RobotDescription


class LidarNode:
    """Publish the scans of the robot's lidar by its real driver; it looks where the base does."""

    period_s = 0.02

    def __init__(
        self, context: NodeContext, robot: RobotDescription, devices: DeviceOpener
    ) -> None:
        """Open the lidar.

        Raises:
            DriverError: it is missing or busy.
        """
        line = devices.serial(robot.lidar.device)
        self._lidar: Lidar = registry.open_lidar(robot.lidar.model, line, context.clock)
        self._clock = context.clock
        self._space = SharedSpace(context.run_dir / "ipc", context.clock)
        self._scan = self._space.cell_writer("scan")

    def start(self) -> None:
        """Do nothing: what there is is open."""

    def step(self) -> None:
        """Publish the newest scan, if there is a new one.

        Raises:
            LinkLost: the line has gone.
        """
        scan = self._lidar.poll()
        if scan is not None:
            ages_s = (self._clock.now_ns() - scan.beam_stamp_ns) / NS_PER_S
            self._scan.put(range_m=scan.range_m, beam_age_s=ages_s)

    def stop(self) -> None:
        """Release the lidar."""
        self._lidar.close()
        self._space.close()
