from typing import TYPE_CHECKING, Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.skills.actions.navigate import reach
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.errors import NotPossible
from vla_deploy.skills.movements.gaze import (
    MEMORY_S,
    OUT_OF_REACH_S,
    SURE_CONFIDENCE,
    remembered,
)

if TYPE_CHECKING:
    from conftest import StandingLink

CUP = parse_object("red cup")


def cup(x_m: float, *, age_s: float = 1.0, confidence: float = 0.9) -> dict[str, Any]:
    return {
        "id": f"cup_{x_m:g}",
        "class": "cup",
        "colour": "red",
        "position_m": [x_m, 2.0, 0.5],
        "last_seen_ns": round((1000.0 - age_s) * NS_PER_S),
        "confidence": confidence,
    }


def test_the_nearest_of_those_meant_is_remembered(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.objects = [cup(4.0), cup(2.0), cup(5.0)]
    found = remembered(context, CUP)
    assert found is not None
    assert found["id"] == "cup_2"
    assert remembered(context, parse_object("blue cup")) is None


def test_doubtful_and_old_sights_do_not_count(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.objects = [cup(2.0, confidence=SURE_CONFIDENCE - 0.01), cup(3.0, age_s=MEMORY_S + 1)]
    assert remembered(context, CUP) is None


def test_what_nobody_can_get_at_gives_way_to_another_for_a_while(
    context: SkillContext, standing: "StandingLink"
) -> None:
    off_the_map, on_the_table = cup(0.0), cup(5.0)
    off_the_map["position_m"] = [-3.0, -3.0, 1.18]
    standing.objects = [off_the_map]
    with pytest.raises(NotPossible, match="cannot get within reach of the red cup"):
        list(reach(context, CUP))
    assert remembered(context, CUP) is None
    by_id = remembered(context, parse_object("cup_0"))
    assert by_id is not None, "who means that very one is not told of another"
    standing.objects = [off_the_map, on_the_table]
    other = remembered(context, CUP)
    assert other is not None
    assert other["id"] == "cup_5"
    standing.objects = [off_the_map]
    context.out_of_reach["cup_0"] -= round((OUT_OF_REACH_S + 1.0) * NS_PER_S)
    assert remembered(context, CUP) is not None
