"""A power cut at any operation of an update leaves a release that runs; half updates are found."""

import os
from pathlib import Path
from typing import Any

import pytest

from sim_twin.campaigns.cutting.disk_history import (
    StateChoice,
    as_emptied,
    as_killed,
    as_lost,
    recorded,
)
from sim_twin.campaigns.cutting.power_cuts import SCENARIOS, played
from vla_deploy.install import releases

BY_NAME = {scenario.name: scenario for scenario in SCENARIOS}


def test_an_update_is_cut_off_and_the_computer_comes_up() -> None:
    case = played(BY_NAME["switch"], draws=0, seed=0, every=5)
    assert case.failures == ()
    assert case.figures["cuts"] > 20


FAULTY: dict[str, tuple[str, str, Any, str]] = {
    "a rename is not synced": (
        "remove",
        "sync_folder",
        lambda _folder: None,
        "listed, but not whole: new",
    ),
    "a trial is not synced": (
        "switch",
        "write_file",
        lambda path, text, _mode: path.write_text(text),
        "new is in use, and has not proved itself",
    ),
}


@pytest.mark.parametrize("fault", FAULTY)
def test_an_update_that_forgets_to_sync_is_found(
    monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    scenario, function, faulty, words = FAULTY[fault]
    monkeypatch.setattr(releases, function, faulty)
    case = played(BY_NAME[scenario], draws=1, seed=0, every=4)
    assert any(words in failure for failure in case.failures)


LEFT: dict[str, tuple[StateChoice, dict[str, str]]] = {
    "killed": (as_killed, {"new": "2", "synced": "1"}),
    "lost": (as_lost, {"old": "0"}),
    "emptied": (as_emptied, {"new": "", "synced": "1"}),
}


@pytest.mark.parametrize("what", LEFT)
def test_what_was_not_synced_may_be_lost(tmp_path: Path, what: str) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "old").write_text("0")
    with recorded(folder) as history:
        with (folder / "synced").open("w") as file:
            file.write("1")
            file.flush()
            os.fsync(file.fileno())
        (folder / "old").unlink()
        (folder / "fresh").write_text("2")
        (folder / "fresh").rename(folder / "new")
    choose, expected = LEFT[what]
    history.lay_out(len(history.operations) - 1, choose, tmp_path / "left")
    left = {path.name: path.read_text() for path in (tmp_path / "left").iterdir()}
    assert left == expected
