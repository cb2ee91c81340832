from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.swing import MARGIN_M, heights_above

if TYPE_CHECKING:
    from conftest import StandingLink

SPOT_M = (0.42, 0.10, 0.50)
LEAST_M = 0.12
BELOW_M = 0.05


def thing(
    standing: "StandingLink", x_m: float, y_m: float, top_m: float, kind: str = "bottle"
) -> dict[str, Any]:
    position = (*standing.pose.outward(x_m, y_m), top_m - 0.09)
    return {"class": kind, "position_m": position, "size_m": [0.06, 0.06, 0.18]}


def test_over_an_empty_table_the_least_height_will_do(context: SkillContext) -> None:
    assert heights_above(context, SPOT_M, BELOW_M, LEAST_M) == [LEAST_M]


def test_what_the_hand_carries_passes_above_a_tall_neighbour(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.objects = [thing(standing, 0.5, -0.1, top_m=0.68)]
    high_m, last_m = heights_above(context, SPOT_M, BELOW_M, LEAST_M)
    assert SPOT_M[2] + high_m - BELOW_M == pytest.approx(0.68 + MARGIN_M)
    assert last_m == LEAST_M


@pytest.mark.parametrize(
    "other",
    [
        pytest.param((0.43, 0.11, 0.68, "bottle"), id="the thing itself"),
        pytest.param((0.27, 0.16, 0.80, "bottle"), id="what the other hand holds"),
        pytest.param((0.95, 0.10, 0.68, "bottle"), id="what is far away"),
        pytest.param((0.60, 0.10, 0.90, "object"), id="a piece of furniture"),
        pytest.param((0.60, 0.10, 0.50, "ball"), id="what is low"),
    ],
)
def test_other_things_do_not_matter(
    context: SkillContext, standing: "StandingLink", other: tuple[float, float, float, str]
) -> None:
    x_m, y_m, top_m, kind = other
    standing.objects = [thing(standing, x_m, y_m, top_m, kind)]
    assert heights_above(context, SPOT_M, BELOW_M, LEAST_M) == [LEAST_M]
