import logging
from dataclasses import replace

import pytest

from vla_deploy.ipc import ClaimBook

GB = 1_000_000_000


def actions(rows: list[dict]) -> list[str]:
    return [row["action"] for row in rows]


def row_of(document: dict, metric: str, process: str | None = None) -> dict:
    return next(
        row for row in document["rows"] if (row["metric"], row["process"]) == (metric, process)
    )


def test_a_robot_within_its_budgets_is_asked_for_nothing(world):
    world.readings = {"temperature_c": 50.0, "power_w": 9.0}
    world.go(30)
    assert world.cell("resource_directives") == {
        "rate_ratio": {},
        "model_tier": {},
        "suspended": [],
    }
    budget = world.cell("budget")
    assert (budget["stop"], budget["reason"], budget["ladder"]["step"]) == (False, "", 0)


def test_a_memory_hog_is_slowed_then_gets_a_smaller_model_then_is_started_anew(world):
    world.memory_mb["perception"] = 1000.0
    world.go(20)
    taken = world.cell("budget")["ladder"]["taken"]
    assert actions(taken) == ["slow", "slow", "smaller_model", "restart"]
    assert world.restarted == ["perception"]
    assert world.cell("resource_directives") == {
        "rate_ratio": {"perception": 0.25},
        "model_tier": {"perception": 1},
        "suspended": [],
    }
    assert "perception: memory_mb 1000 above its budget of 400" in taken[0]["why"]


def test_all_is_given_back_when_the_hog_behaves_again(world):
    world.memory_mb["perception"] = 1000.0
    world.go(20)
    world.memory_mb["perception"] = 50.0
    world.go(60)
    budget = world.cell("budget")
    assert budget["ladder"]["taken"] == []
    assert world.cell("resource_directives")["rate_ratio"] == {}
    assert budget["ladder"]["counts"] == {
        "taken": 4,
        "undone": 4,
        "slow": 2,
        "smaller_model": 1,
        "restart": 1,
        **{name: 0 for name in budget["ladder"]["counts"] if name not in _COUNTED},
    }
    undone = [row for row in budget["ladder"]["history"] if not row["taken"]]
    assert actions(undone) == ["restart", "smaller_model", "slow", "slow"]


_COUNTED = {"taken", "undone", "slow", "smaller_model", "restart"}


@pytest.mark.parametrize(("wall_ratio", "told"), [(1.0, 0.6), (3.0, 0.2), (0.2, 0.6)])
def test_cpu_is_told_by_whichever_clock_has_gone_further(world, wall_ratio, told):
    world.wall_ratio = wall_ratio
    world.cpu_ratio["perception"] = 0.6
    world.go(5)
    row = row_of(world.cell("budget"), "cpu_ratio", "perception")
    assert row["measured"] == pytest.approx(told)


def test_a_cpu_hog_is_judged_by_the_mean_of_the_last_moments(world):
    world.go(5)
    world.cpu_ratio["perception"] = 3.0
    world.go(1)
    row = row_of(world.cell("budget"), "cpu_ratio", "perception")
    assert 0.1 < row["measured"] < 3.0
    world.go(10)
    row = row_of(world.cell("budget"), "cpu_ratio", "perception")
    assert row["measured"] == pytest.approx(3.0)
    assert row["over"]


def test_a_thermal_ramp_goes_down_the_ladder_to_the_protective_stop_and_back(world):
    for degrees in range(50, 101, 5):
        world.readings = {"temperature_c": float(degrees), "temperature_c.tj-thermal": degrees}
        world.go(2)
    world.go(10)
    assert world.keeper.suspended == {"planner"}
    budget = world.cell("budget")
    assert actions(budget["ladder"]["taken"]) == [
        "slow",
        "slow",
        "smaller_model",
        "suspend",
        "protective_stop",
    ]
    assert budget["stop"]
    assert "temperature_c" in budget["reason"]
    assert world.cell("budget_stop") == {"stop": True, "reason": budget["reason"]}
    world.readings = {"temperature_c": 40.0}
    world.go(60)
    assert world.keeper.suspended == set()
    assert not world.cell("budget")["stop"]
    assert world.cell("budget_stop") == {"stop": False, "reason": ""}


def test_critical_heat_stops_the_robot_at_once(world):
    world.readings = {"temperature_c": 80.0, "temperature_c.tj-thermal": 101.5}
    world.go(0.5)
    assert "off at 104.5" in world.cell("budget")["reason"]


@pytest.mark.parametrize(("counter", "stops"), [("oc1", True), ("oc2", True), ("oc3", False)])
def test_a_brown_out_stops_the_robot_and_peaks_of_current_are_a_hint(world, counter, stops):
    world.readings = {f"throttle_events.{counter}": 2.0}
    world.go(0.5)
    budget = world.cell("budget")
    assert budget["stop"] is stops
    assert bool(budget["hint"]) is not stops


def test_memory_nearly_out_stops_the_robot_at_once(world):
    world.readings = {"memory_total_bytes": 8.0 * GB, "memory_available_bytes": 0.1 * GB}
    world.go(0.5)
    assert "100 MB of memory available" in world.cell("budget")["reason"]
    world.readings["memory_available_bytes"] = 4.0 * GB
    world.go(10)
    assert not world.cell("budget")["stop"]


def test_a_number_that_cannot_be_read_is_shown_with_its_reason_and_stops_nothing(world):
    world.readings = {"temperature_c": None}
    world.go(30)
    budget = world.cell("budget")
    row = row_of(budget, "temperature_c")
    assert (row["measured"], row["state"], row["reason"]) == (None, "missing", "asleep")
    assert not budget["stop"]


def test_a_sensor_that_hangs_makes_every_number_missing(world, caplog):
    world.memory_mb["perception"] = 1000.0
    world.go(3)
    world.go(30, measured=False)
    budget = world.cell("budget")
    assert {row["state"] for row in budget["rows"]} == {"missing"}
    assert all("hangs" in row["reason"] for row in budget["rows"])
    assert sum("hangs" in record.message for record in caplog.records) == 1
    assert budget["ladder"]["step"] == 1  # neither raised nor released by what nobody knows


def test_a_suspended_process_is_no_pressure_any_more_and_comes_back(world):
    world.memory_mb["planner"] = 500.0
    world.go(4)
    assert "planner" not in world.running
    world.memory_mb["planner"] = 50.0
    world.go(12)
    assert "planner" in world.running


def test_gpu_memory_counts_as_memory_of_its_process(world):
    world.readings = {f"gpu_memory_used_bytes.{2**30 + 1}": 0.7 * GB}
    world.go(3)
    assert row_of(world.cell("budget"), "memory_mb", "perception")["measured"] == 750.0


def test_the_twin_counts_in_no_total(world):
    world.pids["twin"] = world.running["twin"] = 2**30 + 3
    world.memory_mb["twin"], world.cpu_ratio["twin"] = 5000.0, 9.0
    world._cpu_s["twin"] = 0.0
    world.go(10)
    budget = world.cell("budget")
    assert row_of(budget, "memory_mb")["measured"] == 150.0
    assert row_of(budget, "cpu_ratio")["measured"] == pytest.approx(0.3)


def test_every_step_is_logged(world, caplog):
    caplog.set_level(logging.INFO)
    world.memory_mb["planner"] = 500.0
    world.go(4)
    world.go(20)
    told = [record.message for record in caplog.records]
    assert any("took suspend of planner: planner: memory_mb 500" in line for line in told)
    assert any("undid suspend of planner" in line for line in told)


def test_another_profile_undoes_the_steps_that_it_does_not_declare(world, profile):
    world.memory_mb["perception"] = 1000.0
    world.go(5)
    world.profile = replace(profile, ladder=profile.ladder[1:])
    world.go(0.5)
    assert world.cell("resource_directives")["rate_ratio"] == {"perception": 0.25}
    assert world.keeper.rate_ratios == {"perception": 0.25}


def test_what_a_profile_change_undoes_is_logged_counted_and_shown(world, profile, caplog):
    caplog.set_level(logging.INFO)
    world.memory_mb["perception"] = 1000.0
    world.go(3)
    world.keeper.adopt(replace(profile, ladder=profile.ladder[1:]))
    assert world.keeper.counts["undone"] == 1
    told = caplog.records[-1].message
    assert told == f"budgets: undid slow of perception: profile {profile.name} does not declare it"


def test_a_brown_out_is_seen_by_a_loop_that_comes_late(world):
    world.go(1)
    for events in (2.0, 0.0, 0.0):
        world.clock.ns += GB // 2
        world.readings = {"throttle_events.oc1": events}
        world.measure()
    world.keeper.step(world.running)
    assert "under-voltage" in world.cell("budget")["reason"]


def test_rounds_that_could_not_be_measured_are_counted(world):
    world.feed.failures = 3
    world.go(1)
    assert world.cell("budget")["ladder"]["counts"]["measuring_failed"] == 3


def test_every_row_says_how_its_budget_is_enforced(world):
    world.go(1)
    enforced = {row["process"]: row for row in world.cell("budget")["enforced"]}
    assert enforced["control"]["cpu"].startswith("none, because a control loop")
    assert enforced["executor"]["memory"] == "none, because it does not run"


def test_closing_ends_the_measuring(world):
    world.keeper.close()
    assert world.feed.closed


def test_a_full_disk_is_warned_of_and_slows_nobody(world, caplog):
    world.readings = {"disk_free_bytes": 0.1 * GB}
    world.go(30)
    budget = world.cell("budget")
    assert row_of(budget, "disk_free_mb")["over"]
    assert budget["ladder"]["step"] == 0
    assert [one.message for one in caplog.records] == [
        "budgets: disk_free_mb 100 below its budget of 500"
    ]


def test_models_may_claim_what_the_other_processes_leave_of_the_total(world, profile):
    book = ClaimBook(world.space, world.clock)
    others_mb = 80 + 250 + 60 + 250 + 250 + 150 + 150
    assert book.look().capacities == {"ram_mb": int(profile.total.memory_mb) - others_mb}
    world.profile = replace(profile, total=replace(profile.total, gpu_memory_mb=800))
    world.go(0.5)
    assert book.look().capacities["gpu_memory_mb"] == 800


def test_every_reading_of_the_computer_is_told_and_what_is_missing_with_its_reason(world):
    world.readings = {"temperature_c": 50.0, "power_w": None, "gpu_memory_used_bytes.17": 4.0}
    world.go(1)
    board = world.cell("board")
    assert board["readings"] == {"temperature_c": 50.0}
    assert "power_w" in board["missing"] and board["missing"]["power_w"]
