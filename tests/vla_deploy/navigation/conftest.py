"""An L-shaped flat with a pillar, and scans traced on its true outline, not on the map."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.navigation.localising.localisation import Localiser
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.maps.grid_map import GridMap

RESOLUTION_M: Final = 0.05
ORIGIN_M: Final = (-0.25, -0.25)
SCAN_NS: Final = 100_000_000
# Axis-parallel solid boxes: x0, y0, x1, y1 in metres.
SOLIDS: Final = (
    (-0.1, -0.1, 6.1, 0.0),
    (-0.1, 5.0, 6.1, 5.1),
    (-0.1, 0.0, 0.0, 5.0),
    (6.0, 0.0, 6.1, 5.0),
    (3.0, 0.0, 3.1, 2.0),
    (4.4, 3.6, 5.2, 4.4),
)


@dataclass(slots=True)
class TracedFlat:
    """Hold solids; a test may add some that the map does not know, or take some away."""

    solids: list[tuple[float, float, float, float]] = field(default_factory=lambda: list(SOLIDS))
    now_ns: int = 0

    def map(self, *, stretch: float = 1.0) -> GridMap:
        """Return the map of the solids; `stretch` above 1 tells larger cells than there are."""
        blocked = np.zeros((110, 130), dtype=np.bool_)
        for box in np.array(self.solids):
            x0, y0, x1, y1 = np.rint((box - np.tile(ORIGIN_M, 2)) / RESOLUTION_M).astype(int)
            blocked[y0:y1, x0:x1] = True
        return GridMap(resolution_m=stretch * RESOLUTION_M, origin_m=ORIGIN_M, blocked=blocked)

    def trace(self, pose: Pose2D) -> NDArray[np.float32]:
        """Cast 360 beams by the slab method."""
        solids = np.array(self.solids)
        angles = pose.yaw_rad + np.radians(np.arange(360))
        direction = np.column_stack((np.cos(angles), np.sin(angles)))
        direction[np.abs(direction) < 1e-9] = 1e-9
        start = np.array([pose.x_m, pose.y_m])
        low = (solids[None, :, :2] - start) / direction[:, None]
        high = (solids[None, :, 2:] - start) / direction[:, None]
        enter = np.minimum(low, high).max(axis=2)
        leave = np.maximum(low, high).min(axis=2)
        hit = np.where((enter < leave) & (enter > 0), enter, np.inf).min(axis=1)
        return np.where(np.isfinite(hit), hit, 0.0).astype(np.float32)

    def scan(self, pose: Pose2D, seed: int = 0, sigma_m: float = 0.005) -> NDArray[np.float32]:
        """Return what the lidar of a robot at rest tells."""
        ranges = self.trace(pose)
        noise = np.random.default_rng(seed).normal(0.0, sigma_m, len(ranges))
        return np.where(ranges > 0, ranges + noise, 0.0).astype(np.float32)

    def stand(self, localiser: Localiser, true: Pose2D, scans: int) -> list[bool]:
        """Let a robot stand there for some turns of the lidar; return which scans were used."""
        used = []
        for _ in range(scans):
            for _ in range(5):
                self.now_ns += SCAN_NS // 5
                localiser.predict(self.now_ns, Pose2D(0.0, 0.0, 0.0), 0.0)
            scan = self.scan(true, seed=self.now_ns // SCAN_NS)
            used.append(localiser.correct(scan, self.stamps()))
        return used

    def stamps(self) -> NDArray[np.int64]:
        """Return the present as the moment of every beam."""
        return np.full(360, self.now_ns, dtype=np.int64)


@pytest.fixture
def flat() -> TracedFlat:
    """Return the flat as its map shows it."""
    return TracedFlat()
