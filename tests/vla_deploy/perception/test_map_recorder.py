"""Record a map from the topics of a robot that turns on the spot in the twin's flat."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.map_truth import compare_maps
from benchmarks.pushed_robot import PushedRobot
from drivers.camera.protocol import Intrinsics
from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.ipc import SharedSpace
from vla_deploy.navigation.follower import Twist
from vla_deploy.perception.geometry.lens import ray_table
from vla_deploy.perception.map_recorder import MapRecorder
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.camera import LensCalibration
from vla_deploy.robots.kinematics.model import RobotModel, full_positions
from vla_deploy.robots.maps.map_file import LOW_SHADE, read_map_file

ROBOT = load_robot("butler")
BENT = replace(ROBOT.camera.pinhole, distortion=(-0.31, 0.11, 0.0009, -0.0013, -0.02))
NOT_LOOKED_AT = ("velocity", "setpoint", "effort_ratio", "age_s", "error", "torque_enabled")
CABINET_X_M, CABINET_HALF_M, CABINET_TOP_M = 1.2, 0.75, 1.2
Floats = NDArray[np.float64]


def with_lens(camera: Intrinsics) -> RobotDescription:
    lens = LensCalibration(
        intrinsics=camera,
        distortion_model="plumb_bob",
        reprojection_error_px=0.2,
        views=20,
        made_at="2026-07-01",
        tool="a checkerboard",
    )
    camera = replace(ROBOT.camera, lens=lens)
    return replace(ROBOT, parts=replace(ROBOT.parts, camera=camera))


def sight_of_a_cabinet(camera: Intrinsics, base_from_camera: Floats) -> NDArray[np.uint16]:
    """Return the depths in millimetres of a cabinet's front in the base frame, and of the floor."""
    ahead: Floats = np.ones((camera.height, camera.width, 3))
    ahead[..., :2] = ray_table(camera)
    ways, eye = ahead @ base_from_camera[:3, :3].T, base_from_camera[:3, 3]
    to_front = (CABINET_X_M - eye[0]) / ways[..., 0]
    at = eye + to_front[..., None] * ways
    is_front = (np.abs(at[..., 1]) < CABINET_HALF_M) & (at[..., 2] < CABINET_TOP_M)
    falls = ways[..., 2] < -0.01
    to_floor = np.where(falls, -eye[2] / np.where(falls, ways[..., 2], -1.0), 0.0)
    depth_m = np.where(is_front & (at[..., 2] > 0.0) & (to_front > 0.0), to_front, to_floor)
    millimetres: NDArray[np.uint16] = np.rint(np.clip(1000 * depth_m, 0, 65_535)).astype("<u2")
    return millimetres


class Telling:
    """Put what the sensors tell onto the topics, as control and perception do."""

    def __init__(self, tmp_path: Path) -> None:
        self.moved = PushedRobot(ROBOT, seed=3, slip_ratio=0.02)
        self.space = SharedSpace(tmp_path / "ipc", self.moved)
        names = ("base_state", "imu", "scan", "pose")
        self._joints = self.space.cell_writer("joint_state")
        self._images = self.space.frame_writer("rgbd")
        self._writers = {name: self.space.cell_writer(name) for name in names}

    def tell_pose(self, state: PlaceState) -> None:
        pose = self.moved.pose
        self._writers["pose"].put(
            x_m=pose.x_m,
            y_m=pose.y_m,
            yaw_rad=pose.yaw_rad,
            match_ratio=1.0,
            covariance=(0.0,) * 9,
            state=state,
            doubt=0,
        )

    def tell_image(self, depth_mm: NDArray[np.uint16]) -> None:
        positions = full_positions(ROBOT)
        rest = dict.fromkeys(NOT_LOOKED_AT, np.zeros(len(positions)))
        self._joints.put(joint_count=len(positions), position=positions, **rest)
        height, width = depth_mm.shape
        payload = bytes(3 * depth_mm.size) + depth_mm.tobytes()
        self._images.put(payload, width=width, height=height, stamp_ns=self.moved.now)

    def run(self, recorder: MapRecorder, seconds: float, twist: Twist) -> None:
        for _ in range(round(seconds / 0.02)):
            reading = self.moved.read(twist)
            told = reading.odometry
            level = (0.0, 0.0, 9.81)
            self._writers["imu"].put(
                yaw_rad=reading.imu_yaw_rad, pitch_rad=0.0, roll_rad=0.0, acceleration_m_s2=level
            )
            self._writers["base_state"].put(
                x_m=told.x_m,
                y_m=told.y_m,
                yaw_rad=told.yaw_rad,
                v_m_s=twist.v_m_s,
                w_rad_s=twist.w_rad_s,
                enabled=1,
            )
            if reading.scan is not None:
                ages_s = (self.moved.now - reading.scan.beam_stamp_ns) / NS_PER_S
                self._writers["scan"].put(range_m=reading.scan.range_m, beam_age_s=ages_s)
            recorder.step()


@pytest.fixture
def telling(tmp_path: Path) -> Iterator[Telling]:
    told = Telling(tmp_path)
    yield told
    told.space.close()


def test_a_robot_that_knows_its_place_draws_the_new_map_over_the_old_one(telling: Telling) -> None:
    telling.tell_pose(PlaceState.TRACKING)
    recorder = MapRecorder(ROBOT, telling.space)
    assert recorder.on_old_frame
    telling.run(recorder, 1.0, Twist(0.0, 0.0))
    telling.run(recorder, 4.0, Twist(0.0, 0.8))
    found = compare_maps(recorder.mapper.grid.map_file(), read_map_file(ROBOT.home.map_path))
    assert found["observed_cells"] > 5000
    assert found["right_ratio"] > 0.97


def test_a_lost_robot_draws_its_map_from_where_it_stands(telling: Telling) -> None:
    telling.tell_pose(PlaceState.LOST)
    recorder = MapRecorder(ROBOT, telling.space)
    assert not recorder.on_old_frame
    telling.run(recorder, 1.0, Twist(0.0, 0.0))
    assert recorder.mapper.scans > 5
    assert recorder.mapper.pose.x_m == pytest.approx(0.0, abs=0.01)


def low_cells(recorder: MapRecorder) -> Floats:
    """Return where the depth camera drew something, as the base sees it at the start."""
    found = recorder.mapper.grid.map_file()
    rows, columns = np.nonzero(np.flipud(found.shades) == LOW_SHADE)
    cells: Floats = np.column_stack((columns, rows)).astype(np.float64)
    cells *= found.resolution_m
    cells += found.origin_m
    return cells


@pytest.mark.parametrize("scale", [1, 2], ids=["as calibrated", "of half the size"])
def test_what_the_depth_camera_draws_stands_where_the_lens_saw_it(
    telling: Telling, scale: int
) -> None:
    telling.tell_pose(PlaceState.LOST)
    robot = with_lens(BENT)
    recorder = MapRecorder(robot, telling.space)
    telling.run(recorder, 0.5, Twist(0.0, 0.0))
    seen_by = BENT if scale == 1 else smaller(ROBOT.camera.pinhole, scale)
    pose = RobotModel(robot).camera_pose(full_positions(robot))
    telling.tell_image(sight_of_a_cabinet(seen_by, pose))
    telling.run(recorder, 0.02, Twist(0.0, 0.0))
    drawn = low_cells(recorder)
    assert len(drawn) >= 2 * CABINET_HALF_M / 0.05 - 2
    assert np.all(np.abs(drawn[:, 0] - CABINET_X_M) <= 0.1)
    assert np.abs(drawn[:, 1]).max() == pytest.approx(CABINET_HALF_M, abs=0.06)


def smaller(camera: Intrinsics, scale: int) -> Intrinsics:
    width, height = camera.width // scale, camera.height // scale
    return replace(
        camera,
        width=width,
        height=height,
        fx=camera.fx / scale,
        fy=camera.fy / scale,
        cx=(width - 1) / 2,
        cy=(height - 1) / 2,
    )
