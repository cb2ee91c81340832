"""Serve CAN nodes from the command line, with right and wrong options."""

import subprocess
import sys
from pathlib import Path

import can
import pytest

from drivers.odrive.codec import OdriveCommand
from sim_twin.can.__main__ import main
from sim_twin.can.bus.wire import DEFAULT_BITRATE as BITRATE
from sim_twin.can.odrive.axis import PROTOCOL_VERSION

COMMAND = [sys.executable, "-m", "sim_twin.can", "--socket"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--nodes", "1", "1"], "different ids of 1..126"),
        (["--nodes", "999"], "got [999]"),
        (["--nodes", "63", "--protocol", "odrive"], "0..62 for odrive"),
        (["--slcan", "--bitrate", "800000"], "expected a bit rate of slcan (10000, "),
        (["--slcan", "/proc/self/exe"], "no link to a pseudo-terminal"),
        (["--slcan", __file__], "no link to a pseudo-terminal"),
    ],
)
def test_options_that_cannot_be_are_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    complaint: str,
) -> None:
    monkeypatch.setattr(sys, "argv", ["sim_twin.can", "--socket", str(tmp_path / "can"), *words])
    with pytest.raises(SystemExit) as refusal:
        main()
    assert refusal.value.code == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.stack
def test_a_socket_in_use_is_one_line(tmp_path: Path) -> None:
    command = [*COMMAND, str(tmp_path / "can")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline().startswith("ready: cia402 nodes [1, 2]")
        second = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
        first.terminate()
    assert second.returncode == 2
    assert second.stderr.count("\n") == 1
    assert "choose another --socket" in second.stderr


@pytest.mark.stack
def test_clients_of_the_hub_and_of_the_serial_adapter_share_the_bus(tmp_path: Path) -> None:
    path, tty = tmp_path / "can", tmp_path / "can.tty"
    command = [*COMMAND, str(path), "--slcan", "--nodes", "0", "--protocol", "odrive"]
    request = can.Message(arbitration_id=OdriveCommand.GET_VERSION, is_extended_id=False)
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        ready = server.stdout.readline().strip()
        assert ready == f"ready: odrive nodes [0] at {path}, slcan at {tty} ({tty.readlink()})"
        with (
            can.Bus(interface="vla_hub", channel=str(path)) as hub,
            can.Bus(
                interface="slcan", channel=str(tty), bitrate=BITRATE, sleep_after_open=0
            ) as line,
        ):
            assert line.get_version(timeout=5.0) == (10, 13)
            line.send(request)
            for bus in (line, hub):
                answers = (bus.recv(timeout=5.0) for _ in range(200))
                answer = next(
                    each for each in answers if each and each.dlc == 8 and each.arbitration_id == 0
                )
                assert bytes(answer.data)[0] == PROTOCOL_VERSION
        server.terminate()
