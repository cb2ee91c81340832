"""Run the tests of the page's pure functions, which are in its own language."""

import os
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.parametrize("name", sorted(path.name for path in HERE.glob("*.test.mjs")))
def test_the_pages_logic_holds(name: str) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node; the tests in a browser hold the same where it is missing")
    done = subprocess.run(
        [node, "--test", str(HERE / name)],
        env={**os.environ, "PAGE": str(files("vla_deploy.dashboard") / "static")},
        capture_output=True,
        text=True,
        timeout=50,
        check=False,
    )
    assert done.returncode == 0, done.stdout
