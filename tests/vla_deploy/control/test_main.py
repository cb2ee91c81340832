"""Start the real control process where it cannot work, and read what it says."""

import subprocess
import sys
from pathlib import Path

import pytest

from vla_deploy.runtime.exit_codes import EXIT_DEVICE_ABSENT


@pytest.mark.stack
def test_a_missing_device_is_one_clear_line_and_an_exit_code_of_its_own(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "vla_deploy.control", "--run-dir", str(tmp_path)]
    command += ["--robot", "butler", "--profile", "desktop", "--devices-dir", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == EXIT_DEVICE_ABSENT
    (line,) = done.stderr.strip().splitlines()
    assert str(tmp_path / "servos") in line
