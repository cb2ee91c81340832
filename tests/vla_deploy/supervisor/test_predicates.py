from dataclasses import replace

import pytest

from platforms import load_profile
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.processes.predicates import (
    RunContext,
    all_of,
    always,
    any_of,
    budgeted,
    device_declared,
    installed,
    not_suspended,
    twin_only,
)
from vla_deploy.supervisor.table import TABLE

CONTEXT = RunContext(twin=True, robot=load_robot("butler"), profile=load_profile("desktop"))


def never(_: RunContext) -> str:
    return "never"


def nowhere(_: RunContext) -> str:
    return "nowhere"


def test_the_twin_runs_only_in_a_run_with_a_twin():
    assert twin_only(CONTEXT) == ""
    assert twin_only(replace(CONTEXT, twin=False)) == "the run has no twin"


def test_a_process_for_a_device_runs_where_the_robot_declares_one():
    assert device_declared("camera")(CONTEXT) == ""
    blind = replace(CONTEXT, robot=replace(CONTEXT.robot, camera=None))
    assert device_declared("camera")(blind) == "robot butler declares no camera"


def test_a_process_without_a_budget_does_not_run():
    assert budgeted("planner")(CONTEXT) == ""
    assert budgeted("juggler")(CONTEXT) == "profile desktop has no budget for it"


def test_a_suspended_process_tells_why():
    suspended = replace(CONTEXT, suspended={"planner": "too hot"})
    assert not_suspended("planner")(CONTEXT) == ""
    assert not_suspended("planner")(suspended) == "too hot"


def test_an_optional_part_that_is_not_installed_tells_how_to_install_it():
    assert installed("json", "x")(CONTEXT) == ""
    assert installed("no_such_module", "audio")(CONTEXT) == (
        "no_such_module is not installed: pip install 'vla-deploy[audio]'"
    )


@pytest.mark.parametrize(
    ("predicate", "reason"),
    [
        (all_of(), ""),
        (all_of(always, always), ""),
        (all_of(always, never, nowhere), "never"),
        (any_of(never, always), ""),
        (any_of(never, nowhere), "never; nowhere"),
        (all_of(any_of(never, always), nowhere), "nowhere"),
    ],
)
def test_predicates_compose(predicate, reason):
    assert predicate(CONTEXT) == reason


def test_the_whole_table_runs_on_the_twin_and_all_but_the_twin_on_the_robot():
    asked = replace(CONTEXT, ros=True)
    assert [row.name for row in TABLE if row.when(asked)] == []
    real = replace(asked, twin=False)
    assert [row.name for row in TABLE if row.when(real)] == ["twin"]


def test_ros_runs_where_run_robot_or_profile_asks_for_it():
    (ros,) = (row for row in TABLE if row.name == "ros")
    robot = replace(CONTEXT.robot, ros=replace(CONTEXT.robot.ros, enabled=True))
    assert "nobody asks for ROS 2" in ros.when(CONTEXT)
    assert ros.when(replace(CONTEXT, ros=True)) == ""
    assert ros.when(replace(CONTEXT, robot=robot)) == ""
    assert ros.when(replace(CONTEXT, profile=replace(CONTEXT.profile, ros=True))) == ""


def test_control_cannot_be_suspended():
    (control,) = (row for row in TABLE if row.name == "control")
    assert control.when(replace(CONTEXT, suspended={"control": "too hot"})) == ""
