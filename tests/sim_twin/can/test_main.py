"""Serve CAN nodes from the command line, with right and wrong options."""

import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = [sys.executable, "-m", "sim_twin.can", "--socket"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--nodes", "1", "1"], "different ids of 1..126"),
        (["--nodes", "999"], "got [999]"),
        (["--nodes", "63", "--protocol", "odrive"], "0..62 for odrive"),
    ],
)
def test_node_ids_that_cannot_be_are_refused(
    tmp_path: Path, words: list[str], complaint: str
) -> None:
    command = [*COMMAND, str(tmp_path / "can"), *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 2
    assert complaint in done.stderr


@pytest.mark.stack
def test_a_socket_in_use_is_one_line(tmp_path: Path) -> None:
    command = [*COMMAND, str(tmp_path / "can")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline().startswith("ready: cia402 nodes [1, 2]")
        second = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
        first.terminate()
    assert second.returncode == 2
    assert second.stderr.count("\n") == 1
    assert "choose another --socket" in second.stderr
