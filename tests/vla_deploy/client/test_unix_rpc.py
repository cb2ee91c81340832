"""Ask over a real socket, and meet the ends that such a conversation may have."""

import json
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from vla_deploy.client.unix_rpc import request


class Listener:
    """Take one question and send prepared pieces back."""

    def __init__(self, path: Path, *pieces: bytes) -> None:
        self.path = path
        self.heard = b""
        self._pieces = pieces
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.bind(str(path))
        self._socket.listen()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        client, _ = self._socket.accept()
        with client:
            self.heard = client.recv(4096)
            for piece in self._pieces:
                client.sendall(piece)

    def close(self) -> None:
        self._thread.join()
        self._socket.close()


@pytest.fixture
def whole(tmp_path: Path) -> Iterator[Listener]:
    listener = Listener(tmp_path / "s", b'{"ok": true, ', b'"n": 3}\n')
    yield listener
    listener.close()


@pytest.fixture
def torn(tmp_path: Path) -> Iterator[Listener]:
    listener = Listener(tmp_path / "s", b'{"ok": tr')
    yield listener
    listener.close()


def test_an_answer_in_pieces_is_one_answer(whole: Listener) -> None:
    assert request(whole.path, {"op": "count", "of": "ä"}) == {"ok": True, "n": 3}
    assert json.loads(whole.heard) == {"op": "count", "of": "ä"}


def test_an_answer_that_ends_too_early_is_none(torn: Listener) -> None:
    with pytest.raises(ConnectionError, match="hung up"):
        request(torn.path, {"op": "count"})


def test_where_nobody_listens_there_is_no_answer(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        request(tmp_path / "s", {})
