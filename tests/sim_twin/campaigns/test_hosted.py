"""The hog must count as the process that it burdens, follow its settings and end with it."""

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from sim_twin.campaigns.hosted import BURDENED, table_with_hog
from sim_twin.campaigns.pressing import hog
from vla_deploy.supervisor.table import TABLE


def test_only_one_process_of_the_table_is_burdened(tmp_path: Path) -> None:
    for spec, plain in zip(table_with_hog(tmp_path / "wish.json"), TABLE, strict=True):
        if spec.name == BURDENED:
            assert spec.command[2:] == plain.command
            assert Path(spec.command[0]).name == "hog.py"
        else:
            assert spec == plain


@pytest.mark.stack
def test_the_hog_is_a_child_that_follows_its_wish_and_ends_with_its_parent(tmp_path: Path) -> None:
    wish = tmp_path / "wish.json"
    wish.write_text(json.dumps({"memory_mb": 60, "busy_cores": 0}))
    program = "import sys; print('up', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, str(Path(hog.__file__)), str(wish), "-c", program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"up\n"
        children = psutil.Process(process.pid).children()
        assert children
        until(lambda: held_mb(children) > 60)
        wish.write_text(json.dumps({"memory_mb": 0, "busy_cores": 0}))
        until(lambda: held_mb(children) < 60)
        process.kill()
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive


def held_mb(processes: list[psutil.Process]) -> float:
    return max(one.memory_info().rss for one in processes) / 1e6


def until(condition: Callable[[], bool]) -> None:
    end_ns = time.monotonic_ns() + 20_000_000_000
    while not condition():
        assert time.monotonic_ns() < end_ns
        time.sleep(0.05)
