from pathlib import Path

import pytest

from vla_deploy.cli.main import main
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.urdf import urdf_of


def test_urdf_is_printed_or_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    expected, out = urdf_of(load_robot("butler")), tmp_path / "butler.urdf"
    assert main(["robot", "urdf"]) == 0
    assert capsys.readouterr().out == expected
    assert main(["robot", "urdf", "--robot", "butler", "--out", str(out)]) == 0
    assert out.read_text(encoding="utf-8") == expected
    assert str(out) in capsys.readouterr().out
