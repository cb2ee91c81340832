"""A profile is fitted to a computer by what was observed; what it promises can be kept."""

import tomllib
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from platforms import load_profile
from platforms.profile import profile_from
from platforms.profile_source import ProfileSource, merged, read_source
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.supervisor.errors import ProfileDoesNotFit
from vla_deploy.supervisor.profiles.observation import (
    Observation,
    Observer,
    PacedRate,
    ProcessNeed,
)
from vla_deploy.supervisor.profiles.tuning import (
    Computer,
    ModelTime,
    TuningMode,
    profile_text,
    tuned,
)

SOURCE = read_source("desktop")
LARGE = Computer(cpu_count=8, memory_mb=16_000)
SMALL = Computer(cpu_count=2, memory_mb=16_000)
CPU = "CPUExecutionProvider"


def observed(
    late_ratio: float = 0.0,
    perception_hz: float = 5.0,
    hottest_c: float | None = None,
    **cpu: float,
) -> Observation:
    usual = {"control": 0.3, "perception": 0.4, "executor": 0.1, "planner": 0.1} | cpu
    return Observation(
        robot="so101",
        seconds=60.0,
        busy_ratio=0.9,
        processes={
            name: ProcessNeed(cpu_ratio=ratio, memory_mb=100.0) for name, ratio in usual.items()
        },
        rates={
            "control_rate_hz": PacedRate(declared_hz=250.0, reached_hz=250.0),
            "perception_rate_hz": PacedRate(declared_hz=5.0, reached_hz=perception_hz),
        },
        late_ratio=late_ratio,
        hottest_c=hottest_c,
    )


def after(seen: Observation, computer: Computer = LARGE, **options: Any) -> dict[str, Any]:
    """Return the values chosen, having checked that they make a valid profile."""
    choices = tuned(seen, SOURCE.values, computer, **{"margin": 0.25} | options)
    text = profile_text("desktop", choices, ["a heading"])
    document = tomllib.loads(text)
    assert document.pop("inherits") == "desktop"
    profile_from(ProfileSource.of_values("mine.toml", merged(SOURCE.values, document)))
    return {choice.key: choice.after for choice in choices}


def test_a_computer_with_room_keeps_the_profile() -> None:
    assert after(observed()) == {"board.cpu_count": 8, "board.memory_mb": 16_000}


@pytest.mark.parametrize(
    ("seen", "options", "key", "value"),
    [
        (observed(perception_hz=3.0), {}, "perception_rate_hz", 2.0),
        (observed(perception_hz=0.1), {}, "perception_rate_hz", 1.0),
        (observed(late_ratio=0.02), {}, "control_rate_hz", 200),
        (observed(control=1.2), {}, "control_rate_hz", 125),
        (observed(executor=0.9), {}, "budgets.executor.cpu_ratio", 1.12),
        (observed(), {"mode": TuningMode.LOW_POWER}, "camera_rate_hz", 2.5),
        (observed(), {"mode": TuningMode.EFFICIENT_VISION}, "perception_rate_hz", 2.5),
        (observed(), {"mode": TuningMode.LOW_MEMORY}, "models.detector.memory_arena", False),
    ],
)
def test_what_was_short_is_given_more_or_asked_for_less(
    seen: Observation, options: dict[str, Any], key: str, value: float
) -> None:
    assert after(seen, **options)[key] == value


def test_on_fewer_cores_all_budgets_share_what_there_is() -> None:
    values = after(observed(), SMALL)
    assert values["board.cpu_count"] == values["budgets.total.cpu_ratio"] == 2
    assert 0.3 * 1.25 <= values["budgets.control.cpu_ratio"] < 0.8


def test_perception_gives_way_where_the_cores_are_not_enough() -> None:
    values = after(observed(perception=1.2), SMALL)
    assert values["perception_rate_hz"] == 4.0  # 1.7 of 1.5 cores: a sixth of its 1.2 less
    assert values["camera_rate_hz"] == 4.0


def test_a_hot_board_is_relieved() -> None:
    source = read_source("jetson_orin_nano_8gb")  # its limit is 90 degC
    choices = tuned(observed(hottest_c=84.0), source.values, LARGE, margin=0.25)
    assert "84 degC" in {one.key: one.why for one in choices}["perception_rate_hz"]


@pytest.mark.parametrize(
    ("frame_s", "precision"), [((0.03, 0.02), None), ((0.02, 0.021), None), ((0.02, 0.03), "fp32")]
)
def test_the_detectors_file_is_changed_only_for_a_faster_one(
    frame_s: tuple[float, float], precision: str | None
) -> None:
    times = [
        ModelTime(provider=CPU, precision=name, frame_s=one)
        for name, one in zip(("fp32", "int8"), frame_s, strict=True)
    ]
    assert after(observed(), detectors=times).get("models.detector.precision") == precision


@pytest.mark.parametrize(
    ("seen", "computer", "words"),
    [
        (observed(control=6.0), LARGE, "control needs 6.00 cores"),
        (observed(planner=1.5, perception=0.0), SMALL, "budgets.cpu_ratio"),
        (observed(), Computer(cpu_count=8, memory_mb=300), "budgets.memory_mb"),
    ],
)
def test_what_cannot_fit_is_refused(seen: Observation, computer: Computer, words: str) -> None:
    with pytest.raises(ProfileDoesNotFit, match=words):
        after(seen, computer)


def test_a_run_is_observed_by_its_own_counts(tmp_path: Any) -> None:
    clock = ManualClock(NS_PER_S)
    space = SharedSpace(tmp_path / "ipc", clock)
    status, table = (
        space.cell_writer(topics.CONTROL_STATUS),
        space.cell_writer(topics.PROCESS_TABLE),
    )
    images = space.frame_writer(topics.RGBD)
    observer = Observer(RobotLink(tmp_path, clock), load_profile("desktop"), on_twin_time=False)
    usage = {"memory_mb": 50.0, "cpu_ratio": 0.5}
    for second in range(11):
        status.put_document({"tick": 250 * second, "late_ticks": 5 * second})
        table.put_document(
            {
                "robot": "so101",
                "processes": [{"name": "control", **usage}, {"name": "twin", **usage}],
                "supervisor": {"memory_mb": None, "cpu_ratio": None},
            }
        )
        for _ in range(4):
            images.put(b"\0" * 12, width=2, height=2, stamp_ns=clock.ns)
        observer.look()
        clock.ns += NS_PER_S
    seen = observer.observation()
    assert seen.processes == {"control": ProcessNeed(cpu_ratio=0.5, memory_mb=50.0)}
    assert seen.rates["control_rate_hz"].reached_hz == 250.0
    assert seen.rates["perception_rate_hz"].reached_hz == 4.0
    assert seen.troubles == (
        "perception_rate_hz: reached 4 Hz of 5 Hz",
        "control: 2.0% of its ticks late, limit 1%",
    )
