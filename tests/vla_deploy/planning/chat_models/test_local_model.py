"""A chat model on board is a back end like a server: its prompt holds what is remembered."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vla_deploy.inference.language_model import LanguageModel
from vla_deploy.memory import Episode, EpisodeOutcome, MemoryStore
from vla_deploy.memory.episode import unix_s
from vla_deploy.planning.chat_models.chat_model import LocalModel
from vla_deploy.planning.chat_models.plan_answer import answer_for
from vla_deploy.planning.interfaces import Aid
from vla_deploy.planning.planner import Planner, checked
from vla_deploy.robots import load_robot


@pytest.fixture
def chat(model: LanguageModel) -> LocalModel:
    return LocalModel(
        "chat", model, "butler", answer_for(sorted(load_robot("butler").places)), checked
    )


@pytest.fixture
def memory(tmp_path: Path) -> Iterator[MemoryStore]:
    store = MemoryStore(tmp_path / "memory.sqlite3")
    yield store
    store.close()


def test_what_is_remembered_is_of_use_to_a_chat_model(clock, chat: LocalModel) -> None:
    assert Planner(clock, (chat,)).uses == {Aid.MEMORY}


def test_a_chat_model_is_told_what_is_remembered(
    open_desk: Callable, chat: LocalModel, memory: MemoryStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, ...]] = []
    propose = chat.propose

    def listening(request, deadline):
        told.append(request.experience.sentences())
        return propose(request, deadline)

    monkeypatch.setattr(chat, "propose", listening)
    before = Episode(
        told_s=unix_s() - 60.0, command="water the yellow tulips", outcome=EpisodeOutcome.FAILED
    )
    memory.add([before], [])
    desk = open_desk(chat, memory=memory)
    desk.answers_to("water the tulips once more")
    ((recollection,),) = told
    assert "water the yellow tulips" in recollection


def test_a_chat_model_that_has_no_answer_is_followed_by_the_parser(
    clock, chat: LocalModel, ask: Callable, back_end: Callable, propose: Callable
) -> None:
    go = ("navigate_to", {"place": "kitchen"})
    planner = Planner(clock, (back_end("parser", propose(go, back_end="parser")), chat))
    assert planner.slow_back_ends == ("chat", "parser")
    answer = planner.plan(ask("make it nice in here"))
    assert [(one.back_end, one.outcome) for one in answer.attempts[1:]] == [
        ("chat", "declined"),
        ("parser", "planned"),
    ]
    checked_by_none = planner.plan(ask("pick up both cups"))
    assert [one.back_end for one in checked_by_none.attempts] == ["patterns", "chat"]
    assert checked_by_none.proposal.back_end == "patterns"
    assert not checked_by_none.proposal.is_read_back
