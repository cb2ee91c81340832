"""Carry the robot off in the twin's flat: does it find itself, or say that it is lost?"""

import math
from typing import Any, Final

import numpy as np

from benchmarks.pushed_robot import PushedReading, PushedRobot
from vla_deploy.client.place_state import PlaceState
from vla_deploy.navigation.follower import Twist
from vla_deploy.navigation.localising.localisation import Localiser
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.maps.grid_map import GridMap

CLEARANCE_M: Final = 0.27
WRONG_M: Final = 0.3
WRONG_RAD: Final = math.radians(15.0)
# Whoever carries the robot off gives it this long to notice.
NOTICE_S: Final = 1.0
SEARCH_S: Final = 6.0
TURN_S: Final = 7.0
# Lidar beams that people and bags around a carried robot take away, as a share of the turn.
CROWDED_RATIO: Final = 0.3
READING_S: Final = 0.02


def kidnap(
    moved: PushedRobot, grid: GridMap, times: int, seed: int, *, crowded: bool
) -> dict[str, Any]:
    """Carry the robot off again and again; where it stays lost it is turned on the spot."""
    localiser, random = Localiser(moved.pose, grid), np.random.default_rng(seed)
    planner = PathPlanner(grid, CLEARANCE_M)
    endings = {"recovered": 0, "said_lost": 0, "unsure": 0, "wrong": 0}
    times_s = []
    for _ in range(times):
        hidden = _crowd(random) if crowded else np.zeros(360, dtype=np.bool_)
        moved.carry_to(somewhere(planner, random))
        watch = _Watch(moved, localiser, hidden, random)
        watch.look(SEARCH_S, Twist(0.0, 0.0))
        if localiser.state is not PlaceState.TRACKING:
            watch.look(TURN_S, Twist(0.0, 1.0))
        endings[watch.ending] += 1
        if watch.ending == "recovered":
            times_s.append(watch.found_s)
    ratios = {f"{name}_ratio": round(count / times, 4) for name, count in endings.items()}
    median_s = round(float(np.median(times_s)), 2) if times_s else None
    return {"times": times, **ratios, "recovery_median_s": median_s}


class _Watch:
    """Follow a localiser after a kidnapping, and compare what it says with the truth."""

    def __init__(
        self,
        moved: PushedRobot,
        localiser: Localiser,
        hidden: np.ndarray,
        random: np.random.Generator,
    ) -> None:
        self.found_s = math.nan
        self._moved, self._localiser = moved, localiser
        self._hidden, self._random = hidden, random
        self._since_s = 0.0
        self._was_wrong = False

    @property
    def ending(self) -> str:
        """Return what became of it."""
        if self._was_wrong:
            return "wrong"
        state = self._localiser.state
        names = {PlaceState.TRACKING: "recovered", PlaceState.LOST: "said_lost"}
        return names.get(state, "unsure")

    def look(self, duration_s: float, twist: Twist) -> None:
        """Go on for a while."""
        for _ in range(round(duration_s / READING_S)):
            reading = self._moved.read(twist)
            self._since_s += READING_S
            self._give(reading)
            if self._localiser.state is PlaceState.TRACKING and self._since_s > NOTICE_S:
                wrong = _is_wrong(self._localiser.pose, reading.truth)
                self._was_wrong = self._was_wrong or wrong
                if math.isnan(self.found_s):
                    self.found_s = self._since_s

    def _give(self, reading: PushedReading) -> None:
        localiser = self._localiser
        localiser.predict(reading.stamp_ns, reading.odometry, reading.imu_yaw_rad)
        if reading.scan is not None:
            near_m = self._random.normal(0.6, 0.02, 360).astype(np.float32)
            nearer = self._hidden & (reading.scan.range_m > near_m)
            ranges = np.where(nearer, near_m, reading.scan.range_m)
            localiser.correct(ranges, reading.scan.beam_stamp_ns)


def _is_wrong(pose: Pose2D, truth: Pose2D) -> bool:
    return pose.distance_m(truth) > WRONG_M or pose.turn_rad(truth) > WRONG_RAD


def _crowd(random: np.random.Generator) -> np.ndarray:
    """Return the beams that end at somebody close by: one to three sectors."""
    hidden = np.zeros(360, dtype=np.bool_)
    people = int(random.integers(1, 4))
    for start in random.integers(0, 360, people):
        hidden[(np.arange(round(360 * CROWDED_RATIO / people)) + start) % 360] = True
    return hidden


def somewhere(planner: PathPlanner, random: np.random.Generator) -> Pose2D:
    """Return a random pose in the flat where the robot may stand."""
    while True:
        x_m, y_m = random.uniform(0.0, 8.0), random.uniform(0.0, 6.0)
        if planner.is_free(x_m, y_m):
            return Pose2D(x_m, y_m, random.uniform(-math.pi, math.pi))
