"""A robot without a button is stopped by its operators alone."""

from dataclasses import replace

from drivers.opener import PathOpener
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.control.judging.estop_button import EstopButton
from vla_deploy.robots import load_robot


def test_no_button_is_no_source_of_a_stop() -> None:
    clock = ManualClock()
    robot = replace(load_robot("butler"), estop=None)
    button = EstopButton(robot, PathOpener({}, clock), clock)
    button.open()
    assert button.source() is None
    button.close()
