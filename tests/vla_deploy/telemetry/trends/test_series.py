"""Series are gauges as they are, and counters by the second."""

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.metrics import Point, Readings
from vla_deploy.telemetry.trends import SeriesMaker, unit_of

LATE = "vla_control_late_ticks_total"
MEMORY = "vla_process_memory_bytes"


def readings(second: int, late: float) -> Readings:
    points = {
        LATE: (Point(labels=(), value=late),),
        MEMORY: (Point(labels=("a/b,c",), value=5.0),),
        "vla_control_state": (Point(labels=("armed",), value=1.0),),
    }
    return Readings(now_ns=second * NS_PER_S, points=points, missing=(), left_out=0)


def test_a_counter_becomes_what_it_gains_per_second_from_its_second_reading_on() -> None:
    maker = SeriesMaker()
    assert LATE not in maker.values(readings(10, 100.0))
    assert maker.values(readings(12, 110.0))[LATE] == 5.0


def test_a_counter_that_began_anew_has_gained_what_it_counts() -> None:
    maker = SeriesMaker()
    maker.values(readings(10, 100.0))
    assert maker.values(readings(12, 4.0))[LATE] == 2.0


def test_only_what_the_table_keeps_becomes_a_series_and_names_stay_unambiguous() -> None:
    assert set(SeriesMaker().values(readings(10, 0.0))) == {f"{MEMORY}/a_b_c"}
    assert (unit_of(f"{MEMORY}/a_b_c"), unit_of(LATE)) == ("bytes", "1/s")
