"""Analyse a scene with a model behind a server, and without it where it is late, wrong or gone."""

from dataclasses import dataclass
from typing import Final

from vla_deploy.analysis.claims import SceneClaims
from vla_deploy.analysis.cross_check import weighed
from vla_deploy.analysis.document import SceneAnalysis
from vla_deploy.analysis.prompt import chat_about
from vla_deploy.analysis.question import Analyser
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.calls.picture import small_jpeg
from vla_deploy.model_servers.errors import ModelServerError
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.model_servers.settings import ServerSettings

WITHIN_S: Final = 15.0


@dataclass(frozen=True, slots=True)
class _Picture:
    """Hold the image to send, or why there is none."""

    jpeg: bytes | None
    note: str = ""


class ServedAnalyser:
    """Ask a model for names and doubts; the measuring analyser gives all that it may not.

    A call blocks for `within_s` at most, beside which measuring takes nothing.
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
        picture = _picture_for(self._server.settings, question)
        chat = chat_about(question, measured, picture.jpeg)
        try:
            claims = self._asker.ask(chat, self._server.deadline(self._within_s))
        except ModelServerError as error:
            told = f"measured only, server {self._server.name} gave nothing: {error}"
            return _with_notes(measured, told)
        analysis = weighed(measured, claims, f"server {self._server.name}")
        return _with_notes(analysis, picture.note)


def _picture_for(settings: ServerSettings, question: SceneQuestion) -> _Picture:
    if question.image is None:
        return _Picture(None, "no image to show")
    if not settings.vision:
        return _Picture(None, "the model takes no images")
    if not (settings.is_local or settings.allow_images_off_robot):
        return _Picture(None, "the image was not shown: it may not leave the robot")
    return _Picture(small_jpeg(question.image))


def _with_notes(analysis: SceneAnalysis, note: str) -> SceneAnalysis:
    notes = (*analysis.notes, *((note,) if note else ()))
    return analysis.model_copy(update={"notes": notes})
