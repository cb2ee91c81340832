"""Put a question to a model: standing instructions from a file, and the scene as data apart."""

import json
import math
from functools import cache
from pathlib import Path
from typing import Any, Final

from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.model_servers.chat import Chat, ChatMessage

TEMPLATE: Final = Path(__file__).parent / "prompts" / "scene_analysis.md"
MOST_THINGS: Final = 40
MOST_RELATIONS: Final = 80
_GOAL_CHARACTERS: Final = 300
_DIGITS: Final = 2
# No text in the data can end the data: what could is written as an escape of JSON.
_ESCAPES: Final = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026"}


def chat_about(question: SceneQuestion, measured: SceneAnalysis, jpeg: bytes | None) -> Chat:
    """Return the chat; the nearest things and their relations, as many as a prompt should hold."""
    data = json.dumps(_scene(question, measured), separators=(",", ":")).translate(_ESCAPES)
    message = ChatMessage(text=f"<scene>\n{data}\n</scene>", images=() if jpeg is None else (jpeg,))
    return Chat(system=_template(), messages=(message,), schema_name="scene")


@cache
def _template() -> str:
    return TEMPLATE.read_text(encoding="utf-8")


def _scene(question: SceneQuestion, measured: SceneAnalysis) -> dict[str, Any]:
    world = question.world
    robot = world.robot
    here = (0.0, 0.0) if robot is None else (robot.x_m, robot.y_m)
    told = {one.id: one for one in measured.objects}
    nearest = sorted(world.things, key=lambda thing: math.dist(thing.xy_m, here))[:MOST_THINGS]
    names = {thing.thing_id for thing in nearest}
    relations = [one for one in measured.relations if one.subject in names]
    return {
        "things": [
            {
                "id": thing.thing_id,
                "kind": thing.kind if thing.kind != "object" else "not recognised",
                "colour": thing.colour,
                "side": told[thing.thing_id].side,
                "distance": told[thing.thing_id].distance,
                "size_m": [round(side_m, _DIGITS) for side_m in thing.size_m],
                "can_be_grasped": told[thing.thing_id].graspable,
            }
            for thing in nearest
        ],
        "relations": [[one.subject, one.relation, one.other] for one in relations[:MOST_RELATIONS]],
        "hands": dict(question.holding),
        "goal": question.goal[:_GOAL_CHARACTERS] or None,
    }
