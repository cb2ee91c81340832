"""A shifted clock must reach only the processes that are started with it, while they run."""

import os
import shutil
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from sim_twin.campaigns.pressing.clock_shift import CannotShift, ClockShift

ECHO = """
import sys, time
for _ in sys.stdin:
    print(time.time(), time.monotonic(), flush=True)
"""
needs_compiler = pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc")


@needs_compiler
def test_the_clock_of_a_running_process_jumps_and_its_steady_clock_does_not(tmp_path: Path) -> None:
    shift = ClockShift(tmp_path)
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-S", "-c", ECHO],
        env={**os.environ, **shift.environment},
        stdin=pipe,
        stdout=pipe,
        text=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None

        def ask() -> tuple[float, float]:
            process.stdin.write("\n")  # type: ignore[union-attr]
            process.stdin.flush()  # type: ignore[union-attr]
            wall_s, steady_s = process.stdout.readline().split()  # type: ignore[union-attr]
            now_s = datetime.now(UTC).timestamp()
            return float(wall_s) - now_s, float(steady_s) - time.monotonic()

        answers = [ask()]
        for seconds in (86_400, -86_400):
            shift.set(seconds)
            answers.append(ask())
        assert shift.is_in(process.pid)
        process.stdin.close()
    assert [round(wall_s / 100) for wall_s, _ in answers] == [0, 864, -864]
    assert all(abs(steady_s) < 50 for _, steady_s in answers)
    assert not shift.is_in(os.getpid())


def test_without_a_compiler_the_reason_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(CannotShift, match="install gcc"):
        ClockShift(tmp_path)
