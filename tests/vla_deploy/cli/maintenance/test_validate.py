"""`vla-deploy validate` refuses what plays nothing, and becomes the campaign."""

import os
import sys

import pytest

from vla_deploy.cli.main import main


class _Became(Exception):
    pass


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *(("--count", value) for value in ("0", "-1")),
        *(("--workers", value) for value in ("0", "x")),
        *(("--hours", value) for value in ("0", "-1", "nan", "inf")),
    ],
)
def test_a_figure_that_plays_nothing_is_refused_in_one_line(
    option: str, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["validate", "soak", option, value])
    (line,) = capsys.readouterr().err.splitlines()
    assert f"argument {option}: expected" in line
    assert ended.value.code == 2


def test_a_signal_meets_the_campaign_because_the_command_becomes_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def become(program: str, command: list[str]) -> None:
        raise _Became(program, command)

    monkeypatch.setattr(os, "execv", become)
    with pytest.raises(_Became) as became:
        main(["validate", "kills", "--count", "3", "--json"])
    command = [sys.executable, "-m", "sim_twin.campaigns", "kills", "--count", "3", "--json"]
    assert became.value.args == (sys.executable, command)
