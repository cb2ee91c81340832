"""What `scripts/ros-environment` does where no wheels exist; an environment is made by hand."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "ros-environment"


@pytest.mark.parametrize(
    ("patch", "found"),
    [
        ("platform.machine = lambda: 'aarch64'", "aarch64"),
        ("platform.libc_ver = lambda: ('', '')", "x86_64"),
        ("sys.version_info = (3, 14)", "x86_64"),
    ],
)
def test_where_no_wheels_exist_it_says_so_and_succeeds(tmp_path, patch, found) -> None:
    python = tmp_path / "python"
    python.write_text(
        f'#!/bin/sh\nexec "{sys.executable}" -c "import platform, sys; {patch}; '
        'exec(sys.stdin.read())"\n'
    )
    python.chmod(0o755)
    folder = tmp_path / "venv"
    done = subprocess.run([SCRIPT, folder, python], capture_output=True, text=True, check=False)
    (line,) = done.stderr.splitlines()
    assert line.startswith("ROS: left out: its wheels are for x86-64 Linux")
    assert found in line
    assert (done.returncode, folder.exists()) == (0, False)
