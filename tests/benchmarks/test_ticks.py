import json

import pytest

from benchmarks.ticks import main, sleep_bare
from drivers.clock import NS_PER_S


class OversleepingClock:
    """Wake a fifth of a second later than asked, each tenth time."""

    def __init__(self) -> None:
        self._now_ns = 0
        self._sleeps = 0

    def now_ns(self) -> int:
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self._sleeps += 1
        self._now_ns = deadline_ns + (self._sleeps % 10 == 0) * NS_PER_S // 5


def test_the_bare_loop_counts_how_often_the_machine_wakes_it_too_late() -> None:
    ticks = sleep_bare(OversleepingClock(), period_s=0.5, seconds=50.0)
    assert ticks.tick == 100
    assert ticks.late_ticks == 9


@pytest.mark.slow
@pytest.mark.stack
@pytest.mark.timeout(180)
def test_the_report_holds_each_combination_beside_a_loop_that_only_sleeps(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--seconds", "1"]) == 0
    report = json.loads(capsys.readouterr().out)
    for row in ("late_ratio", "late_ratio_bare"):
        for load in ("idle", "loaded"):
            assert 0.0 <= report[f"{row}_plain_{load}"] <= 1.0
            assert (report[f"{row}_fifo_{load}"] is None) is not report["realtime"]
