from math import pi
from typing import Any

import pytest

CENTRE = 2048
QUARTER_TURN = 1024


def test_without_torque_there_is_no_duty_and_goals_move_nothing(bench: Any) -> None:
    assert bench.write("goal_position", CENTRE + QUARTER_TURN) == 0
    bench.run(0.5)
    assert bench.duty[0] == 0.0
    assert bench.read("present_position") == CENTRE


def test_torque_on_holds_where_a_hand_has_turned_the_shaft(bench: Any) -> None:
    bench.turn_to(0.5)
    turned = bench.read("present_position")
    bench.arm()
    assert bench.read("goal_position") == turned == CENTRE + round(0.5 / (2 * pi) * 4096)
    bench.run(0.5)
    assert bench.read("present_position") == turned


def test_torque_on_follows_a_goal_that_was_written_while_torque_was_off(bench: Any) -> None:
    bench.write("goal_position", CENTRE + 300)
    bench.write("torque_enable", 1)
    bench.run(1.0)
    assert bench.read("present_position") == pytest.approx(CENTRE + 300, abs=2)
    bench.write("torque_enable", 0)
    bench.turn_to(0.0)
    bench.write("torque_enable", 1)
    assert bench.read("goal_position") == CENTRE


def test_writing_torque_on_again_leaves_the_goal_alone(bench: Any) -> None:
    bench.arm()
    bench.write("goal_position", CENTRE + 500)
    bench.run(0.02)
    bench.write("torque_enable", 1)
    assert bench.read("goal_position") == CENTRE + 500


def test_a_goal_can_switch_torque_on_where_the_drive_mode_says_so(bench: Any) -> None:
    bench.write("drive_mode", 0x08)
    bench.write("goal_position", CENTRE + 100)
    assert bench.read("torque_enable") == 1
    bench.run(1.0)
    assert bench.read("present_position") == pytest.approx(CENTRE + 100, abs=2)
