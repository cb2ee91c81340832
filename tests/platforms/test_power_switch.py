import socket
import subprocess
import threading
from pathlib import Path

import pytest

from platforms import ProfileError
from platforms.power_service import SOCKET, ask_for_mode
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
SETS = """#!/bin/sh
[ "$1" = -m ] && printf "pmode:%04d" "$2" > {status} && exit
printf 'NV Power Mode: some\\n%d\\n' "$(sed 's/pmode:0*//;s/^$/0/' {status})"
"""
BY_ROOT = Path(__file__).parents[2] / "systemd" / "set-power-mode"


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


@pytest.fixture
def service(tmp_path):
    """Start what installs as vla-deploy-power.socket: each connection is a run of its script."""
    path = tmp_path / SOCKET
    path.parent.mkdir()
    command = ["sh", BY_ROOT, tmp_path / "nvpmodel", tmp_path / "etc/nvpmodel.conf"]
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen()

        def serve() -> None:
            while True:
                line, _ = listener.accept()
                with line:
                    if line.recv(1, socket.MSG_PEEK) == b"":
                        return
                    subprocess.run(command, stdin=line, stdout=line, check=True)

        server = threading.Thread(target=serve)
        server.start()
        yield path
        with socket.socket(socket.AF_UNIX) as last:
            last.connect(str(path))
        server.join()


def no_command(root: Path) -> PowerSwitch:
    """Return a switch that may not run nvpmodel itself."""
    return PowerSwitch(root, ["/nowhere/nvpmodel"])


def test_where_the_service_is_installed_root_sets_the_mode(board, service, tmp_path):
    board()
    switch = no_command(tmp_path)
    assert switch.set("25W") == ""
    assert switch.current() == "25W"
    assert switch.set("15W") == ""
    assert switch.current() == "MODE_15W"


def test_the_service_says_what_nvpmodel_said(board, service, tmp_path):
    board("#!/bin/sh\n[ $1 = -q ] && echo 0 && exit\necho NVPM ERROR: no such clock >&2\nexit 1\n")
    assert no_command(tmp_path).set("25W") == (
        "power mode 25W: it is MODE_15W after setting it; vla-deploy-power.service said: "
        "mode 0 is set; nvpmodel said: NVPM ERROR: no such clock"
    )


def test_the_service_sets_no_mode_that_the_board_does_not_declare(board, service):
    board()
    assert ask_for_mode(service, 2, 5.0).endswith("nvpmodel.conf has no mode 2")


@pytest.mark.parametrize("asked", ["", "1; reboot", "-m 1", "../1", "11111", "1\t2", "$(id)"])
def test_the_service_takes_nothing_but_a_number(board, tmp_path, asked):
    board("#!/bin/sh\nexit 9\n")
    command = ["sh", BY_ROOT, tmp_path / "nvpmodel", tmp_path / "etc/nvpmodel.conf"]
    done = subprocess.run(command, input=asked + "\n", capture_output=True, text=True, check=True)
    assert done.stdout == "refused: expected the number of a mode\n"


def test_a_service_that_is_gone_is_told(board, tmp_path):
    board()
    (tmp_path / SOCKET).parent.mkdir()
    with socket.socket(socket.AF_UNIX) as nobody:
        nobody.bind(str(tmp_path / SOCKET))
    assert "refused" in no_command(tmp_path).set("25W")


def test_a_mode_without_a_number_is_not_asked_for(board):
    assert board().set("40W") == "power mode 40W: this board has none of that name"
