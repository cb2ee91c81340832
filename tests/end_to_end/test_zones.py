"""Something stands in the way, and only the zones can know: judged by MuJoCo's own distances."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from platforms import load_profile
from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.perception.node import PerceptionNode

pytestmark = [pytest.mark.gl, pytest.mark.timeout(120)]

CRUISE_M_S = 0.45
STANDSTILL_M_S = 0.01


class Holder:
    """Hold a thing in the air: a referee's hand that no sensor sees."""

    period_s = 0.004

    def __init__(self, course: "Course", body: str, x_m: float, z_m: float) -> None:
        self._place = lambda: course.engine.place(body, x_m, course.y_m, z_m, 0.0)

    def start(self) -> None:
        self._place()

    def step(self) -> None:
        self._place()

    def stop(self) -> None:
        pass


class Course:
    """Drive straight ahead through the flat with control and perception alone, no executor."""

    def __init__(self, run_dir: Path) -> None:
        self.rig = LockstepControl(run_dir)
        self.lockstep = self.rig.lockstep
        self.engine = self.lockstep.twin.engine
        perception = PerceptionNode(
            self.lockstep.context, self.rig.robot, load_profile("desktop"), self.lockstep.devices
        )
        self.lockstep.add(perception)
        self.rig.arm()
        self.rig.go({"head_pan": 0.0, "head_tilt": 0.3})
        self.lockstep.run_for(1.0)
        self.y_m = self.rig.robot.start_pose.y_m

    @property
    def x_m(self) -> float:
        return float(self.engine.data.body("base").xpos[0])

    @property
    def speed_m_s(self) -> float:
        return float(self.engine.data.body("base").cvel[3])

    def gap_m(self, body: str) -> float:
        """Return the distance of the robot's base from a thing, as MuJoCo has it."""
        model, data = self.engine.model, self.engine.data
        ours = _solid_geoms(model, "base")
        theirs = _solid_geoms(model, body)
        line = np.zeros(6)
        return min(
            mujoco.mj_geomDistance(model, data, a, b, 2.0, line) for a in ours for b in theirs
        )

    def close(self) -> None:
        self.rig.close()


def _solid_geoms(model: mujoco.MjModel, body: str) -> list[int]:
    owner = model.body(body).id
    return [
        geom
        for geom in range(model.ngeom)
        if model.geom_bodyid[geom] == owner and model.geom_contype[geom]
    ]


@pytest.fixture
def course(tmp_path: Path) -> Iterator[Course]:
    made = Course(tmp_path)
    yield made
    made.close()


def test_what_the_lidar_sees_suddenly_at_cruising_speed_is_not_touched(course: Course) -> None:
    course.rig.drive_for(1.5, CRUISE_M_S)
    assert course.speed_m_s > 0.9 * CRUISE_M_S
    course.lockstep.add(Holder(course, "box", course.x_m + 0.24 + 0.40 + 0.116, 0.12))
    closest_m = course.gap_m("box")
    for _ in range(150):
        course.rig.drive_for(0.02, CRUISE_M_S)
        closest_m = min(closest_m, course.gap_m("box"))
    assert abs(course.speed_m_s) < STANDSTILL_M_S
    assert 0.0 < closest_m < 0.15
    assert course.rig.status()["cause"] == "obstacle_stop_zone"
    before_m = course.x_m
    course.rig.drive_for(1.0, -0.2)
    assert course.x_m < before_m - 0.1, "the way out is open"


def test_a_cup_on_the_floor_is_seen_from_afar_and_remembered_when_it_is_close(
    course: Course,
) -> None:
    course.engine.place("red_cup", course.x_m + 2.2, course.y_m + 0.05, 0.0475, 0.0)
    start_m = course.x_m
    closest_m = course.gap_m("red_cup")
    for _ in range(400):
        course.rig.drive_for(0.02, CRUISE_M_S)
        closest_m = min(closest_m, course.gap_m("red_cup"))
    assert course.x_m > start_m + 1.0
    assert abs(course.speed_m_s) < STANDSTILL_M_S
    assert closest_m > 0.0


def test_without_anything_in_the_way_cruising_is_not_restricted(course: Course) -> None:
    course.rig.drive_for(2.0, CRUISE_M_S)
    assert course.speed_m_s > 0.9 * CRUISE_M_S
    assert course.rig.status()["cause"] == ""
