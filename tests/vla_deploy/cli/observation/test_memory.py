"""What `vla-deploy memory` shows, writes and forgets."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.memory import Episode, EpisodeOutcome, LastSeen, MemoryStore
from vla_deploy.memory.episode import unix_s

Run = Callable[..., tuple[int, str]]


@pytest.fixture
def memory(base: Path, vla: Callable[..., Any]) -> Run:
    store = MemoryStore.of_base(base)
    told_s = unix_s() - 7200.0
    keys = LastSeen(
        run_id="r",
        thing_id="keys_1",
        kind="keys",
        colour="grey",
        place="bedside_table",
        position_m=(0.3, 3.8, 0.5),
        seen_s=told_s,
    )
    commands = ("go to the kitchen", "bring me the bottle")
    episodes = [
        Episode(told_s=told_s, command=one, outcome=EpisodeOutcome.SUCCEEDED) for one in commands
    ]
    store.add(episodes, [keys])
    store.close()

    def run(*arguments: str) -> tuple[int, str]:
        said = vla("memory", *arguments)
        return said.code, said.out + said.err

    return run


@pytest.mark.parametrize(
    ("arguments", "shown"),
    [
        (("list",), '    2  2 hours ago I was told "bring me the bottle" and it was done.'),
        (("search", "the bottle"), '    2  2 hours ago I was told "bring me the bottle"'),
        (("search", "quarterly taxes"), "nothing like that is remembered"),
        (("things", "--kind", "keys"), "I saw the grey keys at the bedside table, 2 hours ago."),
        (("things", "--kind", "phone"), "no such thing is remembered"),
    ],
)
def test_it_tells_a_person(memory: Run, arguments: tuple[str, ...], shown: str) -> None:
    code, out = memory(*arguments)
    assert (code, out.startswith(shown)) == (0, True)


def test_it_tells_a_script(memory: Run) -> None:
    assert [one["number"] for one in json.loads(memory("list", "--json")[1])] == [2, 1]
    (found,) = json.loads(memory("search", "bottle", "--json")[1])
    assert (found["command"], found["score"] > 0.0) == ("bring me the bottle", True)
    (thing,) = json.loads(memory("things", "--json")[1])
    assert thing["place"] == "bedside_table"


def test_what_came_of_a_command_is_corrected(memory: Run) -> None:
    code, out = memory("outcome", "2", "failed", "--why", "it was the can")
    assert (code, "a person said later that it was wrong: it was the can" in out) == (0, True)
    assert "was wrong" in memory("search", "the can")[1]
    assert "nothing number 9 is remembered" in memory("outcome", "9", "failed")[1]


def test_everything_is_written_to_a_new_file_alone(memory: Run, tmp_path: Path) -> None:
    file = tmp_path / "memory.jsonl"
    assert memory("export", str(file))[0] == 0
    assert len(file.read_text().splitlines()) == 3
    assert file.stat().st_mode & 0o077 == 0
    code, out = memory("export", str(file))
    assert (code, "File exists" in out) == (2, True)


def test_nothing_is_forgotten_unless_it_is_said(memory: Run) -> None:
    assert memory("erase", "--all")[0] == 2
    assert memory("erase")[0] == 2
    assert len(json.loads(memory("list", "--json")[1])) == 2
    assert memory("erase", "1", "--yes")[0] == 0
    assert memory("erase", "1", "--yes")[0] == 2
    assert [one["number"] for one in json.loads(memory("list", "--json")[1])] == [2]
    assert memory("erase", "--all", "--yes")[0] == 0
    assert json.loads(memory("things", "--json")[1]) == []
