"""What `scripts/fresh-machine` refuses; a machine itself takes minutes and is made by hand."""

import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "fresh-machine"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ([], "got '' for the suite, such as trixie"),
        (["--user"], "got '--user' for the suite"),
        (["trixie", "--root"], "got --root"),
        (["trixie", "--folder"], "got no folder"),
    ],
)
def test_bad_arguments_are_one_line_and_exit_code_2(words: list[str], complaint: str) -> None:
    refused = subprocess.run([SCRIPT, *words], capture_output=True, text=True, check=False)
    (line,) = refused.stderr.splitlines()
    assert complaint in line
    assert refused.returncode == 2
