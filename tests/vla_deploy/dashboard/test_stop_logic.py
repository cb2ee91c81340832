"""Run the tests of the page's stop logic, which are in its own language."""

import os
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import pytest


def test_the_pages_stop_logic_holds() -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node; the tests in a browser hold the same where it is missing")
    logic = files("vla_deploy.dashboard") / "static" / "stop_logic.js"
    done = subprocess.run(
        [node, "--test", str(Path(__file__).with_name("stop_logic.test.mjs"))],
        env={**os.environ, "STOP_LOGIC": str(logic)},
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert done.returncode == 0, done.stdout
