from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.skills.actions.place import BELOW_RIM_M, DEEP_BELOW_RIM_M, below_rim_m
from vla_deploy.skills.context import Held, SkillContext

if TYPE_CHECKING:
    from conftest import StandingLink

BOX = {"id": "box_1", "class": "box", "position_m": [1.5, 2.0, 0.46], "size_m": [0.23, 0.23, 0.125]}
FLOOR_M = 0.46 - 0.125 / 2
RED_CUP = Held(kind="cup", colour="red", width_m=0.08, below_grip_m=0.05)


def content(kind: str, colour: str, height_m: float, of: str = "box_1") -> dict[str, Any]:
    rests = {"rests": {"relation": "in", "of": of}} if of else {}
    return {
        "id": f"{kind}_1",
        "class": kind,
        "colour": colour,
        "position_m": [1.5, 2.0, FLOOR_M + height_m / 2],
        "size_m": [0.06, 0.06, height_m],
        **rests,
    }


@pytest.mark.parametrize(
    ("contents", "depth_m"),
    [
        pytest.param([], DEEP_BELOW_RIM_M, id="empty"),
        pytest.param([content("bottle", "green", 0.1)], BELOW_RIM_M, id="tall"),
        pytest.param([content("phone", "black", 0.01)], DEEP_BELOW_RIM_M, id="flat"),
        pytest.param([content("ball", "blue", 0.06)], 0.05, id="as deep as there is room"),
        pytest.param([content("cup", "red", 0.1)], DEEP_BELOW_RIM_M, id="what is held itself"),
        pytest.param([content("can", "red", 0.1, of="table")], DEEP_BELOW_RIM_M, id="beside it"),
        pytest.param([content("can", "red", 0.1, of="")], DEEP_BELOW_RIM_M, id="loose"),
    ],
)
def test_a_thing_is_let_go_as_deep_as_what_lies_in_the_container_allows(
    context: SkillContext,
    standing: "StandingLink",
    contents: list[dict[str, Any]],
    depth_m: float,
) -> None:
    standing.objects = contents
    assert below_rim_m(context, BOX, RED_CUP) == pytest.approx(depth_m)


def test_a_low_container_is_no_reason_to_touch_its_floor(context: SkillContext) -> None:
    tray = {**BOX, "size_m": [0.23, 0.23, 0.08]}
    assert below_rim_m(context, tray, RED_CUP) == pytest.approx(0.04)
