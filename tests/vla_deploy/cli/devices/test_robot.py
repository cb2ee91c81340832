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


def test_what_cannot_be_read_or_written_is_named_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "nowhere" / "butler.urdf"
    assert main(["robot", "urdf", "--out", str(out)]) == 2
    assert f"{out}: No such file or directory" in capsys.readouterr().err
    assert main(["robot", "urdf", "--robot", "nobody"]) == 2
    told = capsys.readouterr().err
    assert "nobody" in told
    assert "butler" in told
