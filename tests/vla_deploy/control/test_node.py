"""Run control against the twin in lock-step: arming, motion, stops, losses and restarts."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any
from typing import Any as Rig  # the class in conftest.py, which no test can import

import numpy as np
import pytest

from drivers.errors import DeviceMissing
from drivers.wheel_drives.bus import PowerState
from platforms import load_profile
from vla_deploy.control.output.payload import PRESS_M
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots.description import StopCategory
from vla_deploy.runtime.power_off import ask_power_off

ELBOW, PITCH = "left_elbow", "left_shoulder_pitch"
STANDSTILL_RAD_S = 0.02


def start_a_long_motion(rig: Rig, motion_id: int = 1) -> None:
    rig.go(motion_id, left_elbow=2.0, left_shoulder_pitch=0.8, head_pan=1.0)
    rig.run(0.5)
    assert rig.true_speeds().max() > 0.4


def stays_at_standstill(rig: Rig) -> None:
    for _ in range(50):
        assert rig.true_speeds().max() < STANDSTILL_RAD_S
        rig.run(0.02)


def test_it_starts_disarmed_and_powers_nothing(rig: Rig) -> None:
    rig.boot()
    assert rig.state == "disarmed"
    assert not rig.column("torque_enabled").any()
    assert rig.base()["enabled"] == 0.0


def test_arming_moves_no_joint(rig: Rig) -> None:
    rig.boot()
    before = rig.column("position")
    rig.ask("arm")
    assert rig.state == "armed"
    assert rig.column("torque_enabled").all()
    assert np.abs(rig.column("position") - before).max() < 0.005
    assert np.abs(rig.column("position") - rig.column("setpoint")).max() < 0.005


def test_a_goal_is_reached_and_reported(armed: Rig) -> None:
    armed.go(5, left_elbow=1.6, left_shoulder_pitch=0.4, left_gripper=0.03, head_pan=0.4)
    armed.run(3.0)
    assert armed.results() == [{"motion_id": 5, "status": "done", "reason": ""}]
    for name, target in (("left_elbow", 1.6), ("left_shoulder_pitch", 0.4), ("head_pan", 0.4)):
        assert armed.joint(name) == pytest.approx(target, abs=0.01)
    assert armed.joint("left_gripper") == pytest.approx(0.03, abs=0.001)


def test_a_held_arm_does_not_sag(armed: Rig) -> None:
    armed.go(1, left_shoulder_pitch=0.5, left_elbow=1.4)
    armed.run(2.0)
    armed.go(2, left_wrist_pitch=-0.4)
    armed.run(3.0)
    arm = [armed.robot.joint_index[name] for name in armed.robot.group("left_arm").joints]
    sag = armed.column("position") - armed.column("setpoint")
    assert np.abs(sag[arm]).max() < 0.012


def test_a_trajectory_is_followed(armed: Rig) -> None:
    start = armed.joint(ELBOW, "setpoint")
    points = [[start], [start + 0.2], [start + 0.5], [start + 0.4]]
    armed.send(
        kind="trajectory",
        motion_id=9,
        joints=[ELBOW],
        times_s=[0.0, 0.5, 1.2, 1.8],
        positions=points,
    )
    armed.run(1.2)
    assert armed.joint(ELBOW, "setpoint") == pytest.approx(start + 0.5, abs=0.02)
    armed.run(1.0)
    assert armed.results() == [{"motion_id": 9, "status": "done", "reason": ""}]
    assert armed.joint(ELBOW) == pytest.approx(start + 0.4, abs=0.01)


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ({"kind": "goal", "targets": {"nose": 1.0}, "speed_ratio": 1.0}, "no joint nose"),
        ({"kind": "goal", "targets": {ELBOW: 9.0}, "speed_ratio": 1.0}, "left_elbow: target 9"),
        ({"kind": "goal", "targets": {ELBOW: 1.0}, "speed_ratio": 0.0}, "speed_ratio"),
        ({"kind": "dance"}, "kind: expected"),
        (
            {"kind": "trajectory", "joints": [ELBOW], "times_s": [0, 1], "positions": [[9], [1]]},
            "left_elbow: start",
        ),
    ],
)
def test_a_bad_command_is_refused_with_its_reason(
    armed: Rig, command: dict[str, Any], reason: str
) -> None:
    armed.send(motion_id=3, **command)
    armed.run(0.05)
    (result,) = armed.results()
    assert (result["motion_id"], result["status"]) == (3, "refused")
    assert reason in result["reason"]
    assert armed.state == "armed"


def test_a_command_is_refused_while_disarmed(rig: Rig) -> None:
    rig.boot()
    rig.go(1, left_elbow=1.0)
    rig.run(0.1)
    (result,) = rig.results()
    assert (result["status"], result["reason"]) == ("refused", "control is disarmed: arm first")


def test_an_estop_ramps_the_setpoints_on_the_wire_within_two_ticks(armed: Rig) -> None:
    bank = armed.lockstep.twin.serial_devices["servos"]
    servo = next(s for s in armed.robot.servo_bus.servos if s.joint == ELBOW)
    limits, period_s = armed.robot.limits[ELBOW], armed.control.period_s

    def goals_rad(count: int) -> list[float]:
        seen = []
        for _ in range(count):
            armed.tick()
            seen.append(bank.register(servo.id, "goal_position") * 2.0 * np.pi / 4096.0)
        return seen

    armed.go(1, left_elbow=2.5)
    armed.run(0.55)
    cruise = goals_rad(10)
    assert (cruise[-1] - cruise[0]) / (9 * period_s) == pytest.approx(limits.velocity, rel=0.05)
    armed.ask("estop", within_s=0.0)
    ramp = goals_rad(250)
    ramp_s = limits.velocity / limits.acceleration + limits.acceleration / limits.jerk
    travel = limits.velocity * (0.5 * ramp_s + 2 * period_s)
    assert 0.9 * travel < ramp[-1] - cruise[-1] < travel + 0.005
    still = np.abs(np.diff(ramp[round(ramp_s / period_s) + 2 :]))
    assert still.max() < 0.002
    assert armed.state == "stopped"
    assert armed.true_speeds().max() < STANDSTILL_RAD_S


def test_an_estop_stops_each_group_by_its_category(armed: Rig) -> None:
    armed.drive(0.3, 0.0, 1.0)
    start_a_long_motion(armed)
    armed.drive(0.3, 0.0, 0.1)
    armed.ask("estop", within_s=1.0)
    powered = dict(zip(armed.robot.joint_names, armed.column("torque_enabled"), strict=True))
    assert powered["head_pan"]
    assert powered[ELBOW]
    assert armed.base()["enabled"] == 0.0
    assert abs(armed.base()["v_m_s"]) < 0.01
    assert [r["status"] for r in armed.results()] == ["stopped"]


def test_power_that_a_servo_has_not_given_up_is_taken_again(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    head = replace(rig.robot.group("head"), stop_category=StopCategory.POWER_REMOVED)
    rig.robot = replace(rig.robot, groups={**rig.robot.groups, "head": head})
    rig.control = rig.new_control()
    rig.boot()
    rig.ask("arm")
    taken = ServoLine.remove_power
    unheard = [True, True]  # at once, and when all has come to rest
    monkeypatch.setattr(
        ServoLine, "remove_power", lambda *given: not unheard.pop() if unheard else taken(*given)
    )
    rig.ask("estop", within_s=0.5)
    assert (rig.state, unheard) == ("stopped", [])
    assert torque_enabled(rig)["head_pan"] == 0
    assert torque_enabled(rig)[ELBOW] == 1


def test_after_an_estop_commands_are_refused_until_reset_and_arm(armed: Rig) -> None:
    armed.ask("estop")
    assert armed.status["estop_latched"]
    armed.go(1, left_elbow=1.2)
    armed.ask("arm")
    (result,) = armed.results()
    assert result["status"] == "refused"
    assert "reset, then arm" in result["reason"]
    assert armed.state == "stopped"
    assert "arm refused" in armed.status["detail"]
    before = armed.column("position")
    armed.ask("reset")
    assert armed.state == "disarmed"
    assert np.abs(armed.column("position") - before).max() < 0.005
    armed.go(2, left_elbow=1.2)
    armed.run(0.1)
    assert [r["status"] for r in armed.results()] == ["refused"]
    armed.ask("arm")
    assert armed.state == "armed"
    assert np.abs(armed.column("position") - before).max() < 0.005
    armed.go(3, left_elbow=1.2)
    armed.run(2.0)
    assert [r["status"] for r in armed.results()] == ["done"]


def test_reset_and_arm_in_one_breath_are_carried_out_in_order(armed: Rig) -> None:
    armed.ask("estop")
    armed.ask("reset", "arm", within_s=1.0)
    assert armed.state == "armed"


def test_an_estop_drops_the_acts_that_came_before_it(rig: Rig) -> None:
    rig.boot()
    rig.ask("arm", "estop")
    assert rig.state == "stopped"
    assert not rig.column("torque_enabled").any()


def test_disarming_ramps_and_then_takes_all_power(armed: Rig) -> None:
    start_a_long_motion(armed)
    armed.ask("disarm", within_s=1.0)
    assert armed.state == "disarmed"
    assert not armed.column("torque_enabled").any()
    assert armed.base()["enabled"] == 0.0


def test_a_killed_control_leaves_every_joint_standing_within_its_watchdog(armed: Rig) -> None:
    start_a_long_motion(armed)
    armed.lockstep.kill(armed.control)
    armed.run(load_profile("desktop").bus_watchdog_s + 0.1)
    stays_at_standstill(armed)


def test_a_killed_control_leaves_the_base_standing(armed: Rig) -> None:
    armed.drive(0.3, 0.0, 1.5)
    assert armed.base()["v_m_s"] > 0.25
    armed.lockstep.kill(armed.control)
    armed.run(0.5)
    here = armed.lockstep.truth()["robot"]
    armed.run(0.5)
    there = armed.lockstep.truth()["robot"]
    assert there["x_m"] == pytest.approx(here["x_m"], abs=0.002)
    assert there["y_m"] == pytest.approx(here["y_m"], abs=0.002)


def test_a_restarted_control_starts_disarmed_drops_nothing_and_arms_again(armed: Rig) -> None:
    start_a_long_motion(armed)
    armed.lockstep.kill(armed.control)
    armed.run(0.3)
    before = armed.column("position")
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    assert armed.state == "disarmed"
    arm = [armed.robot.joint_index[name] for name in armed.robot.group("left_arm").joints]
    assert np.abs(armed.column("position") - before)[arm].max() < 0.1
    before = armed.column("position")
    assert armed.true_speeds().max() < STANDSTILL_RAD_S
    armed.ask("arm")
    assert armed.state == "armed"
    assert np.abs(armed.column("position") - before).max() < 0.01


def test_a_stale_base_command_ramps_to_zero_and_the_arms_go_on(armed: Rig) -> None:
    armed.drive(0.4, 0.2, 1.5)
    assert armed.base()["v_m_s"] == pytest.approx(0.4, abs=0.02)
    armed.go(4, left_elbow=1.8)
    armed.run(1.3)
    assert armed.base()["v_m_s"] == pytest.approx(0.0, abs=0.01)
    assert armed.status["cause"] == "stale_command"
    assert armed.state == "armed"
    armed.run(1.0)
    assert [r["status"] for r in armed.results()] == ["done"]
    armed.drive(0.2, 0.0, 1.0)
    assert armed.base()["v_m_s"] == pytest.approx(0.2, abs=0.02)


def wheel_yaw_rad(rig: Rig) -> float:
    joints, base = rig.lockstep.truth()["joints"], rig.robot.base
    turned = joints["right_wheel"]["position"] - joints["left_wheel"]["position"]
    return float(turned * base.wheel_radius_m / base.track_m)


def test_odometry_is_what_the_wheels_did_and_near_where_the_base_went(armed: Rig) -> None:
    start, wheels_before, yaw_before = (
        armed.lockstep.truth()["robot"],
        wheel_yaw_rad(armed),
        armed.base()["yaw_rad"],
    )
    armed.drive(0.3, 0.4, 3.0)
    armed.drive(0.0, 0.0, 1.0)
    end, base = armed.lockstep.truth()["robot"], armed.base()
    by_wheels = wheel_yaw_rad(armed) - wheels_before
    assert base["yaw_rad"] - yaw_before == pytest.approx(by_wheels, abs=0.005)
    travelled = np.hypot(end["x_m"] - start["x_m"], end["y_m"] - start["y_m"])
    assert np.hypot(base["x_m"], base["y_m"]) == pytest.approx(travelled, abs=0.03)
    turned = (end["yaw_rad"] - start["yaw_rad"] + np.pi) % (2 * np.pi) - np.pi
    assert base["yaw_rad"] == pytest.approx(turned, rel=0.15)  # the wheels scrub in a turn


def test_a_lost_supervisor_stops_the_robot_until_it_is_back_and_reset(armed: Rig) -> None:
    armed.process_table.put_document({})
    armed.run(2.9)
    assert armed.state == "armed"
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("stopped", "supervisor_lost")
    armed.ask("reset", within_s=2.2)
    assert armed.state == "stopped"
    assert "reset refused" in armed.status["detail"]
    armed.process_table.put_document({})
    armed.ask("reset")
    assert armed.state == "disarmed"


def test_a_servo_with_a_hardware_error_stops_all_and_rejoins_after_reset(armed: Rig) -> None:
    servo = next(s for s in armed.robot.servo_bus.servos if s.joint == ELBOW)
    armed.lockstep.twin.serial_devices["servos"].set_alert(servo.id, 32)
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("stopped", "servo_hardware_error")
    assert ELBOW in armed.status["detail"]
    armed.ask("reset", within_s=2.5)
    assert armed.state == "disarmed", armed.status
    armed.ask("arm", within_s=1.0)
    assert armed.state == "armed", armed.status


def test_a_reset_lets_no_servo_go_that_reports_an_error_and_still_holds(armed: Rig) -> None:
    low_voltage = 1  # the servo obeys, but tells of it until it is rebooted
    servo = next(s for s in armed.robot.servo_bus.servos if s.joint == ELBOW)
    armed.lockstep.twin.serial_devices["servos"].set_alert(servo.id, low_voltage)
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("stopped", "servo_hardware_error")
    rest = true_elbow(armed)
    armed.ask("reset", within_s=2.5)
    assert armed.state == "stopped"
    assert f"it would reboot {ELBOW}, which still hold" in armed.status["detail"]
    assert true_elbow(armed) == pytest.approx(rest, abs=0.01)
    armed.ask("disarm", "reset", within_s=2.5)
    assert armed.state == "disarmed", armed.status
    armed.ask("arm", within_s=1.0)
    assert armed.state == "armed", armed.status


def test_a_silent_servo_stops_all_and_names_itself(armed: Rig) -> None:
    servo = next(s for s in armed.robot.servo_bus.servos if s.joint == PITCH)
    armed.lockstep.twin.serial_devices["servos"].silence(servo.id)
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("stopped", "servo_bus_lost")
    assert PITCH in armed.status["detail"]


def test_a_loose_plug_lets_no_joint_at_rest_sag_a_bit_at_every_answer(armed: Rig) -> None:
    armed.run(1.0)
    held, rest = armed.column("setpoint"), true_elbow(armed)
    bus = armed.lockstep.twin.serial_devices["servos"]
    for _ in range(10):
        for silent in (True, False):
            for servo in armed.robot.servo_bus.servos:
                bus.silence(servo.id, silent=silent)
            armed.run(0.1)
    assert (armed.state, armed.status["cause"]) == ("stopped", "servo_bus_lost")
    assert armed.column("setpoint") == pytest.approx(held, abs=0.002)
    assert true_elbow(armed) == pytest.approx(rest, abs=0.002)


def test_the_goal_of_a_moving_joint_stands_while_it_is_not_heard(armed: Rig) -> None:
    servo = next(one for one in armed.robot.servo_bus.servos if one.joint == ELBOW)
    armed.go(1, **{ELBOW: armed.joint(ELBOW) + 1.0})
    armed.run(0.4)
    assert armed.joint(ELBOW, "velocity") > 0.2
    armed.lockstep.twin.serial_devices["servos"].silence(servo.id)
    armed.run(0.02)
    stands = armed.joint(ELBOW, "setpoint")
    armed.run(0.02)
    assert armed.state == "armed"
    assert armed.joint(ELBOW, "setpoint") == stands


def test_a_drive_fault_stops_all_and_is_cleared_by_reset(armed: Rig) -> None:
    armed.lockstep.twin.drives[0].raise_fault(0x2310)
    armed.run(0.5)
    assert (armed.state, armed.status["cause"]) == ("stopped", "drive_fault")
    armed.ask("reset", within_s=1.0)
    assert armed.state == "disarmed"
    armed.ask("arm", within_s=1.0)
    assert armed.state == "armed"


def test_a_lost_servo_line_is_reopened_and_needs_reset_and_arm(armed: Rig) -> None:
    start_a_long_motion(armed)
    armed.lockstep.devices.opened[0].unplug()
    armed.run(0.1)
    assert armed.status["cause"] == "servo_bus_lost"
    armed.run(3.0)
    assert armed.state == "stopped"
    assert armed.true_speeds().max() < STANDSTILL_RAD_S
    armed.ask("reset", "arm", within_s=1.5)
    assert armed.state == "armed", armed.status


def true_elbow(rig: Rig) -> float:
    return float(rig.lockstep.truth()["joints"][ELBOW]["position"])


def torque_enabled(rig: Rig) -> dict[str, int]:
    bank = rig.lockstep.twin.serial_devices["servos"]
    return {
        servo.joint: bank.register(servo.id, "torque_enable")
        for servo in rig.robot.servo_bus.servos
    }


def test_a_robot_that_is_switched_off_ramps_and_then_takes_all_power(armed: Rig) -> None:
    start_a_long_motion(armed)
    ask_power_off(armed.lockstep.context.run_dir)
    armed.lockstep.remove(armed.control)
    assert [r["status"] for r in armed.results()] == ["stopped"]
    assert set(torque_enabled(armed).values()) == {0}


def sampled_while_switched_off(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, sample: Callable[[], float]
) -> list[float]:
    """Switch the robot off and take a sample in every tick that this lasts."""
    samples: list[float] = []
    clock = rig.lockstep.clock
    sleep_until = clock.sleep_until

    def sampled(until_ns: int) -> None:
        sleep_until(until_ns)
        samples.append(sample())

    ask_power_off(rig.lockstep.context.run_dir)
    with monkeypatch.context() as patch:
        patch.setattr(clock, "sleep_until", sampled)
        rig.lockstep.remove(rig.control)
    return samples


def lift_both_arms(rig: Rig, pitch_rad: float, elbow_rad: float) -> None:
    for n, side in enumerate(("left", "right")):
        rig.go(n, **{f"{side}_shoulder_pitch": pitch_rad, f"{side}_elbow": elbow_rad})
    rig.run(3.0)
    assert rig.joint("left_elbow") == pytest.approx(elbow_rad, abs=0.05)


@pytest.mark.parametrize("pitch_rad, elbow_rad", [(0.0, 1.5), (0.8, 1.2), (1.2, 0.4)])
def test_arms_come_down_slowly_before_their_power_goes(
    armed: Rig, monkeypatch: pytest.MonkeyPatch, pitch_rad: float, elbow_rad: float
) -> None:
    lift_both_arms(armed, pitch_rad, elbow_rad)
    speeds = sampled_while_switched_off(armed, monkeypatch, lambda: armed.true_speeds().max())
    assert set(torque_enabled(armed).values()) == {0}
    assert max(speeds) < 0.8  # let go at once they fall at 1.5 to 2 rad/s
    assert true_elbow(armed) < 0.5 * elbow_rad
    for _ in range(10):  # without power
        armed.run(0.1)
        assert armed.true_speeds().max() < 0.2


def test_an_arm_that_comes_down_is_braked_and_never_pushed(
    armed: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    lift_both_arms(armed, 0.0, 1.5)
    bank = armed.lockstep.twin.serial_devices["servos"]
    elbow = next(s.id for s in armed.robot.servo_bus.servos if s.joint == "left_elbow")

    def lift_pulses() -> float:
        return float(
            bank.register(elbow, "goal_position") - bank.register(elbow, "present_position")
        )

    upwards = 1.0 if lift_pulses() > 0 else -1.0
    assert upwards * lift_pulses() > 20  # what carries the forearm
    lifts = sampled_while_switched_off(armed, monkeypatch, lambda: upwards * lift_pulses())
    assert min(lifts) >= -1  # the rounding of both


def test_arms_that_a_crash_left_to_themselves_come_down_too(
    armed: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    lift_both_arms(armed, 0.8, 1.2)
    armed.lockstep.kill(armed.control)
    armed.run(0.5)
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    speeds = sampled_while_switched_off(armed, monkeypatch, lambda: armed.true_speeds().max())
    assert set(torque_enabled(armed).values()) == {0}
    assert max(speeds) < 0.8
    assert true_elbow(armed) < 0.6


def test_an_emergency_stop_on_the_way_down_leaves_the_arms_standing_under_power(
    armed: Rig, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    lift_both_arms(armed, 0.8, 1.2)
    angles: list[float] = []

    def press_on_the_way() -> float:
        angles.append(true_elbow(armed))
        if len(angles) == 250:
            armed.publish("estop")
        return angles[-1]

    sampled_while_switched_off(armed, monkeypatch, press_on_the_way)
    assert 0.3 < angles[-1] < 1.15
    assert set(torque_enabled(armed).values()) == {1}
    assert "arms keep their power: emergency stop (test)" in caplog.text
    armed.run(0.5)
    stays_at_standstill(armed)


def test_a_servo_line_that_is_lost_on_the_way_down_is_told(
    armed: Rig, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    lift_both_arms(armed, 0.8, 1.2)
    ticks: list[float] = []

    def unplug_on_the_way() -> float:
        ticks.append(0.0)
        if len(ticks) == 250:
            armed.lockstep.faults.inject("servo_bus", None, "unplug")
        return 0.0

    sampled_while_switched_off(armed, monkeypatch, unplug_on_the_way)
    assert "servos may have kept their power" in caplog.text


def test_what_a_hand_holds_is_not_dropped_when_the_robot_is_switched_off(armed: Rig) -> None:
    space = SharedSpace(armed.lockstep.context.run_dir / "ipc", armed.lockstep.clock)
    space.cell_writer("executor_status").put_document({"holding": {"left": "cup", "right": None}})
    armed.run(0.1)
    ask_power_off(armed.lockstep.context.run_dir)
    armed.lockstep.remove(armed.control)
    powered = {joint for joint, torque in torque_enabled(armed).items() if torque}
    groups = armed.robot.groups
    assert powered == {*groups["left_arm"].joints, *groups["left_gripper"].joints}


def test_a_control_that_is_ended_otherwise_holds_the_arms_for_the_next_one(armed: Rig) -> None:
    start_a_long_motion(armed)
    armed.drive(0.3, 0.0, 0.5)
    armed.lockstep.remove(armed.control)
    assert [r["status"] for r in armed.results()] == ["stopped"]
    assert set(torque_enabled(armed).values()) == {1}
    followed = PowerState.OPERATION_ENABLED
    assert followed not in [drive.power_state for drive in armed.lockstep.twin.drives]
    armed.run(1.0)  # longer than the servos' watchdog
    stays_at_standstill(armed)
    rest = true_elbow(armed)
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    assert (armed.state, set(torque_enabled(armed).values())) == ("disarmed", {1})
    assert true_elbow(armed) == pytest.approx(rest, abs=0.01)
    armed.ask("arm")
    assert armed.state == "armed", armed.status
    assert true_elbow(armed) == pytest.approx(rest, abs=0.02)


def test_a_hand_goes_on_pressing_after_a_crash_of_control(armed: Rig) -> None:
    gripper = armed.robot.joint_index["left_gripper"]
    space = SharedSpace(armed.lockstep.context.run_dir / "ipc", armed.lockstep.clock)
    space.cell_writer("executor_status").put_document({"holding": {"left": "cup", "right": None}})
    armed.run(0.1)
    held_at_m = armed.lockstep.truth()["joints"]["left_gripper"]["position"]
    armed.lockstep.kill(armed.control)
    armed.run(1.0)  # longer than the servos' watchdog
    armed.control = armed.new_control()
    armed.lockstep.add(armed.control)
    armed.run(0.5)
    armed.ask("arm")
    assert armed.state == "armed", armed.status
    told = space.cell_reader("joint_state").latest()
    assert told is not None
    assert told.data["setpoint"][gripper] == pytest.approx(
        held_at_m - PRESS_M / armed.robot.hands["left"].opening_ratio, abs=1e-3
    )


def test_a_control_that_finds_no_wheels_drops_no_arm_that_holds(
    armed: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> None:
        raise DeviceMissing(f"{name}: not there")

    bank = armed.lockstep.twin.serial_devices["servos"]
    elbow_id = armed.robot.servo_bus.servos[armed.robot.joint_index[ELBOW]].id
    armed.lockstep.kill(armed.control)
    monkeypatch.setattr(armed.lockstep.devices, "can", missing)
    later = armed.new_control()
    with pytest.raises(DeviceMissing, match="can: not there"):
        later.start()
    later.stop()
    assert bank.register(elbow_id, "torque_enable") == 1


def test_a_missing_servo_line_is_told_at_the_start(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> None:
        raise DeviceMissing(f"{name}: not there")

    monkeypatch.setattr(rig.lockstep.devices, "serial", missing)
    with pytest.raises(DeviceMissing, match="servos: not there"):
        rig.control.start()
