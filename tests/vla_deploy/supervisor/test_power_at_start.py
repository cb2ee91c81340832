import logging
from pathlib import Path

import pytest

from platforms.power_switch import PowerSwitch
from vla_deploy.supervisor.profiles.power_at_start import set_at_start

SECTION = "< POWER_MODEL ID={} NAME={} >\nTPC_POWER_GATING TPC_PG_MASK {}\n"


@pytest.fixture
def board(tmp_path: Path) -> PowerSwitch:
    """Describe a board in mode 15W whose nvpmodel does what it is told."""
    modes = ((0, "15W", 0), (1, "25W", 0), (3, "7W", 252))
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/nvpmodel.conf").write_text("".join(SECTION.format(*row) for row in modes))
    status = tmp_path / "var/lib/nvpmodel/status"
    status.parent.mkdir(parents=True)
    status.write_text("pmode:0000\n")
    command = tmp_path / "nvpmodel"
    command.write_text(f'#!/bin/sh\nprintf "pmode:%04d" "$2" > {status}\n')
    command.chmod(0o755)
    return PowerSwitch(tmp_path, [str(command)])


def test_a_run_starts_in_the_mode_of_its_profile(board: PowerSwitch) -> None:
    set_at_start(board, "25W")
    assert board.current() == "25W"


@pytest.mark.parametrize(
    ("mode", "said"), [("7W", "15W -> 7W needs a reboot"), ("40W", "expected one of this board")]
)
def test_a_mode_that_cannot_be_set_is_told_and_left(
    board: PowerSwitch, caplog: pytest.LogCaptureFixture, mode: str, said: str
) -> None:
    set_at_start(board, mode)
    assert said in caplog.text
    assert caplog.text.startswith("WARNING")
    assert board.current() == "15W"


def test_a_profile_without_a_mode_says_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    set_at_start(PowerSwitch(tmp_path), "")
    assert caplog.text == ""
