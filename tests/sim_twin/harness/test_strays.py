"""Stray processes of a run are found, tested with real processes."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from sim_twin.harness.robot import marked
from sim_twin.harness.service import strays
from sim_twin.harness.service_runner import MARK
from vla_deploy.runtime.logs import RUN_ID_VARIABLE
from vla_deploy.supervisor.runs.runtime import PROCESS_VARIABLE

pytestmark = pytest.mark.stack
RUN = "20260101-120000-1"
# The child says itself that it runs: until its interpreter has begun its environment reads empty.
CHILD = "import os, sys; print(os.getpid(), flush=True); sys.stdin.read()"
ROW = f"""
import subprocess, sys
subprocess.Popen([sys.executable, "-c", {CHILD!r}], start_new_session=bool(int(sys.argv[1])))
if int(sys.argv[2]):
    sys.stdin.read()
"""
Start = Callable[..., tuple[int, int]]


@pytest.fixture
def mark(tmp_path: Path) -> str:
    return str(tmp_path)


@pytest.fixture
def start(mark: str) -> Iterator[Start]:
    """Start a row and a child of its; both end when their input does."""
    started: list[subprocess.Popen[str]] = []

    def start(*, stays: bool, own_session: bool, run_id: str = RUN) -> tuple[int, int]:
        environment = {MARK: mark, RUN_ID_VARIABLE: run_id, PROCESS_VARIABLE: "planner"}
        row = subprocess.Popen(
            [sys.executable, "-c", ROW, str(int(own_session)), str(int(stays))],
            env={**os.environ, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(row)
        assert row.stdout is not None
        child = int(row.stdout.readline())
        if not stays:
            row.wait(20)
        return row.pid, child

    yield start
    for row in started:
        assert row.stdin is not None
        assert row.stdout is not None
        row.stdin.close()
        row.stdout.close()
        row.wait(20)


def found(mark: str, rows: set[int] | None) -> list[str]:
    return strays(marked(MARK, mark), RUN, rows)


@pytest.mark.parametrize("own_session", [False, True])
def test_a_row_answers_for_itself_and_its_children(
    start: Start, mark: str, own_session: bool
) -> None:
    row, _ = start(stays=True, own_session=own_session)
    assert found(mark, {row}) == []


@pytest.mark.parametrize("own_session", [False, True])
def test_what_a_dead_row_of_the_same_run_has_left_is_a_stray(
    start: Start, mark: str, own_session: bool
) -> None:
    _, left = start(stays=False, own_session=own_session)
    successor, _ = start(stays=True, own_session=False)
    assert mark not in " ".join(psutil.Process(left).cmdline())
    assert found(mark, {successor}) == [f"{left} of this run and no row, left by planner"]


def test_what_is_in_no_row_is_a_stray_though_its_parent_lives(start: Start, mark: str) -> None:
    row, child = start(stays=True, own_session=True)
    assert {stray.split()[0] for stray in found(mark, set())} == {
        str(row),
        str(child),
    }


def test_whatever_is_of_another_run_is_a_stray(start: Start, mark: str) -> None:
    row, child = start(stays=True, own_session=True, run_id="20260101-110000-1")
    assert sorted(found(mark, {row})) == sorted(
        f"{pid} of run 20260101-110000-1" for pid in (row, child)
    )


def test_another_robots_processes_are_not_ours(start: Start, mark: str) -> None:
    start(stays=False, own_session=True)
    assert marked(MARK, mark)
    assert marked(MARK, f"{mark}-other") == []


def test_without_a_table_the_run_that_goes_on_is_not_judged(start: Start, mark: str) -> None:
    start(stays=False, own_session=True)
    assert found(mark, None) == []
