"""Compare how scans are fitted to the map with small_gicp, from the same wrong guesses.

The robot stands anywhere in the twin's flat, with objects around that the map does not know. Each
matcher gets the same scan and a pose that is wrong by up to 0.15 m along each axis and 8 degrees,
and is judged by the truth. small_gicp works in three dimensions: walls and scan get a height, so
that they are planes. It has no wheel for aarch64, so it is no part of the robot; without it (`pip
install small_gicp`) its rows are missing.
"""

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.command import parser, show
from benchmarks.kidnapping import CLEARANCE_M, somewhere
from benchmarks.pushed_robot import PushedRobot
from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.navigation.localising.scan import ScanPoints, placed_beams
from vla_deploy.navigation.localising.scan_match import INLIER_M, fit
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import load_robot
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D
from vla_deploy.robots.maps.grid_map import GridMap, load_map

Points = NDArray[np.float64]
Matcher = Callable[[ScanPoints, Pose2D], Pose2D]

OFF_M: Final = 0.15
OFF_RAD: Final = math.radians(8.0)
LIDAR_SIGMA_M: Final = 0.02
HEIGHTS_M: Final = (-0.05, 0.0, 0.05)
FAILED_M: Final = 0.1
KINDS: Final = ("ICP", "PLANE_ICP", "GICP")


def measure(robot_name: str = "butler", places: int = 200, seed: int = 3) -> dict[str, Any]:
    """Return each matcher's errors and CPU time."""
    robot = load_robot(robot_name)
    grid = load_map(robot.home.map_path)
    matchers = {"own": _own(grid), **_peers(grid)}
    errors: dict[str, list[tuple[float, float, float]]] = {name: [] for name in matchers}
    moved = PushedRobot(robot, seed=seed, lidar_sigma_m=LIDAR_SIGMA_M)
    planner, random = PathPlanner(grid, CLEARANCE_M), np.random.default_rng(seed)
    for _ in range(places):
        moved.carry_to(somewhere(planner, random))
        scan, truth = _scanned(moved), moved.pose
        off = random.uniform(-1.0, 1.0, 3) * (OFF_M, OFF_M, OFF_RAD)
        guess = Pose2D(truth.x_m + off[0], truth.y_m + off[1], truth.yaw_rad + off[2])
        for name, matcher in matchers.items():
            began_s = time.thread_time()
            found = matcher(scan, guess)
            spent_s = time.thread_time() - began_s
            errors[name].append((found.distance_m(truth), found.turn_rad(truth), spent_s))
    return {"places": places, **{name: _row(rows) for name, rows in errors.items()}}


def _row(rows: Sequence[tuple[float, float, float]]) -> dict[str, float]:
    away_m, turn_rad, spent_s = np.array(rows).T
    return {
        "median_m": round(float(np.median(away_m)), 4),
        "p95_m": round(float(np.percentile(away_m, 95)), 4),
        "failed_ratio": round(float(np.mean(away_m > FAILED_M)), 4),
        "median_deg": round(math.degrees(float(np.median(turn_rad))), 3),
        "cpu_ms": round(1e3 * float(np.median(spent_s)), 2),
    }


def _scanned(moved: PushedRobot) -> ScanPoints:
    """Return what a whole turn of the lidar meets, in the frame of the robot, which stands."""
    scans = 0
    while True:
        reading = moved.read()
        scans += reading.scan is not None
        if reading.scan is not None and scans == 2:  # the first began before the robot stood here
            scan = reading.scan
            return placed_beams(DeadReckoning(), ORIGIN, scan.range_m, scan.beam_stamp_ns)


def _own(grid: GridMap) -> Matcher:
    field = DistanceField.of(grid)

    def match(scan: ScanPoints, guess: Pose2D) -> Pose2D:
        return fit(field, scan.placed(guess), guess).pose

    return match


def _peers(grid: GridMap) -> Mapping[str, Matcher]:
    try:
        import small_gicp
    except ImportError:
        return {}
    walls = _raised(_surfaces(grid))
    return {f"small_gicp_{kind.lower()}": _peer(small_gicp, walls, kind) for kind in KINDS}


def _peer(small_gicp: ModuleType, walls: Points, kind: str) -> Matcher:
    target, tree = small_gicp.preprocess_points(walls, downsampling_resolution=0.01, num_threads=1)

    def match(scan: ScanPoints, guess: Pose2D) -> Pose2D:
        source, _ = small_gicp.preprocess_points(
            _raised(scan.ends), downsampling_resolution=0.01, num_threads=1
        )
        result = small_gicp.align(
            target,
            source,
            tree,
            init_T_target_source=_matrix(guess),
            registration_type=kind,
            max_correspondence_distance=INLIER_M,
            num_threads=1,
        )
        moved = result.T_target_source
        yaw_rad = math.atan2(moved[1, 0], moved[0, 0])
        return Pose2D(float(moved[0, 3]), float(moved[1, 3]), yaw_rad)

    return match


def _surfaces(grid: GridMap) -> Points:
    """Return the middle of each face between a wall's cell and a free one, (n, 2)."""
    walls = grid.walls
    rows, columns = np.nonzero(walls[:, 1:] != walls[:, :-1])
    upright = np.column_stack((columns + 1.0, rows + 0.5))
    rows, columns = np.nonzero(walls[1:] != walls[:-1])
    level = np.column_stack((columns + 0.5, rows + 1.0))
    faces: Points = np.vstack((upright, level)) * grid.resolution_m + grid.origin_m
    return faces


def _raised(points: Points) -> Points:
    layers = [np.column_stack((points, np.full(len(points), height))) for height in HEIGHTS_M]
    return np.vstack(layers)


def _matrix(pose: Pose2D) -> Points:
    c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return np.array(
        [[c, -s, 0.0, pose.x_m], [s, c, 0.0, pose.y_m], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("scan_matching", __doc__)
    arguments.add_argument("--robot", default="butler")
    arguments.add_argument("--places", type=int, default=200)
    arguments.add_argument("--seed", type=int, default=3)
    options = arguments.parse_args(argv)
    show(measure(options.robot, options.places, options.seed), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
