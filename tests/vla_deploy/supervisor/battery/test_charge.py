"""A charge is read off a curve, and means the same for a while before it counts."""

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.robots.battery_settings import BatterySettings, BatterySource
from vla_deploy.supervisor.battery.charge import BatteryLevel, LevelState, estimated_charge, judged

PACK = BatterySettings(
    source=BatterySource.SERVOS,
    capacity_wh=50.0,
    cells=3,
    cell_curve=((3.0, 0.0), (3.6, 0.25), (3.7, 0.5), (4.2, 1.0)),
    low_ratio=0.25,
    critical_ratio=0.1,
)


@pytest.mark.parametrize(
    ("volts", "charge"),
    [(0.0, 0.0), (9.0, 0.0), (9.9, 0.125), (10.8, 0.25), (11.1, 0.5), (11.85, 0.75), (12.6, 1.0),
     (14.0, 1.0)],
)  # fmt: skip
def test_the_charge_is_read_off_the_curve_by_the_cell(volts: float, charge: float) -> None:
    assert estimated_charge(volts, PACK) == pytest.approx(charge)


def levels(*told: tuple[float, float | None]) -> list[str]:
    """Return the level after each (time in s, charge)."""
    state, found = LevelState(), []
    for at_s, charge in told:
        state = judged(state, charge, PACK, round(at_s * NS_PER_S))
        found.append(state.level.name)
    return found


@pytest.mark.parametrize(
    ("told", "last"),
    [
        ([(0, 0.5), (1, 0.25), (5, 0.25)], "USUAL"),
        ([(0, 0.5), (1, 0.25), (6, 0.25)], "LOW"),
        ([(0, 0.2), (3, 0.5), (5, 0.2)], "USUAL"),  # one good reading begins anew
        ([(0, 0.2), (5, 0.2), (6, 0.05), (11, 0.05)], "CRITICAL"),
        ([(0, 0.05), (5, 0.05)], "CRITICAL"),
        ([(0, 0.2), (5, 0.2), (6, 0.27)], "LOW"),  # not far enough above
        ([(0, 0.2), (5, 0.2), (6, 0.29)], "USUAL"),
        ([(0, 0.05), (5, 0.05), (6, 0.14)], "LOW"),
        ([(0, 0.2), (5, 0.2), (6, None)], "LOW"),  # what nobody measures has not become full
        ([(0, None), (60, None)], "USUAL"),
    ],
)
def test_a_level_holds_once_it_has_lasted_and_until_it_is_well_over(
    told: list[tuple[float, float | None]], last: str
) -> None:
    assert levels(*told)[-1] == last


def test_levels_are_ordered() -> None:
    assert BatteryLevel.USUAL < BatteryLevel.LOW < BatteryLevel.CRITICAL
