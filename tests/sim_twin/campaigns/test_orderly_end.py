"""SIGTERM ends a campaign, its workers and all that it has started, and leaves no folder."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from sim_twin.campaigns.orderly_end import EXIT_TERMINATED
from sim_twin.campaigns.switching import switches

SCRIPT = """
import sys, tempfile, time
from sim_twin.campaigns import __main__ as campaigns
from sim_twin.campaigns.faulting import fault_matrix

def play(cell, seed=0, robot=""):
    with tempfile.TemporaryDirectory(dir=sys.argv[1], prefix="vla-"):
        time.sleep(300.0)

if __name__ == "__main__":
    fault_matrix.play = play
    sys.exit(campaigns.start(["faults", "--only", "servo_bus"]))
"""
WORKERS = 2


def _wait_for_workers(folder: Path) -> None:
    end_s = time.monotonic() + 60.0
    while len(list(folder.iterdir())) < WORKERS:
        assert time.monotonic() < end_s, "the workers do not begin"
        time.sleep(0.05)


@pytest.mark.timeout(120)
@pytest.mark.parametrize("send", [os.kill, os.killpg], ids=["process", "group"])
def test_sigterm_ends_a_campaign_with_its_workers_and_their_folders(
    send: object, tmp_path: Path
) -> None:
    script, folder = tmp_path / "script.py", tmp_path / "cases"
    script.write_text(SCRIPT, encoding="utf-8")
    folder.mkdir()
    command = [sys.executable, str(script), str(folder)]
    campaign = subprocess.Popen(command, start_new_session=True)
    try:
        _wait_for_workers(folder)
        started = psutil.Process(campaign.pid).children(recursive=True)
        assert callable(send)
        send(campaign.pid, signal.SIGTERM)
        assert campaign.wait(30.0) == EXIT_TERMINATED
        assert psutil.wait_procs(started, timeout=5.0)[1] == []
        assert list(folder.iterdir()) == []
    finally:
        if campaign.poll() is None:
            os.killpg(campaign.pid, signal.SIGKILL)
            campaign.wait()


class _Closed:
    """Stand in for the robot and the watch; the campaign ends while the arms are folded."""

    clock = None
    closed = 0

    def __init__(self, *_words: object, **_options: object) -> None:
        pass

    def go(self, _targets: object) -> None:
        raise SystemExit(EXIT_TERMINATED)

    def close(self) -> None:
        _Closed.closed += 1


def test_a_campaign_that_is_ended_while_it_begins_ends_its_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(switches, "WorkingRobot", _Closed)
    monkeypatch.setattr(switches, "HostStallMonitor", _Closed)
    with pytest.raises(SystemExit):
        switches.SwitchCampaign(tmp_path, seed=0)
    assert _Closed.closed == 2
