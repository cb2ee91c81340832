from dataclasses import replace

from platforms import load_profile
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.table import TABLE, RunContext, optional, table_of, twin_only

CONTEXT = RunContext(twin=True, robot=load_robot("butler"), profile=load_profile("desktop"))


def test_the_twin_runs_only_in_a_run_with_a_twin():
    assert twin_only(CONTEXT) == ""
    assert twin_only(replace(CONTEXT, twin=False)) == "the run has no twin"


def test_an_optional_process_needs_a_budget_and_runs_unless_it_is_suspended():
    assert optional("planner")(CONTEXT) == ""
    assert optional("juggler")(CONTEXT) == "profile desktop has no budget for it"
    suspended = replace(CONTEXT, suspended={"planner": "too hot"})
    assert optional("planner")(suspended) == "too hot"


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


def test_the_rows_that_the_budgets_may_suspend():
    everything = replace(CONTEXT, ros=True, suspended={row.name: "too hot" for row in TABLE})
    suspended = [row.name for row in TABLE if row.when(everything) == "too hot"]
    assert suspended == ["perception", "speech", "planner", "executor", "dashboard", "ros"]


def test_a_hung_control_is_ended_sooner_where_no_watchdog_stops_the_wheels() -> None:
    def limits_s(robot: str) -> list[float | None]:
        rows = table_of(load_robot(robot))
        return [one.silence_limit_s for row in rows if row.name == "control" for one in row.watched]

    assert limits_s("butler") == [5.0, None]
    assert limits_s("lekiwi") == [1.0, None]
