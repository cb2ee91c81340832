import json
import random
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import pytest

from platforms import load_profile
from platforms.tree import ValueMissing
from vla_deploy.cli.main import main
from vla_deploy.doctor import (
    CHECKS,
    DoctorFinding,
    FindingLevel,
    Section,
    as_document,
    as_text,
    examine,
    recorded_context,
    succeeded,
    table,
)
from vla_deploy.doctor.context import ask_command
from vla_deploy.doctor.software import EGL_SCRIPT
from vla_deploy.doctor.table import Check
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.profiles.profile_choice import choice_of

TREES = sorted(path.stem for path in (Path(__file__).parents[2] / "platforms/trees").glob("*"))
GARBAGE = (b"", b"\xff\xfe\x00", b"-1\n", b"nan", b"9" * 5000, b"a b c\n\n:\n")
COLUMNS = 100
BoardTree = Callable[[str], Path]


def all_findings(sections: tuple[Section, ...]) -> list[DoctorFinding]:
    return [finding for section in sections for finding in section.findings]


def examined(root: Path) -> tuple[Section, ...]:
    real_time = {"realtime_priority": 50, "realtime_required": True}
    profile = replace(load_profile("desktop"), power_mode="25W", **real_time)
    return examine(recorded_context(root, profile, load_robot("butler")))


def test_each_topic_stands_together_in_the_table() -> None:
    topics = [topic for topic, _ in groupby(check.topic for check in CHECKS)]
    assert len(topics) == len(set(topics))
    assert len({check.name for check in CHECKS}) == len(CHECKS)


@pytest.mark.parametrize("tree", TREES)
def test_every_trouble_has_a_remedy_and_every_line_fits(board_tree: BoardTree, tree: str) -> None:
    sections = examined(board_tree(tree))
    for finding in all_findings(sections):
        assert finding.measured
        assert finding.remedy or finding.level in (FindingLevel.OK, FindingLevel.MISSING)
    for line in as_text(sections).splitlines():
        assert len(line) <= COLUMNS


def test_an_empty_root_is_examined(tmp_path: Path) -> None:
    findings = all_findings(examined(tmp_path))
    assert len(findings) >= len(CHECKS) - 2
    assert sum(finding.level is FindingLevel.MISSING for finding in findings) > len(CHECKS) / 2


@pytest.mark.parametrize("garbage", GARBAGE)
def test_garbage_in_every_file_is_examined(board_tree: BoardTree, garbage: bytes) -> None:
    root = board_tree("orin_nano_8gb_super")
    extra = ("proc/version", "proc/swaps", "run/utmp", "proc/config.gz", "proc/asound/cards")
    for name in extra:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).touch()
    for path in [path for path in root.rglob("*") if path.is_file()]:
        path.write_bytes(garbage)
    assert all_findings(examined(root))


@pytest.mark.parametrize("seed", range(5))
def test_files_that_are_folders_or_gone_are_examined(board_tree: BoardTree, seed: int) -> None:
    draw, root = random.Random(seed), board_tree("agx_orin_64gb")
    for path in sorted(path for path in root.rglob("*") if path.is_file()):
        trouble = draw.randrange(3)
        if trouble:
            path.unlink()
        if trouble == 2:
            path.mkdir()
    assert all_findings(examined(root))


def test_a_check_that_breaks_does_not_end_the_examination(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(_: object) -> Iterator[DoctorFinding]:
        raise ZeroDivisionError("no such number")
        yield

    checks = (Check("Power", "fan", broken), *CHECKS)
    monkeypatch.setattr(table, "CHECKS", checks)
    first, *others = all_findings(examined(tmp_path))
    assert (first.name, first.level) == ("fan", FindingLevel.WARN)
    assert first.measured == "the check itself broke: ZeroDivisionError: no such number"
    assert len(others) >= len(CHECKS) - 2


def sections_of(*levels: FindingLevel) -> tuple[Section, ...]:
    findings = tuple(
        DoctorFinding(
            name=f"check {number}", level=level, measured="1 W", remedy="true   # a comment"
        )
        for number, level in enumerate(levels)
    )
    return (Section(topic="Power", findings=findings),)


def test_only_a_failure_makes_the_examination_fail() -> None:
    assert succeeded(sections_of(FindingLevel.OK, FindingLevel.WARN, FindingLevel.MISSING))
    assert not succeeded(sections_of(FindingLevel.OK, FindingLevel.FAIL))


def test_the_document_holds_every_finding_and_the_counts() -> None:
    document = as_document(sections_of(FindingLevel.OK, FindingLevel.FAIL, FindingLevel.FAIL))
    assert document["ok"] is False
    assert document["counts"] == {"ok": 1, "warn": 0, "fail": 2, "missing": 0}
    assert document["findings"][1] == {
        "topic": "Power",
        "name": "check 1",
        "level": "fail",
        "measured": "1 W",
        "remedy": "true   # a comment",
    }


def test_a_long_remedy_is_kept_whole_and_its_comment_moves_below() -> None:
    remedy = "x" * 90 + "   # and then"
    (section,) = sections_of(FindingLevel.WARN)
    finding = DoctorFinding(
        name="name", level=FindingLevel.WARN, measured="long " * 40, remedy=remedy
    )
    lines = as_text((Section(topic=section.topic, findings=(finding,)),)).splitlines()
    assert any(line.endswith("x" * 90) for line in lines)
    assert any(line.strip() == "and then" for line in lines)


def test_the_command_examines_a_recorded_tree(
    board_tree: BoardTree, capsys: pytest.CaptureFixture[str]
) -> None:
    root = str(board_tree("orin_nano_8gb_super"))
    assert main(["doctor", "--root", root, "--profile", "desktop"]) == 0
    assert "NVIDIA Jetson Orin Nano" in capsys.readouterr().out
    assert main(["doctor", "--root", root, "--robot", "butler", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["ok"] is False
    assert {row["topic"] for row in document["findings"]} == {check.topic for check in CHECKS}


def test_the_command_examines_this_computer(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["doctor", "--profile", "desktop", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert code == (0 if document["ok"] else 1)
    (wake_up,) = (row for row in document["findings"] if row["name"] == "wake-up")
    assert "at 250 Hz" in wake_up["measured"]


def test_a_chosen_profile_with_faults_is_a_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = tmp_path / "run"
    faulty = tmp_path / "faulty.toml"
    faulty.write_text("control_rate_hz = 1\n")
    choice_of(base).save(str(faulty))
    assert main(["--runtime-base", str(base), "doctor", "--json"]) == 1
    rows = json.loads(capsys.readouterr().out)["findings"]
    (profile,) = (row for row in rows if row["name"] == "profile")
    assert profile["level"] == "fail"
    assert profile["measured"].startswith(f"the chosen profile {faulty} does not load: ")


def test_a_root_that_is_no_folder_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--root", "/no/such/root"]) == 2
    assert "/no/such/root: expected a folder" in capsys.readouterr().err


def test_the_readings_are_printed_for_people_and_as_json(
    board_tree: BoardTree, capsys: pytest.CaptureFixture[str]
) -> None:
    root = str(board_tree("thor_t5000"))
    assert main(["probes", "--root", root]) == 0
    text = capsys.readouterr().out
    assert "60.5 W" in text
    assert "120W" in text
    assert main(["probes", "--root", root, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert rows["power_w"] == {"value": 60.5, "unit": "W", "reason": ""}
    assert rows["gpu_load_ratio"]["value"] is None


def test_a_command_that_fails_or_is_not_there_is_missing() -> None:
    with pytest.raises(ValueMissing, match="no-such-command"):
        ask_command(("no-such-command",))
    with pytest.raises(ValueMissing, match="says: broken"):
        ask_command((sys.executable, "-c", "raise SystemExit('broken')"))
    assert ask_command((sys.executable, "-c", "print(7)")) == "7\n"


def test_egl_is_opened_or_refused_in_words() -> None:
    command = [sys.executable, str(EGL_SCRIPT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) is done.stdout.startswith("EGL 1.")
    assert done.stdout or done.stderr
