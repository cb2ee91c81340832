import pytest

from platforms import ProfileError, load_profile
from platforms.profile import PROFILES

GOOD = (PROFILES / "desktop.toml").read_text()
TEN_FAULTS = """
control_rate_hz = "fast"
bus_watchdog_s = 3.0
camera_rate_hz = true
perception_rate_hz = 0
executor_rate_hz = 50
realtime_priority = 10.5
colour = "blue"

[budgets]
supervisor = { memory_mb = 80, cpu_ratio = 0.1 }
control = { memory_mb = -1, cpu_ratio = 0.8 }
perception = { memory_mb = 400 }
planner = 7
executor = { memory_mb = 250, cpu_ratio = 0.5 }
twin = { memory_mb = 900, cpu_ratio = 1.5 }
"""


def faults_of(tmp_path, text: str) -> tuple[str, ...]:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ProfileError) as caught:
        load_profile(path)
    assert all(fault.startswith(f"{path}: ") for fault in caught.value.faults)
    return tuple(fault.removeprefix(f"{path}: ") for fault in caught.value.faults)


@pytest.mark.parametrize("path", sorted(PROFILES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_shipped_profile_loads_under_its_name(path):
    assert load_profile(path.stem).name == path.stem


def test_a_profile_is_loaded_by_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(GOOD.replace("control_rate_hz = 250", "control_rate_hz = 100"))
    profile = load_profile(str(path))
    assert (profile.name, profile.control_rate_hz) == ("mine", 100)
    assert profile.budgets["control"].memory_mb == 250


def test_ten_faults_are_reported_as_ten(tmp_path):
    faults = faults_of(tmp_path, TEN_FAULTS)
    assert sorted(faults) == sorted(
        [
            "colour: unknown key, expected control_rate_hz, bus_watchdog_s, can_heartbeat_s, "
            "camera_rate_hz, perception_rate_hz, executor_rate_hz, realtime_priority",
            "control_rate_hz: expected a number from 50 to 1000 Hz, got 'fast'",
            "bus_watchdog_s: expected a number from 0.02 to 2.54 s, got 3.0",
            "can_heartbeat_s: expected a number from 0.01 to 2 s, got nothing",
            "camera_rate_hz: expected a number from 1 to 60 Hz, got True",
            "perception_rate_hz: expected a number from 0.5 to 60 Hz, got 0",
            "realtime_priority: expected an integer from 0 to 80, got 10.5",
            "budgets.control.memory_mb: expected a number from 1 to 131072 MB, got -1",
            "budgets.perception.cpu_ratio: expected a number from 0.01 to 64 cores, got nothing",
            "budgets.planner: expected a table with memory_mb, cpu_ratio, got 7",
        ]
    )


def test_a_watchdog_shorter_than_three_control_periods_is_a_fault(tmp_path):
    text = GOOD.replace("bus_watchdog_s = 0.3", "bus_watchdog_s = 0.025").replace(
        "control_rate_hz = 250", "control_rate_hz = 100"
    )
    assert faults_of(tmp_path, text) == (
        "bus_watchdog_s: expected at least 3 control periods (0.03 s), got 0.025",
    )


def test_a_watchdog_of_exactly_three_control_periods_is_allowed(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        GOOD.replace("bus_watchdog_s = 0.3", "bus_watchdog_s = 0.03").replace(
            "control_rate_hz = 250", "control_rate_hz = 100"
        )
    )
    assert load_profile(path).bus_watchdog_s == 0.03


def test_an_unknown_process_and_missing_budgets_are_faults(tmp_path):
    text = GOOD + "radio = { memory_mb = 1, cpu_ratio = 1 }\n"
    assert faults_of(tmp_path, text)[0].startswith("budgets.radio: unknown process")
    assert faults_of(tmp_path, GOOD.partition("[budgets]")[0])[0].startswith("budgets: expected a")


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(ProfileError, match=r"no profile 'deskop': choose .*desktop"):
        load_profile("deskop")


def test_broken_toml_and_missing_files_name_the_path(tmp_path):
    assert "line 1" in faults_of(tmp_path, "control_rate_hz = = 3")[0]
    with pytest.raises(ProfileError, match=r"gone\.toml: expected a TOML file"):
        load_profile(tmp_path / "gone.toml")
