"""What control knows of its surroundings in the twin: contact, clearance, keep-out, balance."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vla_deploy.control.judging.surroundings import SurroundingsWatch
from vla_deploy.control.motion.base_velocity import STANDING
from vla_deploy.control.motion.setpoint_rates import SetpointRates
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots.kinematics.model import full_positions

pytestmark = pytest.mark.timeout(180)

SWING = {"left_shoulder_pitch": 1.5, "left_elbow": 0.6}
BLOCKING_NM = 50.0
# Servos without an integral part run over the setpoint that they stop at.
OVERSHOOT_M = 0.002
# What half of the contact's torque stretches a servo by, and friction.
SETTLES_RAD = 0.05
PRESSES_RAD = 0.07


def test_an_arm_that_swings_freely_feels_no_contact(armed: Any) -> None:
    armed.go(1, **SWING)
    armed.run(3.0)
    assert armed.state == "armed", armed.status["detail"]
    assert armed.joint("left_shoulder_pitch") == pytest.approx(1.5, abs=0.05)


def test_an_arm_that_is_blocked_on_its_way_stops_before_its_following_error(armed: Any) -> None:
    armed.go(1, **SWING)
    assert armed.lockstep.run_until(lambda: armed.joint("left_shoulder_pitch") > 0.7, 3.0)
    model = armed.lockstep.twin.engine.model
    model.dof_frictionloss[model.joint("left_shoulder_pitch").dofadr[0]] = BLOCKING_NM
    armed.run(1.0)
    assert armed.state == "stopped"
    assert armed.status["cause"] == "collision"
    assert armed.joint("left_shoulder_pitch") < 1.4


def test_an_arm_that_a_contact_stopped_presses_no_more_and_is_reset(armed: Any) -> None:
    armed.go(1, **SWING)
    assert armed.lockstep.run_until(lambda: armed.joint("left_shoulder_pitch") > 0.7, 3.0)
    model = armed.lockstep.twin.engine.model
    blocked = model.joint("left_shoulder_pitch").dofadr[0]
    freely_nm = model.dof_frictionloss[blocked]
    model.dof_frictionloss[blocked] = BLOCKING_NM
    armed.run(1.0)
    assert armed.status["cause"] == "collision"
    armed.run(1.5)
    freed_from = armed.joint("left_shoulder_pitch")
    assert abs(armed.joint("left_shoulder_pitch", "setpoint") - freed_from) < SETTLES_RAD
    assert armed.joint("left_shoulder_pitch", "setpoint") > freed_from  # no further than to there
    armed.ask("reset", "arm")
    assert armed.state == "armed", armed.status["detail"]
    model.dof_frictionloss[blocked] = freely_nm
    armed.run(1.0)
    assert armed.joint("left_shoulder_pitch") == pytest.approx(freed_from, abs=SETTLES_RAD)


def test_an_arm_that_pressed_when_control_died_is_taken_over_by_a_reset(armed: Any) -> None:
    def lead() -> float:
        pitch = armed.joint("left_shoulder_pitch")
        return float(armed.joint("left_shoulder_pitch", "setpoint") - pitch)

    armed.go(1, **SWING)
    assert armed.lockstep.run_until(lambda: armed.joint("left_shoulder_pitch") > 0.7, 3.0)
    model = armed.lockstep.twin.engine.model
    model.jnt_range[model.joint("left_shoulder_pitch").id][1] = armed.joint("left_shoulder_pitch")
    assert armed.lockstep.run_until(lambda: lead() > PRESSES_RAD, 0.5)
    assert armed.state == "armed"  # the contact has not lasted long enough to count as one
    armed.lockstep.kill(armed.control)
    armed.run(0.5)
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("fault", "collision")
    stands_at = armed.joint("left_shoulder_pitch")
    armed.ask("reset", within_s=1.0)
    armed.ask("arm")
    assert armed.state == "armed", armed.status["detail"]
    assert armed.joint("left_shoulder_pitch") == pytest.approx(stands_at, abs=SETTLES_RAD)
    assert abs(lead()) < 0.01


def block_a_swing(armed: Any) -> None:
    """Let the left arm swing against a stop that gives no way."""
    armed.go(1, **SWING)
    assert armed.lockstep.run_until(lambda: armed.joint("left_shoulder_pitch") > 0.7, 3.0)
    model = armed.lockstep.twin.engine.model
    model.jnt_range[model.joint("left_shoulder_pitch").id][1] = armed.joint("left_shoulder_pitch")


def test_an_arm_that_presses_eases_off_after_an_emergency_stop_too(armed: Any) -> None:
    block_a_swing(armed)
    armed.run(0.04)
    armed.publish("estop")
    armed.run(5.0)
    assert (armed.state, armed.status["cause"]) == ("stopped", "estop")
    pitch = armed.joint("left_shoulder_pitch")
    assert armed.joint("left_shoulder_pitch", "setpoint") - pitch < 0.03
    armed.ask("reset")
    armed.ask("arm")
    assert armed.state == "armed", armed.status["detail"]


def test_an_arm_with_a_limp_joint_eases_nothing_off(armed: Any) -> None:
    block_a_swing(armed)
    assert armed.lockstep.run_until(lambda: armed.status["cause"] == "collision", 1.0)
    armed.lockstep.faults.inject("servo", "left_elbow", "overheat")
    armed.run(0.5)
    stands_at = armed.joint("left_shoulder_pitch", "setpoint")
    assert stands_at - armed.joint("left_shoulder_pitch") > SETTLES_RAD  # it presses
    armed.run(2.0)
    assert armed.joint("left_shoulder_pitch", "setpoint") == stands_at


def test_a_disarm_right_after_a_reset_leaves_no_joint_with_power(armed: Any) -> None:
    block_a_swing(armed)
    armed.run(0.06)
    armed.lockstep.kill(armed.control)
    armed.run(0.5)
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    assert armed.status["cause"] == "collision"
    armed.ask("reset", "disarm", within_s=1.0)
    bank = armed.lockstep.twin.serial_devices["servos"]
    servos = armed.robot.servo_bus.servos
    assert {bank.register(servo.id, "torque_enable") for servo in servos} == {0}


def test_a_stop_for_another_cause_moves_no_setpoint_back(armed: Any) -> None:
    armed.go(1, **SWING)
    armed.run(0.6)
    armed.lockstep.faults.inject("servo_bus", None, "stuck")
    assert armed.lockstep.run_until(lambda: armed.state == "stopped", 1.5)
    assert armed.status["cause"] == "following_error"
    before = armed.joint("left_shoulder_pitch", "setpoint")
    armed.run(1.0)
    assert armed.joint("left_shoulder_pitch", "setpoint") == before


def test_an_arm_on_its_way_into_the_body_is_stopped_where_they_touch_at_most(armed: Any) -> None:
    shapes = armed.control._judging._surroundings._body
    apart = shapes.distances(armed.column("position"))[0] > 0.02  # the right hand lies on the base
    least_m, causes = np.inf, set()
    inward = {"left_shoulder_yaw": -1.17, "left_shoulder_pitch": 1.2, "left_elbow": 1.5}
    armed.go(1, **inward)
    for _ in range(100):
        armed.run(0.02)
        causes.add(armed.status["cause"])
        gaps_m = shapes.distances(armed.column("position"))[0]
        least_m = min(least_m, float(gaps_m[apart].min()))
    assert "self_collision" in causes
    assert least_m > armed.robot.protection.clearance.self_m - OVERSHOOT_M


def test_arms_that_lie_on_the_base_are_armed_and_leave_it_without_a_stop(armed: Any) -> None:
    shapes = armed.control._judging._surroundings._body
    assert shapes.distances(armed.column("position"))[0].min() < 0.001
    armed.go(1, **armed.robot.poses["tuck"])
    causes = set()
    for _ in range(200):
        armed.run(0.02)
        causes.add(armed.status["cause"])
    assert causes == {""}
    assert shapes.distances(armed.column("position"))[0].min() > 0.02


def test_setpoint_rates_are_differences_and_begin_at_zero() -> None:
    rates = SetpointRates()
    velocity, acceleration = rates.rates(0, np.array([1.0]))
    assert (velocity[0], acceleration[0]) == (0.0, 0.0)
    velocity, acceleration = rates.rates(20_000_000, np.array([1.01]))
    assert (velocity[0], acceleration[0]) == (pytest.approx(0.5), pytest.approx(25.0))
    velocity, _ = rates.rates(900_000_000, np.array([2.0]))
    assert velocity[0] == 0.0


@pytest.fixture
def watch(rig: Any) -> Any:
    clock = rig.lockstep.clock
    made = SurroundingsWatch(SharedSpace(rig.lockstep.context.run_dir / "ipc", clock), rig.robot)
    yield made
    made.close()


def refreshed(watch: SurroundingsWatch, rig: Any, position: np.ndarray, ticks: int = 45) -> Any:
    still = np.zeros_like(position)
    now_ns = rig.lockstep.clock.now_ns()
    for tick in range(ticks):
        known = watch.refresh(
            now_ns + tick * 4_000_000, position, still, still, position, STANDING, powered=True
        )
    return known


def in_area(rig: Any) -> dict[str, Any]:
    """Return a pose in the middle of the first keep-out area."""
    x_m, y_m = np.mean(rig.robot.home.zones[0].polygon_m, axis=0)
    told = {"x_m": x_m, "y_m": y_m, "yaw_rad": 0.0, "match_ratio": 1.0}
    return {**told, "covariance": (0.0,) * 9, "state": 0, "doubt": 0}


def test_each_part_gets_its_turn_and_tells_what_it_knows(watch: Any, rig: Any) -> None:
    space = SharedSpace(rig.lockstep.context.run_dir / "ipc", rig.lockstep.clock)
    space.cell_writer("pose").put(**in_area(rig))
    ahead = np.zeros(360, dtype=np.float32)
    ahead[:3] = 0.245
    space.cell_writer("scan").put(range_m=ahead, beam_age_s=())
    level = (0.0, 0.0, 9.81)
    space.cell_writer("imu").put(yaw_rad=0.0, pitch_rad=0.0, roll_rad=0.0, acceleration_m_s2=level)
    tuck = full_positions(rig.robot, list(rig.robot.poses["tuck"].items()))
    known = refreshed(watch, rig, tuck)
    assert known.keep_out is not None
    assert known.keep_out.name == rig.robot.home.zones[0].name
    assert [zone.name for zone in known.zones] == ["contact"]
    assert known.tip_margin_ratio is not None
    assert known.tip_margin_ratio > 0.7
    assert known.self_clearance is not None
    assert known.environment_clearance is not None
    assert known.external_torque_nm is not None
    assert known.workspace is None
    assert known.scan_age_s is not None
    assert known.depth_age_s is None


def test_stale_topics_are_no_knowledge_but_of_their_age(watch: Any, rig: Any) -> None:
    space = SharedSpace(rig.lockstep.context.run_dir / "ipc", rig.lockstep.clock)
    space.cell_writer("imu").put(
        yaw_rad=0.0, pitch_rad=0.0, roll_rad=0.0, acceleration_m_s2=(0.0, 0.0, 9.81)
    )
    tuck = full_positions(rig.robot, list(rig.robot.poses["tuck"].items()))
    space.cell_writer("near_obstacles").put(count=1, period_s=0.2, x_m=(0.2,), y_m=(0.0,), z_m=())
    space.cell_writer("pose").put(**in_area(rig))
    known = refreshed(watch, rig, tuck)
    assert known.tip_margin_ratio is not None
    assert known.keep_out is not None
    assert [zone.name for zone in known.zones] == ["overhang"]
    assert max(known.imu_age_s, known.depth_age_s, known.pose_age_s) < 0.2
    assert known.depth_due_s == pytest.approx(0.6)
    rig.lockstep.run_for(1.1)
    known = refreshed(watch, rig, tuck)
    assert (known.tip_margin_ratio, known.keep_out, known.zones) == (None, None, ())
    assert min(known.imu_age_s, known.depth_age_s, known.pose_age_s) > 1.0


def test_a_beam_on_the_own_arm_is_no_obstacle(rig: Any) -> None:
    space = SharedSpace(rig.lockstep.context.run_dir / "ipc", rig.lockstep.clock)
    robot = replace(rig.robot)
    watch = SurroundingsWatch(space, robot)
    hanging = full_positions(robot, [("left_shoulder_yaw", 0.0), ("left_shoulder_pitch", 0.0)])
    centres, _ = watch._body.balls(hanging)
    low = centres[np.abs(centres[:, 2] - 0.19).argmin()]
    bearing = round(np.degrees(np.arctan2(low[1], low[0]))) % 360
    scan = np.zeros(360, dtype=np.float32)
    scan[bearing - 1 : bearing + 2] = float(np.hypot(low[0], low[1]))
    space.cell_writer("scan").put(range_m=scan, beam_age_s=())
    assert refreshed(watch, rig, hanging).zones == ()
    assert abs(low[2] - 0.19) < 0.05
    watch.close()
