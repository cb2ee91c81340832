"""Record a map from the topics of a robot that turns on the spot in the twin's flat."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.map_truth import compare_maps
from benchmarks.pushed_robot import PushedRobot
from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.navigation.follower import Twist
from vla_deploy.navigation.map_file import read_map_file
from vla_deploy.navigation.place_judge import PlaceState
from vla_deploy.perception.map_recorder import MapRecorder
from vla_deploy.robots import load_robot

ROBOT = load_robot("butler")


class Telling:
    """Put what the sensors tell onto the topics, as control and perception do."""

    def __init__(self, tmp_path: Path) -> None:
        self.moved = PushedRobot(ROBOT, seed=3, slip_ratio=0.02)
        self.space = SharedSpace(tmp_path / "ipc", self.moved)
        names = ("base_state", "imu", "scan", "pose")
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
