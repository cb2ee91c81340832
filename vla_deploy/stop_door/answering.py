"""Decide what a request is answered, and press when it says so."""

from http import HTTPStatus
from typing import Final

from vla_deploy.stop_door.answers import looked, not_pressed, pressed, refused
from vla_deploy.stop_door.connection import MAX_HEAD_BYTES, READ_NS, Answer
from vla_deploy.stop_door.control_word import ControlWords
from vla_deploy.stop_door.pressing import Pressing
from vla_deploy.stop_door.request import Malformed, Request, read_head

_CUT_OFF: Final = (
    f"the head of the request was cut off: expected at most {MAX_HEAD_BYTES} bytes within "
    f"{READ_NS / 1e9:g} s"
)


class Answering:
    """Answer the requests of every client."""

    def __init__(self, pressing: Pressing, words: ControlWords) -> None:
        self.refused = 0
        self._pressing = pressing
        self._words = words

    def to(self, peer: str) -> Answer:
        """Return what answers the client at an address."""
        return lambda head, whole: self._answer(head, peer, whole=whole)

    def _answer(self, head: bytes, peer: str, *, whole: bool) -> bytes:
        """Press for whoever came as far as saying so; refuse else what was cut off."""
        try:
            request = read_head(head)
        except Malformed as error:
            return self._refuse(str(error))
        if request.is_press:
            return self._press(request, peer)
        return looked(request, self._words.newest()) if whole else self._refuse(_CUT_OFF)

    def _press(self, request: Request, peer: str) -> bytes:
        why_not = self._pressing.press(request, peer)
        return not_pressed(request, why_not) if why_not else pressed(request, self._words.newest())

    def _refuse(self, why: str) -> bytes:
        self.refused += 1
        return refused(HTTPStatus.BAD_REQUEST, why)
