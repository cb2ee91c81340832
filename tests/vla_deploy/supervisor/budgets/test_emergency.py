from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from platforms.probes import open_probes
from vla_deploy.supervisor.budgets.emergency import Emergencies, critical_trips_c

AddZone = Callable[..., None]


@pytest.fixture
def add_zone(tmp_path: Path) -> AddZone:
    """Return what lays a thermal zone out in a folder that stands for the computer."""

    def add_zone(number: int, kind: str, value_c: float, critical_c: float | None = None) -> None:
        zone = tmp_path / f"sys/class/thermal/thermal_zone{number}"
        zone.mkdir(parents=True, exist_ok=True)
        (zone / "type").write_text(f"{kind}\n")
        (zone / "temp").write_text(f"{value_c * 1000:.0f}\n")
        (zone / "trip_point_0_type").write_text("passive\n")
        (zone / "trip_point_0_temp").write_text("70000\n")
        if critical_c is not None:
            (zone / "trip_point_1_type").write_text("critical\n")
            (zone / "trip_point_1_temp").write_text(f"{critical_c * 1000:.0f}\n")

    return add_zone


@pytest.fixture
def judge(tmp_path: Path) -> Callable[[], str]:
    """Return what judges the folder's probes as they are now."""
    emergencies = Emergencies(partial(critical_trips_c, tmp_path))

    def judge() -> str:
        with open_probes(tmp_path, nvml=False) as probes:
            return emergencies.judge(probes.read())

    return judge


def test_a_zone_that_appears_late_is_judged_by_its_own_trip_point(
    add_zone: AddZone, judge: Callable[[], str]
) -> None:
    add_zone(0, "cpu-thermal", 50.0, 104.5)
    assert judge() == ""
    add_zone(1, "gpu-thermal", 95.0, 97.0)
    assert judge() == "gpu-thermal at 95 degC, the board goes off at 97 degC"


def test_a_trip_point_that_could_be_read_once_is_not_forgotten(
    add_zone: AddZone, judge: Callable[[], str], tmp_path: Path
) -> None:
    add_zone(0, "cpu-thermal", 50.0, 104.5)
    assert judge() == ""
    (tmp_path / "sys/class/thermal/thermal_zone0/trip_point_1_temp").write_text("")
    add_zone(0, "cpu-thermal", 103.0)
    add_zone(1, "gpu-thermal", 50.0)
    assert "cpu-thermal at 103 degC" in judge()


def test_zones_of_one_kind_are_told_apart_as_their_probes_do(
    add_zone: AddZone, judge: Callable[[], str]
) -> None:
    add_zone(0, "acpitz", 95.0, 120.0)
    add_zone(1, "acpitz", 95.0, 96.0)
    assert judge() == "acpitz_1 at 95 degC, the board goes off at 96 degC"


def test_trips_are_read_again_only_for_a_zone_that_is_new(
    add_zone: AddZone, tmp_path: Path
) -> None:
    asked: list[int] = []

    def read() -> dict[str, float]:
        asked.append(len(asked))
        return critical_trips_c(tmp_path)

    emergencies = Emergencies(read)
    add_zone(0, "cpu-thermal", 50.0, 104.5)
    with open_probes(tmp_path, nvml=False) as probes:
        for _ in range(3):
            emergencies.judge(probes.read())
        assert len(asked) == 1
        add_zone(1, "gpu-thermal", 50.0, 104.5)
        emergencies.judge(probes.read())
    assert len(asked) == 2
