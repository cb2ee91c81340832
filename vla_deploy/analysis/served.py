"""Analyse a scene with a model behind a server, and by measuring alone where it is late or wrong.

The prompt has standing instructions from a file, and the scene as data apart from them.
"""

import json
import math
from functools import cache
from pathlib import Path
from typing import Any, Final

from vla_deploy.analysis.claims import SceneClaims, weighed
from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.analysis.question import Analyser
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.calls.picture import small_jpeg
from vla_deploy.model_servers.chat import Chat, ChatMessage
from vla_deploy.model_servers.errors import ModelServerError
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.model_servers.settings import ServerSettings

TEMPLATE: Final = Path(__file__).parent / "prompts" / "scene_analysis.md"
MOST_THINGS: Final = 40
MOST_RELATIONS: Final = 80
_GOAL_CHARACTERS: Final = 300
_DIGITS: Final = 2
# No text in the data can end the data: what could is written as an escape of JSON.
_ESCAPES: Final = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026"}
WITHIN_S: Final = 15.0


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
    described = {one.id: one for one in measured.objects}
    nearest = sorted(world.things, key=lambda thing: math.dist(thing.xy_m, here))[:MOST_THINGS]
    names = {thing.thing_id for thing in nearest}
    relations = [one for one in measured.relations if one.subject in names]
    return {
        "things": [
            {
                "id": thing.thing_id,
                "kind": thing.kind if thing.kind != "object" else "not recognised",
                "colour": thing.colour,
                "side": described[thing.thing_id].side,
                "distance": described[thing.thing_id].distance,
                "size_m": [round(side_m, _DIGITS) for side_m in thing.size_m],
                "can_be_grasped": described[thing.thing_id].graspable,
            }
            for thing in nearest
        ],
        "relations": [[one.subject, one.relation, one.other] for one in relations[:MOST_RELATIONS]],
        "hands": dict(question.holding),
        "goal": question.goal[:_GOAL_CHARACTERS] or None,
    }


class ServedAnalyser:
    """Ask a model for names and doubts; the measuring analyser gives all that it may not.

    A call blocks for `within_s` at most; the time to measure is short compared with that.
    """

    def __init__(
        self, server: ModelServer, measuring: Analyser, within_s: float = WITHIN_S
    ) -> None:
        self._server = server
        self._measuring = measuring
        self._within_s = within_s
        self._asker = StructuredAsker(server, SceneClaims)

    def analyse(self, question: SceneQuestion) -> SceneAnalysis:
        """Return the analysis; `notes` say why where it is the measured one alone."""
        measured = self._measuring.analyse(question)
        jpeg, note = _picture_for(self._server.settings, question)
        chat = chat_about(question, measured, jpeg)
        try:
            claims = self._asker.ask(chat, self._server.deadline(self._within_s))
        except ModelServerError as error:
            note = f"measured only, server {self._server.name} gave nothing: {error}"
            return _with_note(measured, note)
        return _with_note(weighed(measured, claims, f"server {self._server.name}"), note)


def _picture_for(settings: ServerSettings, question: SceneQuestion) -> tuple[bytes | None, str]:
    """Return the image to send, or a note why there is none."""
    if question.image is None:
        return None, "no image to show"
    if not settings.vision:
        return None, "the model takes no images"
    if not (settings.is_local or settings.allow_images_off_robot):
        return None, "the image was not shown: it may not leave the robot"
    return small_jpeg(question.image), ""


def _with_note(analysis: SceneAnalysis, note: str) -> SceneAnalysis:
    notes = (*analysis.notes, note) if note else analysis.notes
    return analysis.model_copy(update={"notes": notes})
