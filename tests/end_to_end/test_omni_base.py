"""A base on three omni wheels that hang on the arm's servo bus: it drives, and it stops."""

from collections.abc import Iterator
from math import hypot, pi
from pathlib import Path
from typing import Any

import pytest

from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.ipc import topics
from vla_deploy.planning.node import PlannerNode
from vla_deploy.skills.node import ExecutorNode
from vla_deploy.supervisor.health import bus_troubles

WHEEL_IDS = (7, 8, 9)


@pytest.fixture
def base(tmp_path: Path) -> Iterator[LockstepControl]:
    made = LockstepControl(tmp_path, robot="lekiwi")
    made.arm()
    yield made
    made.close()


def registers(base: LockstepControl, name: str) -> list[int]:
    return [base.lockstep.twin.servos.register(one, name) for one in WHEEL_IDS]


def speeds(base: LockstepControl) -> list[float]:
    joints = base.lockstep.truth()["joints"]
    return [abs(joints[name]["velocity"]) for name in base.robot.wheel_joints]


def pose(base: LockstepControl) -> tuple[float, float, float]:
    truth = base.lockstep.truth()["robot"]
    return truth["x_m"], truth["y_m"], truth["yaw_rad"]


def told_by(base: LockstepControl) -> Any:
    sample = base.space.cell_reader(topics.BASE_STATE).latest()
    assert sample is not None
    return sample.data


def test_it_drives_back_turns_and_goes_sideways_as_its_wheels_tell(base: LockstepControl) -> None:
    base.drive_for(1.0, -0.15)
    base.drive_for(0.5, 0.0)
    assert pose(base) == pytest.approx((-0.15, 0.0, 0.0), abs=0.01)
    base.drive_for(1.0, 0.0, 0.0, 0.15)
    base.drive_for(0.5, 0.0)
    assert pose(base) == pytest.approx((-0.15, 0.15, 0.0), abs=0.01)
    base.drive_for(1.0, 0.0, 1.0)
    base.drive_for(0.5, 0.0)
    assert pose(base)[2] == pytest.approx(1.0, abs=0.03)
    told = told_by(base)
    assert [float(told[name]) for name in ("x_m", "y_m", "yaw_rad")] == pytest.approx(
        pose(base), abs=0.02
    )
    assert base.state() == "armed"
    assert list(bus_troubles(base.status())) == []  # any would end the service


def test_too_much_for_the_wheels_slows_the_whole_motion(base: LockstepControl) -> None:
    base.drive_for(1.5, -0.2, 1.2, 0.2)
    assert max(speeds(base)) == pytest.approx(4.0, abs=0.05)
    told = told_by(base)
    ahead, turn, left = (float(told[name]) for name in ("v_m_s", "w_rad_s", "left_m_s"))
    assert hypot(ahead, left) < 0.2
    assert ahead / turn == pytest.approx(left / turn * -1.0, rel=0.05)


def test_an_emergency_stop_brakes_it_and_takes_its_power(base: LockstepControl) -> None:
    base.drive_for(1.0, -0.15)
    at_m = pose(base)[0]
    base.operate("estop")
    base.drive_for(0.5, -0.15)
    assert max(speeds(base)) < 0.02
    assert abs(pose(base)[0] - at_m) < 0.03
    assert registers(base, "torque_enable") == [0, 0, 0]
    assert base.status()["estop_latched"]


def test_a_command_that_goes_stale_stops_it(base: LockstepControl) -> None:
    base.drive_for(1.0, -0.15)
    base.pause(0.7)
    assert max(speeds(base)) < 0.02
    assert registers(base, "goal_velocity") == [0, 0, 0]


def test_after_a_dead_cable_the_wheels_stand_as_soon_as_it_is_back(base: LockstepControl) -> None:
    base.drive_for(1.0, -0.15)
    fault = base.faults.inject("servo_bus", None, "unplug")
    base.drive_for(0.5, -0.15)
    assert max(speeds(base)) > 2.0  # nobody can stop them: FEETECH has no bus watchdog
    fault.clear()
    base.drive_for(0.4, -0.15)
    assert max(speeds(base)) < 0.05
    assert registers(base, "goal_velocity") == [0, 0, 0]
    assert registers(base, "torque_enable") == [0, 0, 0]
    assert base.status()["cause"] == "servo_bus_lost"
    base.insist("reset")
    base.insist("arm")
    base.drive_for(0.6, -0.1)
    assert base.state() == "armed"
    assert max(speeds(base)) > 1.0


def test_a_new_control_finds_turning_wheels_and_stops_them(base: LockstepControl) -> None:
    base.drive_for(1.0, -0.15)
    base.lockstep.kill(base.control)
    base.pause(0.3)
    assert max(speeds(base)) > 2.0
    base.restart_control()
    base.pause(0.3)
    assert max(speeds(base)) < 0.05
    assert registers(base, "torque_enable") == [0, 0, 0]


def test_an_orderly_end_leaves_them_without_speed_and_power(tmp_path: Path) -> None:
    base = LockstepControl(tmp_path, robot="lekiwi")
    base.arm()
    base.drive_for(1.0, -0.15)
    twin = base.lockstep.twin
    base.lockstep.remove(base.control)
    assert [twin.servos.register(one, "goal_velocity") for one in WHEEL_IDS] == [0, 0, 0]
    assert [twin.servos.register(one, "torque_enable") for one in WHEEL_IDS] == [0, 0, 0]
    base.close()


def test_words_drive_it_by_distances_and_name_what_it_lacks(base: LockstepControl) -> None:
    context = base.lockstep.context
    base.add_senses()
    base.lockstep.add(ExecutorNode(context, base.robot, 50.0))
    base.lockstep.add(PlannerNode(context, base.robot))
    assert said(base, "move back 20 centimetres")["event"] == "finished"
    assert pose(base) == pytest.approx((-0.2, 0.0, 0.0), abs=0.02)
    assert said(base, "turn right")["event"] == "finished"
    assert pose(base)[2] == pytest.approx(-pi / 2, abs=0.05)
    refused = said(base, "go to the floor")
    assert refused["event"] == "rejected"
    assert "lekiwi has no lidar" in refused["reason"]


def said(base: LockstepControl, text: str) -> dict[str, Any]:
    """Give a command and return its last event."""
    events = base.link.events(topics.TASK_EVENT, from_start=False)
    base.link.writer(topics.UTTERANCE).publish({"command_id": text, "text": text, "source": "t"})
    ends: list[dict[str, Any]] = []

    def has_ended() -> bool:
        told = [{**event.payload} for event in events.drain()]
        ends.extend(one for one in told if one["event"] in ("finished", "rejected"))
        return bool(ends)

    assert base.wait_until(has_ended, 30.0), text
    return ends[-1]
