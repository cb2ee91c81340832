"""Options that cannot be met are refused before anything is played, and no report is lost."""

import argparse
from collections.abc import Callable
from pathlib import Path

import pytest

from sim_twin.campaigns import __main__ as campaigns
from sim_twin.campaigns.killing import kills
from sim_twin.campaigns.report import CampaignCase, CampaignReport
from sim_twin.campaigns.selection import NothingChosen, chosen

REPORT = CampaignReport(
    campaign="faults", cases=(CampaignCase(name="servo_bus/off/idle", failures=("fell",)),)
)


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    names: list[str] = []

    def play(options: argparse.Namespace, _tell: Callable[[str], None]) -> CampaignReport:
        names.append(options.campaign)
        return REPORT

    monkeypatch.setattr(campaigns, "CAMPAIGNS", dict.fromkeys(campaigns.CAMPAIGNS, play))
    return names


@pytest.mark.parametrize(
    ("campaign", "option", "value"),
    [
        *(("kills", "--count", value) for value in ("0", "-1", "many")),
        *(("faults", "--workers", value) for value in ("0", "-1", "2.5")),
        *(("soak", "--hours", value) for value in ("0", "-1", "nan", "inf", "long")),
    ],
)
def test_a_figure_that_plays_nothing_is_refused_in_one_line(
    campaign: str,
    option: str,
    value: str,
    played: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as ended:
        campaigns.main([campaign, option, value])
    (line,) = capsys.readouterr().err.splitlines()
    assert f"argument {option}: expected" in line
    assert (ended.value.code, played) == (2, [])


def test_a_campaign_plays_as_many_cases_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kills, "inject_all", lambda drawn, *_others: drawn)
    for count, expected in ((None, kills.INJECTIONS), (3, 3), (0, 0)):
        options = argparse.Namespace(count=count, seed=0, only="", workers=2, robot="butler")
        assert len(kills.run(options, print)) == expected  # type: ignore[arg-type]


def test_the_folder_of_the_junit_file_is_made(tmp_path: Path, played: list[str]) -> None:
    junit = tmp_path / "new" / "er" / "x.xml"
    assert campaigns.main(["faults", "--junit", str(junit)]) == 1
    assert junit.is_file()
    assert played == ["faults"]


@pytest.mark.parametrize(("name", "why"), [("", "it is a folder"), ("file/x.xml", "exists")])
def test_a_junit_file_that_cannot_be_is_refused_before_anything_is_played(
    name: str, why: str, tmp_path: Path, played: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert campaigns.main(["faults", "--junit", str(tmp_path / name)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("validate faults: --junit ")
    assert why in line
    assert played == []


@pytest.mark.usefixtures("played")
def test_the_report_is_printed_before_its_file_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(_report: CampaignReport, _path: Path) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(CampaignReport, "write_junit", full)
    with pytest.raises(OSError, match="no space left"):
        campaigns.main(["faults", "--junit", str(tmp_path / "x.xml")])
    assert "1 cases, 1 failed" in capsys.readouterr().out


def test_a_part_of_a_name_chooses_cases_and_one_that_chooses_none_is_refused() -> None:
    assert chosen(["idle/off", "driving/off"], "idle", str) == ["idle/off"]
    assert chosen(["idle/off", "driving/off"], "", str) == ["idle/off", "driving/off"]
    assert chosen([], "", str) == []
    with pytest.raises(NothingChosen, match="of which there are 2: idle/off, driving/off"):
        chosen(["idle/off", "driving/off"], "typo", str)


@pytest.mark.parametrize("campaign", ["faults", "kills", "pressure", "switches", "soak"])
def test_every_campaign_refuses_such_a_name_before_anything_starts(
    campaign: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert campaigns.main([campaign, "--only", "typo"]) == 2
    assert f"validate {campaign}: --only typo" in capsys.readouterr().err
