"""Try a declared server: is it there, has it the model, does the model see."""

import dataclasses
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from drivers.clock import NS_PER_S
from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.calls.picture import small_jpeg
from vla_deploy.model_servers.chat import Chat, ChatMessage
from vla_deploy.model_servers.errors import AnswerUnusable, ModelServerError
from vla_deploy.model_servers.server import ModelServer

_CARD_PX: Final = 128
_RED_RGB: Final = (220, 20, 20)


class Colour(BaseModel):
    """Hold what a model sees on the test card."""

    model_config = ConfigDict(extra="forbid")

    colour: Literal["red", "green", "blue", "none"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerCheck:
    """Hold what was found; None where it was not tried, or the server does not say.

    `sees` is proven by a test card that has nothing to do with where the robot is.
    """

    server: str
    is_reachable: bool
    latency_s: float | None = None
    has_model: bool | None = None
    says_vision: bool | None = None
    answers: bool | None = None
    sees: bool | None = None
    answer_s: float | None = None
    asked_by: str | None = None
    detail: str = ""

    @property
    def is_ok(self) -> bool:
        """Return whether nothing that was tried failed."""
        tried = (self.has_model, self.answers, self.sees)
        return self.is_reachable and all(one is not False for one in tried)

    def document(self) -> dict[str, Any]:
        """Return the values as JSON takes them."""
        return {**dataclasses.asdict(self), "is_ok": self.is_ok}


def check_server(server: ModelServer, ask: bool) -> ServerCheck:
    """Check a server; with `ask`, ask its model a question too, about a picture if it sees."""
    began_ns = server.clock.now_ns()
    try:
        facts = server.models()
    except AnswerUnusable as error:
        return ServerCheck(
            server=server.name, is_reachable=True, has_model=False, detail=str(error)
        )
    except ModelServerError as error:
        return ServerCheck(server=server.name, is_reachable=False, detail=str(error))
    found = ServerCheck(
        server=server.name,
        is_reachable=True,
        latency_s=_since_s(server, began_ns),
        has_model=facts.is_present,
        says_vision=facts.has_vision,
        detail="" if facts.is_present else f"it has: {', '.join(facts.known) or 'nothing'}",
    )
    return _asked(server, found) if ask and facts.is_present else found


def _asked(server: ModelServer, found: ServerCheck) -> ServerCheck:
    asker = StructuredAsker(server, Colour)
    images = (_red_card(),) if server.settings.vision else ()
    text = "Which colour has the picture?" if images else "Which colour has a ripe tomato?"
    began_ns = server.clock.now_ns()
    try:
        colour = asker.ask(Chat(messages=(ChatMessage(text=text, images=images),))).colour
    except ModelServerError as error:
        return dataclasses.replace(found, answers=False, detail=str(error))
    return dataclasses.replace(
        found,
        answers=True,
        sees=colour == "red" if images else None,
        answer_s=_since_s(server, began_ns),
        asked_by=asker.schema_mode,
        detail="" if colour == "red" else f'it says "{colour}" where red is right',
    )


def _since_s(server: ModelServer, began_ns: int) -> float:
    return round((server.clock.now_ns() - began_ns) / NS_PER_S, 4)


def _red_card() -> bytes:
    return small_jpeg(np.full((_CARD_PX, _CARD_PX, 3), _RED_RGB, np.uint8))
