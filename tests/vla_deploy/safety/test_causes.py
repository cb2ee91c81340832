"""The table of causes is the one that is documented, and its texts read well in one line."""

import math
from pathlib import Path

import pytest

from vla_deploy.safety import (
    CLEAR,
    RULES,
    Cause,
    CauseRule,
    Direction,
    Latch,
    Reaction,
    ResetOutcome,
)

DOCUMENT = Path(__file__).parents[3] / "docs" / "safety.md"
REACTIONS = {
    "each joint group stops by its own category": Reaction.GROUP_STOP,
    "joints: controlled stop, power kept; wheels: they brake by themselves and lose power": (
        Reaction.BASE_OFF
    ),
    "hold": Reaction.HOLD,
    "protective stop": Reaction.PROTECTIVE_STOP,
    "base ramps to rest": Reaction.BASE_RAMP,
    "what leads deeper is blocked": Reaction.BASE_BLOCK,
    "what leads nearer is blocked": Reaction.BASE_BLOCK,
    "the base is slowed": Reaction.BASE_SLOW,
}
rules = pytest.mark.parametrize("rule", RULES, ids=[rule.cause.value for rule in RULES])


def documented() -> dict[str, tuple[Reaction, bool, int, int]]:
    """Return reaction, whether it latches, debounce and release of each cause in the document."""
    lines = DOCUMENT.read_text().splitlines()
    start = lines.index("| cause | found when | for | reaction | ends by |") + 2
    rows: dict[str, tuple[Reaction, bool, int, int]] = {}
    for line in lines[start : lines.index("", start)]:
        names, _, debounce, reaction, end = (cell.strip() for cell in line.strip("|").split("|"))
        release = int(end.split()[0]) if end.endswith("clear ticks") else 0
        facts = (REACTIONS[reaction], end == "reset, then arm", int(debounce.split()[0]), release)
        rows |= dict.fromkeys(names.split("`")[1::2], facts)
    return rows


def test_the_table_is_the_documented_one() -> None:
    assert documented() == {
        rule.cause.value: (
            rule.reaction,
            rule.latch is not Latch.NEVER,
            rule.debounce_samples,
            rule.release_samples,
        )
        for rule in RULES
    }


def test_causes_are_told_by_their_names() -> None:
    assert [cause.value for cause in Cause] == [cause.name.lower() for cause in Cause]


def test_directions_are_told_by_their_names() -> None:
    assert [str(direction) for direction in Direction] == [
        direction.name.lower() for direction in Direction
    ]


@rules
def test_an_advice_reads_on_within_the_line(rule: CauseRule) -> None:
    assert rule.advice[0].islower()
    assert not rule.advice.endswith(".")


def test_the_clear_verdict_names_nothing_and_forbids_nothing() -> None:
    assert (CLEAR.reaction, CLEAR.cause) == (Reaction.NONE, Cause.NONE)
    assert (CLEAR.latched, CLEAR.reset) == (False, ResetOutcome.NOT_ASKED)
    assert (CLEAR.subject, CLEAR.advice, CLEAR.text) == ("", "", "")
    assert (CLEAR.age_s, CLEAR.speed_ratio, CLEAR.blocked) == (0.0, 1.0, frozenset())
    assert math.isnan(CLEAR.measured)
    assert math.isnan(CLEAR.limit)
