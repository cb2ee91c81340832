import pytest

from platforms import ProfileError
from platforms.power_switch import PowerSwitch

CONFIGURATION = """
< POWER_MODEL ID=0 NAME=MODE_15W >
CPU_ONLINE CORE_0 1
TPC_POWER_GATING TPC_PG_MASK 0
GPU MAX_FREQ 612000000

< POWER_MODEL ID=1 NAME=25W >
TPC_POWER_GATING TPC_PG_MASK 0
GPU MAX_FREQ 918000000

< POWER_MODEL ID=3 NAME=7W >
TPC_POWER_GATING TPC_PG_MASK 252

< PM_CONFIG DEFAULT=0 >
"""
SETS = '#!/bin/sh\n[ "$1" = -m ] && printf "pmode:%04d" "$2" > {status}\n'


@pytest.fixture
def board(tmp_path):
    """Describe a board in mode 15W; return a switch whose nvpmodel does what it is told."""
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/nvpmodel.conf").write_text(CONFIGURATION)
    (tmp_path / "var/lib/nvpmodel").mkdir(parents=True)
    status = tmp_path / "var/lib/nvpmodel/status"
    status.write_text("pmode:0000 fmode:quiet\n")

    def board(script: str = SETS) -> PowerSwitch:
        command = tmp_path / "nvpmodel"
        command.write_text(script.format(status=status))
        command.chmod(0o755)
        return PowerSwitch(tmp_path, [str(command)])

    return board


def test_a_mode_is_set_by_its_name_and_read_back(board):
    switch = board()
    switch.check("25W")
    assert switch.set("25W") == ""
    assert switch.current() == "25W"
    assert switch.set("15W") == "", "some releases call it MODE_15W"
    assert switch.current() == "MODE_15W"


def test_a_mode_that_is_set_already_is_left_alone(board):
    assert board("#!/bin/sh\nexit 9\n").set("15W") == ""


def test_no_mode_asks_for_nothing_even_without_a_jetson(tmp_path):
    switch = PowerSwitch(tmp_path)
    switch.check("")
    assert (switch.set(""), switch.current()) == ("", "")


def test_a_mode_that_does_not_take_is_told_with_what_nvpmodel_said(board):
    switch = board("#!/bin/sh\necho NVPM ERROR: no permission >&2\nexit 1\n")
    assert switch.set("25W") == (
        "power mode 25W: it is MODE_15W after setting it; nvpmodel said: NVPM ERROR: no permission"
    )


def test_a_missing_nvpmodel_is_told(board, tmp_path):
    board()
    assert "No such file" in PowerSwitch(tmp_path, ["/nowhere/nvpmodel"]).set("25W")


def test_a_mode_that_other_units_get_power_in_needs_a_reboot(board):
    with pytest.raises(ProfileError, match=r"MODE_15W -> 7W needs a reboot.*nvpmodel -m 3, reboot"):
        board().check("7W")


def test_an_unknown_mode_lists_those_of_the_board(board):
    with pytest.raises(ProfileError, match=r"one of this board \(MODE_15W, 25W, 7W\), got '40W'"):
        board().check("40W")


def test_a_board_without_modes_says_why(tmp_path):
    with pytest.raises(ProfileError, match=r"there is no /etc/nvpmodel.conf"):
        PowerSwitch(tmp_path).check("15W")


def test_a_mode_that_cannot_be_read_back_is_not_set(board, tmp_path):
    switch = board()
    (tmp_path / "var/lib/nvpmodel/status").unlink()
    with pytest.raises(ProfileError, match="cannot be read back"):
        switch.check("25W")
