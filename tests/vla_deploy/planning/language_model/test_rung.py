"""A chat model on board is a rung like a server: it is told what is remembered."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vla_deploy.memory import MemoryStore
from vla_deploy.planning.aids import Aid
from vla_deploy.planning.language_model import LanguageModel
from vla_deploy.planning.language_model.rung import ChatRung
from vla_deploy.planning.planner import Planner, checked
from vla_deploy.robots import load_robot


@pytest.fixture
def chat(model: LanguageModel) -> ChatRung:
    return ChatRung("chat", model, load_robot("butler"), checked)


@pytest.fixture
def memory(tmp_path: Path) -> Iterator[MemoryStore]:
    store = MemoryStore(tmp_path / "memory.sqlite3")
    yield store
    store.close()


def test_what_is_remembered_is_of_use_to_a_chat_model(clock, chat: ChatRung) -> None:
    assert Planner(clock, (chat,)).uses == {Aid.MEMORY}


def test_a_chat_model_is_told_what_is_remembered(
    open_desk: Callable, chat: ChatRung, memory: MemoryStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, ...]] = []
    propose = chat.propose

    def listening(request, deadline):
        told.append(request.recollections)
        return propose(request, deadline)

    monkeypatch.setattr(chat, "propose", listening)
    desk = open_desk(chat, memory=memory)
    for number, text in enumerate(("water the yellow tulips", "water the tulips once more")):
        desk.give(command_id=f"c{number}", text=text)
        desk.answers()
        desk.answers()
    assert told[0] == ()
    assert "water the yellow tulips" in told[1][0]
