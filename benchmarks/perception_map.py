"""Measure how well the robot knows where it is, finds itself again, and draws a map.

The robot is moved through the twin's flat without physics; lidar and IMU are the twin's emulated
devices with the robot's own drivers, and the wheels slip. In one run of the same readings:

- `tour`: error of the pose on a long way, beside wheels alone, wheels with IMU, and the localiser
  with a fixed gain that went before; CPU time per scan; how often the covariance covers the error;
- `kidnapping`: the robot is put anywhere, with the objects where the seed puts them: the share that
  found itself, that said it was lost, and that was wrong while it said that it knew. Then the same
  with things around it that the map does not know;
- `mapping`: a map drawn on the same tour without any map, cell by cell against the world's.
"""

import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.command import parser, show
from benchmarks.fixed_gain_localiser import FixedGainLocaliser
from benchmarks.kidnapping import CLEARANCE_M, kidnap
from benchmarks.map_truth import compare_maps
from benchmarks.pushed_robot import PushedRobot, tour
from drivers.lidar.base import Scan
from vla_deploy.client.place_state import PlaceState
from vla_deploy.navigation.follower import DriveLimits
from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.navigation.localising.localisation import Localiser
from vla_deploy.navigation.maps.mapping import Mapper
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.maps.grid_map import GridMap, load_map, with_zones
from vla_deploy.robots.maps.map_file import read_map_file

SLIP_RATIO: Final = 0.02
LIDAR_SIGMA_M: Final = 0.02
CHI2_95_OF_3: Final = 7.815


Ranges = NDArray[np.float32]
Stamps = NDArray[np.int64]


@dataclass(slots=True)
class _Track:
    """Gather the errors of one estimator."""

    pose: Callable[[], Pose2D]
    errors_m: list[float] = field(default_factory=list)
    errors_rad: list[float] = field(default_factory=list)

    def note(self, truth: Pose2D) -> None:
        pose = self.pose()
        self.errors_m.append(pose.distance_m(truth))
        self.errors_rad.append(pose.turn_rad(truth))

    def row(self) -> dict[str, float]:
        away_m = np.array(self.errors_m)
        away_deg = np.degrees(self.errors_rad)
        return {
            "median_m": round(float(np.median(away_m)), 4),
            "p95_m": round(float(np.percentile(away_m, 95)), 4),
            "end_m": round(float(away_m[-1]), 4),
            "median_deg": round(float(np.median(away_deg)), 3),
            "p95_deg": round(float(np.percentile(away_deg, 95)), 3),
        }


def measure(
    robot_name: str = "butler", length_m: float = 60.0, kidnappings: int = 40, seed: int = 1
) -> dict[str, Any]:
    """Return the figures of tour, kidnappings and mapping."""
    # As the perception process does.
    cv2.setNumThreads(1)
    robot = load_robot(robot_name)
    grid = load_map(robot.home.map_path)

    def moved(seed: int) -> PushedRobot:
        return PushedRobot(robot, seed=seed, slip_ratio=SLIP_RATIO, lidar_sigma_m=LIDAR_SIGMA_M)

    return {
        "seed": seed,
        "slip_ratio": SLIP_RATIO,
        "lidar_sigma_m": LIDAR_SIGMA_M,
        **_measure_tour(moved(seed), robot, grid, length_m),
        "kidnapping": kidnap(moved(seed), grid, kidnappings, seed, crowded=False),
        "kidnapping_crowded": kidnap(moved(seed + 1), grid, kidnappings, seed + 1, crowded=True),
    }


def _measure_tour(
    moved: PushedRobot, robot: RobotDescription, grid: GridMap, length_m: float
) -> dict[str, Any]:
    start = moved.pose
    localiser, peer = Localiser(start, grid), FixedGainLocaliser(start, grid)
    reckoned, mapper, wheels = DeadReckoning(), Mapper(start), [start]
    tracks = {
        "localiser": _Track(lambda: localiser.pose),
        "fixed_gain": _Track(lambda: peer.pose),
        "wheels_and_imu": _Track(lambda: start.compose(reckoned.pose)),
        "wheels": _Track(lambda: wheels[0]),
        "mapper": _Track(lambda: mapper.pose),
    }
    costs_s: dict[str, list[float]] = {"localiser": [], "fixed_gain": [], "mapper": []}
    covered, states = [], []
    for reading in _toured(moved, robot, grid, length_m):
        stamp_ns, odometry, yaw_rad = reading.stamp_ns, reading.odometry, reading.imu_yaw_rad
        for one in (localiser, peer, mapper):
            one.predict(stamp_ns, odometry, yaw_rad)
        reckoned.move(stamp_ns, odometry, yaw_rad)
        wheels[0] = start.compose(odometry)
        if reading.scan is not None:
            _timed(costs_s["localiser"], localiser.correct, reading.scan)
            _timed(costs_s["fixed_gain"], peer.correct, reading.scan)
            _timed(costs_s["mapper"], mapper.add_scan, reading.scan)
            covered.append(_is_covered(localiser, reading.truth))
        states.append(localiser.state)
        for track in tracks.values():
            track.note(reading.truth)
    return {
        "tour": {
            "length_m": length_m,
            **{name: track.row() for name, track in tracks.items()},
            "tracking_ratio": round(float(np.mean(np.array(states) == PlaceState.TRACKING)), 4),
            "covered_by_95_percent_ellipse": round(float(np.mean(covered)), 3),
            "cpu_ms_per_scan": {
                name: round(1e3 * float(np.median(costs)), 2) for name, costs in costs_s.items()
            },
        },
        "mapping": compare_maps(mapper.grid.map_file(), read_map_file(robot.home.map_path)),
    }


def _toured(moved: PushedRobot, robot: RobotDescription, grid: GridMap, length_m: float) -> Any:
    base = robot.base
    limits = DriveLimits(
        speed_m_s=0.9 * base.max_speed_m_s,
        turn_rate_rad_s=0.9 * base.max_turn_rad_s,
        acceleration_m_s2=0.6 * base.max_acceleration_m_s2,
        turn_acceleration_rad_s2=0.6 * base.max_turn_acceleration_rad_s2,
    )
    planner = PathPlanner(with_zones(grid, robot.home.zones), CLEARANCE_M)
    stops = [place.pose for place in robot.places.values()]
    return tour(moved, planner, limits, stops, length_m)


def _timed(costs_s: list[float], take: Callable[[Ranges, Stamps], bool], scan: Scan) -> None:
    began_s = time.thread_time()
    take(scan.range_m, scan.beam_stamp_ns)
    costs_s.append(time.thread_time() - began_s)


def _is_covered(localiser: Localiser, truth: Pose2D) -> bool:
    pose = localiser.pose
    turn = math.remainder(pose.yaw_rad - truth.yaw_rad, math.tau)
    off = np.array([pose.x_m - truth.x_m, pose.y_m - truth.y_m, turn])
    return bool(off @ np.linalg.solve(localiser.covariance, off) < CHI2_95_OF_3)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("perception_map", __doc__)
    arguments.add_argument("--robot", default="butler")
    arguments.add_argument("--length", type=float, default=60.0, help="of the tour in metres")
    arguments.add_argument("--kidnappings", type=int, default=40)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args(argv)
    report = measure(options.robot, options.length, options.kidnappings, options.seed)
    show(report, as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
