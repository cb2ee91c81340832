"""A part of a name chooses cases; one that chooses none is a mistake, told with names."""

import pytest

from sim_twin.campaigns.__main__ import main
from sim_twin.campaigns.selection import NothingChosen, chosen


def test_a_part_of_the_name_chooses() -> None:
    assert chosen(["idle/off", "driving/off"], "idle", str) == ["idle/off"]
    assert chosen(["idle/off", "driving/off"], "", str) == ["idle/off", "driving/off"]
    assert chosen([], "", str) == []


def test_no_such_name_is_told_with_those_there_are() -> None:
    with pytest.raises(NothingChosen, match="of which there are 2: idle/off, driving/off"):
        chosen(["idle/off", "driving/off"], "typo", str)


@pytest.mark.parametrize("campaign", ["faults", "kills", "pressure", "switches", "soak"])
def test_every_campaign_refuses_it_before_anything_starts(
    campaign: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([campaign, "--only", "typo"]) == 2
    assert f"validate {campaign}: --only typo" in capsys.readouterr().err
