"""Move one joint from the command line; the test plays control at the other end of the topics."""

import json

import numpy as np
import pytest

from vla_deploy.cli.main import main
from vla_deploy.cli.operation import joint
from vla_deploy.ipc import ClaimBook
from vla_deploy.robots import load_robot

BUTLER = load_robot("butler")


class Control:
    """Take motion commands; the joint is at its goal, or the motion ends, after a few waits."""

    def __init__(self, robot, ending: str = "done") -> None:
        space, self._ending = robot.space, ending
        self._clock = robot.clock
        self._commands = space.ring_reader("motion_command", from_start=True)
        self._results = space.ring_writer("motion_result")
        self._status = space.cell_writer("control_status")
        self._joints = space.cell_writer("joint_state")
        table = space.cell_writer("process_table")
        table.put_document({"robot": "butler"})
        self.state, self.is_silent = "armed", False
        self.positions = np.zeros(len(BUTLER.joint_names))
        self.heard: list[dict] = []
        self.step()
        robot.clock.after_wait = self.step

    def step(self) -> None:
        if self.is_silent:
            return
        self._status.put_document({"state": self.state, "active_motions": []})
        zeros = np.zeros(len(self.positions))
        for event in self._commands.drain():
            self.heard.append(event.payload)
            if event.payload["kind"] == "goal":
                self._follow(event.payload)
        self._joints.put(
            joint_count=len(zeros),
            position=self.positions,
            velocity=zeros,
            setpoint=self.positions,
            effort_ratio=zeros,
            age_s=zeros,
            error=zeros,
            torque_enabled=zeros,
        )

    def _follow(self, goal: dict) -> None:
        if self._ending == "never":
            return
        if self._ending == "done":
            for name, value in goal["targets"].items():
                self.positions[BUTLER.joint_index[name]] = value
        reason = "" if self._ending == "done" else "contact at left_elbow"
        self._results.publish(
            {"motion_id": goal["motion_id"], "status": self._ending, "reason": reason}
        )


@pytest.fixture
def attached(session, robot, monkeypatch):
    monkeypatch.setattr(joint, "attach", lambda _: session)
    book = ClaimBook(robot.space, robot.clock)
    book.declare(dict.fromkeys(BUTLER.groups, 1))
    return book


def test_a_joint_goes_where_it_is_told_at_the_speed_that_it_is_told(attached, robot, capsys):
    control = Control(robot)
    top = BUTLER.limits["head_pan"].velocity
    assert main(["joint", "move", "head_pan", "--to", "0.4", "--speed", f"{top / 2}"]) == 0
    assert main(["joint", "move", "head_pan", "--by", "-0.1", "--json"]) == 0
    first, second = [one for one in control.heard if one["kind"] == "goal"]
    assert first["targets"] == {"head_pan": 0.4}
    assert first["speed_ratio"] == pytest.approx(0.5)
    assert second["targets"]["head_pan"] == pytest.approx(0.3)
    assert second["speed_ratio"] == joint.USUAL_SPEED_RATIO
    line, _, document = capsys.readouterr().out.partition("\n")
    assert line == "head_pan: 0.000 -> 0.400"
    assert json.loads(document)["at"] == pytest.approx(0.3)
    assert attached.ask("another", {"head": 1})  # it was given back


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["nose", "--to", "1"], "no joint nose; there are left_shoulder_yaw"),
        (["head_pan", "--to", "9"], "head_pan: expected -1.57 to 1.57, got 9"),
        (["head_pan", "--by", "5"], "got 5"),
        (["head_pan", "--to", "0", "--speed", "99"], "at most"),
    ],
)
def test_what_a_joint_cannot_do_is_refused_and_nothing_is_sent(
    attached, robot, capsys, words, complaint
):
    control = Control(robot)
    assert main(["joint", "move", *words]) == 2
    assert complaint in capsys.readouterr().err
    control.step()
    assert not control.heard


@pytest.mark.parametrize(
    ("state", "complaint"), [("disarmed", "arm it first"), ("stopped", "reset and arm it first")]
)
def test_a_robot_that_is_not_armed_moves_nothing(attached, robot, capsys, state, complaint):
    control = Control(robot)
    control.state = state
    control.step()
    assert main(["joint", "move", "head_pan", "--to", "0.4"]) == 1
    assert complaint in capsys.readouterr().err
    control.step()
    assert not control.heard


def test_a_joint_that_a_plan_moves_is_left_to_it(attached, robot, capsys):
    Control(robot)
    assert attached.ask("pick_up (cli-1, a1)", {"left_arm": 1})
    assert main(["joint", "move", "left_elbow", "--to", "1"]) == 1
    assert "left_arm is held by pick_up (cli-1, a1)" in capsys.readouterr().err


def test_a_motion_that_ends_otherwise_says_where_and_why(attached, robot, capsys):
    Control(robot, ending="touched")
    assert main(["joint", "move", "left_elbow", "--to", "1"]) == 1
    assert "left_elbow is at 0.000: touched, contact at left_elbow" in capsys.readouterr().err


def test_ctrl_c_ends_the_motion_and_gives_the_joint_back(attached, robot, session, monkeypatch):
    control = Control(robot, ending="never")

    def interrupted() -> None:
        control.step()
        if control.heard:
            raise KeyboardInterrupt

    robot.clock.after_wait = interrupted
    assert main(["joint", "move", "left_elbow", "--to", "1"]) == 130
    robot.clock.after_wait = control.step
    control.step()
    assert [one["kind"] for one in control.heard] == ["goal", "cancel"]
    assert attached.ask("another", {"left_arm": 1})


def test_a_control_that_falls_silent_is_not_waited_for(attached, robot, capsys):
    control = Control(robot, ending="never")

    def falls_silent() -> None:
        control.step()
        control.is_silent = bool(control.heard)

    robot.clock.after_wait = falls_silent
    assert main(["joint", "move", "left_elbow", "--to", "1"]) == 1
    assert "control does not answer" in capsys.readouterr().err


def test_the_joints_are_shown_with_their_ranges(attached, robot, capsys):
    control = Control(robot)
    control.positions[BUTLER.joint_index["left_elbow"]] = 1.25
    control.step()
    assert main(["joint", "show", "left_elbow"]) == 0
    assert "1.250" in capsys.readouterr().out
    assert main(["joint", "show", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["joint"] for row in rows] == list(BUTLER.joint_names)
    assert rows[BUTLER.joint_index["left_elbow"]]["position"] == 1.25
