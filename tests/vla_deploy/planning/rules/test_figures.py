"""Numbers of several words are written in figures; other words stay as they are."""

import pytest

from vla_deploy.planning.rules.figures import in_figures


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("go ahead three and a half metres", "go ahead 3.5 metres"),
        ("wait a minute and a half", "wait 1.5 minute"),
        ("turn one hundred and eighty degrees", "turn 180 degrees"),
        ("move three quarters of a metre", "move 0.75 metre"),
    ],
)
def test_only_numbers_are_written_in_figures(text: str, written: str) -> None:
    assert in_figures(text) == written
