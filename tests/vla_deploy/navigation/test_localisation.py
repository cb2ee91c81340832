import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.navigation.localising.localisation import Localiser
from vla_deploy.navigation.localising.place_judge import LOST_SIGMA_M
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D

if TYPE_CHECKING:
    from conftest import TracedFlat

HOME = Pose2D(1.5, 1.2, 0.4)
SETTLED_SCANS = 8


def error_of(localiser: Localiser, truth: Pose2D) -> tuple[float, float]:
    return localiser.pose.distance_m(truth), localiser.pose.turn_rad(truth)


def settled(flat: "TracedFlat", pose: Pose2D = HOME) -> Localiser:
    localiser = Localiser(pose, flat.map())
    flat.stand(localiser, pose, SETTLED_SCANS)
    assert localiser.state is PlaceState.TRACKING
    return localiser


def feed(localiser: Localiser, flat: "TracedFlat", ranges: NDArray[np.float32]) -> bool:
    """Give one scan, a turn of the lidar after the last."""
    flat.now_ns += 100_000_000
    localiser.predict(flat.now_ns, ORIGIN, 0.0)
    return localiser.correct(ranges, flat.stamps())


@pytest.mark.parametrize("true", [HOME, Pose2D(4.6, 1.5, -2.2)])
def test_a_wrong_start_is_corrected_by_standing_still(flat: "TracedFlat", true: Pose2D) -> None:
    localiser = Localiser(true.compose(Pose2D(0.12, -0.1, 0.09)), flat.map())
    assert (localiser.state, localiser.doubt) == (PlaceState.UNSURE, Doubt.STARTING)
    assert all(flat.stand(localiser, true, 20))
    position_m, yaw_rad = error_of(localiser, true)
    assert position_m < 0.015
    assert yaw_rad < 0.006
    assert localiser.match_ratio > 0.9
    assert localiser.state is PlaceState.TRACKING


def stays(localiser: Localiser, before: Pose2D) -> bool:
    """Return whether the pose is the same but for the IMU's drift, which is taken out all along."""
    return localiser.pose.distance_m(before) < 1e-6 and localiser.pose.turn_rad(before) < 1e-3


def scan_in_motion(
    flat: "TracedFlat", poses: Sequence[Pose2D], stamps: Sequence[int]
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return a scan and its beams' stamps; the lidar turns clockwise over the last five poses."""
    ranges, beam_stamps = np.zeros(360, np.float32), np.zeros(360, np.int64)
    for part in range(5):
        beams = np.arange(360)[(4 - part) * 72 : (5 - part) * 72]
        ranges[beams] = flat.trace(poses[part - 5])[beams]
        beam_stamps[beams] = stamps[part - 5]
    return ranges, beam_stamps


def drive(flat: "TracedFlat", *, correct: bool, seconds: float = 25.0) -> tuple[Localiser, Pose2D]:
    """Drive a closed curve with wheels 8 % too long and a drifting IMU; return what came of it."""
    localiser = Localiser(Pose2D(1.5, 1.5, 0.0), flat.map())
    true, odometry, imu_yaw = Pose2D(1.5, 1.5, 0.0), ORIGIN, 0.0
    step_s, poses, stamps = 0.02, [], []
    for tick in range(round(seconds / step_s)):
        turn = 0.9 * math.sin(0.5 * tick * step_s) * step_s
        true = true.compose(Pose2D(0.18 * step_s, 0.0, turn))
        odometry = odometry.compose(Pose2D(0.18 * 1.08 * step_s, 0.0, turn * 0.97))
        imu_yaw += turn + 0.002 * step_s
        now_ns = tick * 20_000_000
        poses.append(true)
        stamps.append(now_ns)
        localiser.predict(now_ns, odometry, imu_yaw)
        if correct and tick % 5 == 4:
            localiser.correct(*scan_in_motion(flat, poses, stamps))
    return localiser, true


def test_scans_take_out_the_drift_of_wheels_and_imu(flat: "TracedFlat") -> None:
    drifted_m, drifted_rad = error_of(*drive(flat, correct=False))
    assert drifted_m > 0.1
    assert drifted_rad > 0.04
    position_m, yaw_rad = error_of(*drive(flat, correct=True))
    assert position_m < 0.02
    assert yaw_rad < 0.01


def test_the_covariance_covers_the_error_and_grows_without_scans(flat: "TracedFlat") -> None:
    tracked, true = drive(flat, correct=True)
    blind, _ = drive(flat, correct=False)
    off = np.array([tracked.pose.x_m - true.x_m, tracked.pose.y_m - true.y_m])
    assert off @ np.linalg.solve(tracked.covariance[:2, :2], off) < 12.0
    assert np.trace(blind.covariance[:2, :2]) > 20 * np.trace(tracked.covariance[:2, :2])
    assert blind.state is not PlaceState.TRACKING


def test_a_corridor_says_nothing_about_the_way_along_it(flat: "TracedFlat") -> None:
    flat.solids = [(-20.0, -0.1, 20.0, 0.0), (-20.0, 1.2, 20.0, 1.3)]
    pose = Pose2D(2.0, 0.6, 0.0)
    localiser = Localiser(pose.compose(Pose2D(0.05, 0.05, 0.02)), flat.map())
    flat.stand(localiser, pose, 20)
    along_m2, across_m2 = np.diag(localiser.covariance)[:2]
    assert abs(localiser.pose.y_m - pose.y_m) < 0.01
    assert across_m2 < 0.015**2
    assert along_m2 > 0.05**2


def test_a_robot_that_was_carried_off_notices_and_finds_itself(flat: "TracedFlat") -> None:
    random = np.random.default_rng(4)
    localiser = settled(flat)
    for _ in range(6):
        x_m, y_m = random.choice(((1.5, 3.5), (2.3, 1.0), (4.5, 1.4), (5.5, 2.8), (3.5, 4.4)))
        true = Pose2D(float(x_m), float(y_m), float(random.uniform(-3.0, 3.0)))
        flat.stand(localiser, true, 4)
        assert localiser.state is not PlaceState.TRACKING or error_of(localiser, true)[0] < 0.1
        flat.stand(localiser, true, 60)
        assert localiser.state is PlaceState.TRACKING
        position_m, yaw_rad = error_of(localiser, true)
        assert position_m < 0.03
        assert yaw_rad < 0.02


def test_a_robot_between_places_that_look_alike_says_that_it_is_lost(flat: "TracedFlat") -> None:
    # Two rooms alike to the last detail: the same walls, turned by half a turn.
    flat.solids = [
        (0.0, 0.0, 6.0, 0.1),
        (0.0, 3.9, 6.0, 4.0),
        (0.0, 0.0, 0.1, 4.0),
        (5.9, 0.0, 6.0, 4.0),
        (2.9, 0.0, 3.1, 4.0),
        (1.0, 0.1, 1.5, 0.6),
        (4.5, 3.4, 5.0, 3.9),
    ]
    true = Pose2D(2.0, 2.5, 0.5)
    localiser = Localiser(Pose2D(4.4, 0.9, -1.0), flat.map())
    told = set()
    for _ in range(80):
        flat.stand(localiser, true, 1)
        told.add((localiser.state, localiser.doubt))
    assert (PlaceState.LOST, Doubt.AMBIGUOUS) in told
    assert PlaceState.TRACKING not in {state for state, _ in told}


def test_a_scan_that_does_not_fit_moves_nothing_and_many_make_the_robot_lost(
    flat: "TracedFlat",
) -> None:
    localiser = settled(flat)
    before = localiser.pose
    crowd = np.full(360, 0.6, dtype=np.float32)
    states = []
    for number in range(20):
        assert not feed(localiser, flat, crowd + np.float32(0.001 * (number % 2)))
        states.append(localiser.state)
    assert stays(localiser, before)
    assert states[1] is PlaceState.TRACKING
    assert states[3] is PlaceState.UNSURE
    assert states[-1] is PlaceState.LOST
    assert localiser.doubt is Doubt.POOR_MATCH


@pytest.mark.parametrize(
    "ranges",
    [
        np.zeros(360, np.float32),
        np.full(360, np.nan, np.float32),
        np.full(360, np.inf, np.float32),
        np.full(360, 65.535, np.float32),
        np.full(360, -1.0, np.float32),
        np.where(np.arange(360) < 40, 1.0, 0.0).astype(np.float32),
    ],
    ids=["zero", "nan", "inf", "maximum", "negative", "torn"],
)
def test_scans_that_tell_nothing_move_nothing_and_make_the_robot_unsure(
    flat: "TracedFlat", ranges: NDArray[np.float32]
) -> None:
    localiser = settled(flat)
    before = localiser.pose
    assert not any(feed(localiser, flat, ranges) for _ in range(15))
    assert stays(localiser, before)
    assert (localiser.state, localiser.doubt) == (PlaceState.UNSURE, Doubt.NO_SCAN)
    assert localiser.match_ratio == 0.0


def test_a_scan_that_repeats_itself_to_the_bit_is_not_the_present(flat: "TracedFlat") -> None:
    localiser = settled(flat)
    scan = flat.scan(HOME)
    used = [feed(localiser, flat, scan) for _ in range(20)]
    assert used[0]
    assert not used[-1]
    assert localiser.state is PlaceState.UNSURE


def test_people_around_the_robot_do_not_unsettle_it(flat: "TracedFlat") -> None:
    localiser = settled(flat)
    flat.solids += [(2.3, 1.0, 2.7, 1.4), (1.0, 2.2, 1.4, 2.6)]
    flat.stand(localiser, HOME, 20)
    assert localiser.state is PlaceState.TRACKING
    assert error_of(localiser, HOME)[0] < 0.02


def test_without_a_lidar_it_becomes_unsure_at_rest_and_lost_on_the_way(flat: "TracedFlat") -> None:
    localiser = settled(flat)
    for _ in range(100):
        flat.now_ns += 20_000_000
        localiser.predict(flat.now_ns, ORIGIN, 0.0)
    assert (localiser.state, localiser.doubt) == (PlaceState.UNSURE, Doubt.NO_SCAN)
    way_m = 0.0
    while localiser.state is not PlaceState.LOST:
        flat.now_ns += 20_000_000
        way_m += 0.01
        assert way_m < 2000.0
        localiser.predict(flat.now_ns, Pose2D(way_m, 0.0, 0.0), 0.0)
    assert localiser.doubt is Doubt.UNCERTAIN
    assert math.sqrt(np.linalg.eigvalsh(localiser.covariance[:2, :2])[-1]) > LOST_SIGMA_M


def test_a_map_of_wrong_scale_is_never_believed(flat: "TracedFlat") -> None:
    localiser = Localiser(HOME, flat.map(stretch=1.25))
    states = set()
    for _ in range(80):
        flat.stand(localiser, HOME, 1)
        states.add(localiser.state)
    assert PlaceState.TRACKING not in states
    assert localiser.doubt is Doubt.POOR_MATCH


def test_a_push_that_the_wheels_did_not_feel_is_followed(flat: "TracedFlat") -> None:
    localiser = settled(flat)
    pushed = HOME.compose(Pose2D(0.1, 0.12, 0.1))
    flat.stand(localiser, pushed, 30)
    assert localiser.state is PlaceState.TRACKING
    assert error_of(localiser, pushed)[0] < 0.02


def test_odometry_that_starts_anew_does_not_move_the_robot(flat: "TracedFlat") -> None:
    localiser = Localiser(Pose2D(1.0, 2.0, 0.5), flat.map())
    localiser.predict(0, Pose2D(3.0, 1.0, 0.2), None)
    localiser.predict(1, Pose2D(3.1, 1.0, 0.2), None)
    moved = localiser.pose
    localiser.predict(2, Pose2D(0.0, 0.0, 0.2), None)
    assert localiser.pose == moved


def test_past_poses_are_interpolated(flat: "TracedFlat") -> None:
    localiser = Localiser(Pose2D(1.0, 1.0, 0.0), flat.map())
    localiser.predict(0, Pose2D(0.0, 0.0, 0.0), 3.1)
    localiser.predict(100, Pose2D(0.1, 0.0, 0.0), -3.1)
    middle = localiser.pose_at(50)
    assert middle.x_m == pytest.approx(1.05)
    assert middle.yaw_rad == pytest.approx((2 * math.pi - 6.2) / 2, abs=1e-6)
    assert localiser.pose_at(-5).x_m == pytest.approx(1.0)
    assert localiser.pose_at(500) == localiser.pose


def test_a_yaw_that_runs_away_slowly_leads_the_heading_astray_by_little(flat: "TracedFlat") -> None:
    localiser = settled(flat)
    true, odometry, imu_yaw, worst_rad = HOME, ORIGIN, 0.0, 0.0
    poses, stamps = [HOME], [flat.now_ns]
    for tick in range(1, 70):
        turn = 1.25 * 0.02
        true, odometry = (one.compose(Pose2D(0.0, 0.0, turn)) for one in (true, odometry))
        imu_yaw += turn + 0.3 * 0.02
        poses.append(true)
        stamps.append(flat.now_ns + tick * 20_000_000)
        localiser.predict(stamps[-1], odometry, imu_yaw)
        if tick % 5 == 0:
            localiser.correct(*scan_in_motion(flat, poses, stamps))
            worst_rad = max(worst_rad, error_of(localiser, true)[1])
    assert worst_rad < 0.15
