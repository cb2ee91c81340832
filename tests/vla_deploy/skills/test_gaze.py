from typing import TYPE_CHECKING, Any

from drivers.clock import NS_PER_S
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.gaze import MEMORY_S, SURE_CONFIDENCE, remembered

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
