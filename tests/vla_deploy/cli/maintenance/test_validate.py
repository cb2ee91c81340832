"""`vla-deploy validate` becomes the campaign."""

import os
import sys

import pytest

from vla_deploy.cli.main import main


class _Became(Exception):
    pass


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
