"""What is remembered, found again, bounded, exported and erased."""

import json
import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vla_deploy.inference.errors import RunFailed
from vla_deploy.memory import (
    Episode,
    EpisodeOutcome,
    LastSeen,
    MemoryStore,
    MemoryUnusable,
    PastAction,
    schema,
)
from vla_deploy.memory.episode import sentence_of
from vla_deploy.memory.errors import NoSuchEpisode
from vla_deploy.memory.search import Vectors

DONE = Episode(told_s=1000.0, command="bring me the bottle", outcome=EpisodeOutcome.SUCCEEDED)
KEYS = LastSeen(
    run_id="run-1",
    thing_id="keys_1",
    kind="keys",
    colour="grey",
    place="bedside_table",
    position_m=(0.3, 3.8, 0.5),
    seen_s=1000.0,
)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[MemoryStore]:
    store = MemoryStore(tmp_path / "memory" / "memory.sqlite3", most_episodes=8, most_things=4)
    yield store
    store.close()


def told(*commands: str) -> list[Episode]:
    return [replace(DONE, command=command) for command in commands]


def test_an_episode_comes_back_as_it_was_with_its_number(store: MemoryStore) -> None:
    failed = Episode(
        told_s=5.5,
        command="fetch the cup",
        outcome=EpisodeOutcome.FAILED,
        source="voice",
        goal="the cup is with the person",
        reasoning="it stands on the table",
        plan={"actions": [{"skill": "pick_up"}]},
        rung="rules",
        error="it slipped out",
        duration_s=12.5,
    )
    store.add([failed])
    assert store.newest() == [replace(failed, number=1)]


@pytest.mark.parametrize(
    ("question", "found"),
    [
        ("where is the bottle", "bring me the bottle"),
        ("BOTTLES!", "bring me the bottle"),  # the stem of a word
        ("the botle", "bring me the bottle"),  # by letters
        ('a "quoted" AND (odd) NEAR/3 question: cups*', "pick up the red cup"),
        ("putting things into boxes", "put the ball in the box"),
    ],
)
def test_words_and_letters_find_an_episode(store: MemoryStore, question: str, found: str) -> None:
    store.add(told("go to the kitchen", "bring me the bottle", "pick up the red cup"))
    store.add(told("put the ball in the box"))
    assert store.recall(question)[0].episode.command == found


@pytest.mark.parametrize("question", ["", "the", "?!", "quarterly taxes", "\x00", "' OR 1=1; --"])
def test_what_fits_nothing_calls_nothing_up(store: MemoryStore, question: str) -> None:
    store.add(told("bring me the bottle"))
    assert store.recall(question) == []


def test_an_error_is_found_by_its_words_too(store: MemoryStore) -> None:
    store.add([replace(DONE, outcome=EpisodeOutcome.FAILED, error="a chair stood in the doorway")])
    assert store.recall("what was wrong with the doorway")[0].episode.error.startswith("a chair")


def test_of_equals_the_newest_comes_first(store: MemoryStore) -> None:
    store.add(told("bring me the bottle", "bring me the bottle"))
    assert [one.episode.number for one in store.recall("the bottle")] == [2, 1]


def test_beyond_its_bounds_the_oldest_are_forgotten(store: MemoryStore) -> None:
    store.add(told(*(f"go to place {number}" for number in range(12))))
    store.add([], [replace(KEYS, thing_id=f"keys_{n}", seen_s=float(n)) for n in range(9)])
    assert [one.command for one in store.newest()] == [f"go to place {n}" for n in range(11, 3, -1)]
    assert (
        not store.recall("place 3") or store.recall("place 3")[0].episode.command != "go to place 3"
    )
    assert [one.seen_s for one in store.last_seen()] == [8.0, 7.0, 6.0, 5.0]


def test_a_thing_is_remembered_where_it_was_last(store: MemoryStore) -> None:
    store.add([], [KEYS])
    store.add([], [replace(KEYS, place="kitchen_table", seen_s=2000.0)])
    store.add([], [replace(KEYS, run_id="run-2", place="coffee_table", seen_s=1500.0)])
    places = [one.place for one in store.last_seen("keys")]
    assert places == ["kitchen_table", "coffee_table"]
    assert store.last_seen("keys", "red") == []


def test_it_outlives_the_process_and_only_its_owner_can_read_it(store: MemoryStore) -> None:
    store.add(told("bring me the bottle"), [KEYS])
    store.close()
    with closing(MemoryStore(store.path)) as again:
        assert again.newest()[0].command == "bring me the bottle"
        assert again.last_seen() == [KEYS]
    assert store.path.stat().st_mode & 0o077 == 0


def test_an_outcome_is_corrected_and_back_again(store: MemoryStore) -> None:
    past = PastAction(skill="pick_up", succeeded=True, kind="bottle", hand="left")
    store.add([replace(DONE, actions=(past,))])
    judged = store.update_outcome(1, EpisodeOutcome.FAILED, "it was the wrong zebrawood bottle")
    assert store.newest() == [judged]
    assert sentence_of(judged, DONE.told_s) == (
        'Just now I was told "bring me the bottle" and it was done; a person said later that it '
        "was wrong: it was the wrong zebrawood bottle."
    )
    assert store.recall("zebrawood")[0].episode == judged
    assert store.past_actions() == []
    again = store.update_outcome(1, EpisodeOutcome.SUCCEEDED)
    assert (again.outcome, again.judged_from) == (EpisodeOutcome.SUCCEEDED, None)
    assert store.past_actions() == [past]
    with pytest.raises(NoSuchEpisode):
        store.update_outcome(7, EpisodeOutcome.FAILED)


def test_a_memory_of_an_earlier_release_is_brought_up_to_date(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(f"{schema._STEPS[0]}; PRAGMA user_version = 1;")
        connection.execute(
            "INSERT INTO episode VALUES "
            "(1, 5.0, 'go', 'succeeded', 'cli', '', '', '{}', '', '', 1.0)"
        )
        connection.commit()
    with closing(MemoryStore(path)) as store:
        assert store.newest() == [
            Episode(told_s=5.0, command="go", outcome=EpisodeOutcome.SUCCEEDED, source="cli",
                    duration_s=1.0, number=1)
        ]  # fmt: skip
        assert store.update_outcome(1, EpisodeOutcome.FAILED).judged_from is not None


class ByMeaning:
    """Embed words by the rows of a table of synonyms, as a model does by what it has learnt."""

    name = "by-meaning"
    least_cosine = 0.5
    rows = ("mug cup beaker", "sofa couch settee", "bring fetch carry")

    def __init__(self) -> None:
        self.is_broken = False

    def embed(self, texts: Sequence[str]) -> Vectors:
        if self.is_broken:
            raise RunFailed("the model is away")
        words = [text.lower().split() for text in texts]
        counts = [[sum(one in row for one in said) for row in self.rows] for said in words]
        rows = np.array(counts, dtype=np.float32).reshape(len(texts), len(self.rows))
        lengths = np.linalg.norm(rows, axis=1, keepdims=True)
        return np.divide(rows, lengths, out=np.zeros_like(rows), where=lengths > 0)


def test_an_embedder_finds_by_meaning_also_what_was_remembered_before_it(tmp_path: Path) -> None:
    path, embedder = tmp_path / "memory.sqlite3", ByMeaning()
    with closing(MemoryStore(path)) as before:
        before.add(told("clean the couch", "water the tulips"))
        assert before.recall("the settee") == []
    with closing(MemoryStore(path, embedder=embedder)) as store:
        store.add(told("fetch a beaker"))
        assert [one.episode.command for one in store.recall("the settee")] == ["clean the couch"]
        assert [one.episode.command for one in store.recall("a mug")] == ["fetch a beaker"]
        embedder.is_broken = True
        store.add(told("carry the cup"))
        assert store.recall("the settee") == []
        assert store.recall("the couch")[0].episode.command == "clean the couch"


def test_what_is_erased_stands_nowhere_in_the_file(store: MemoryStore) -> None:
    store.add(told("find the zebrawood casket", "go to the kitchen"), [KEYS])
    store.erase(1)
    assert [one.command for one in store.newest()] == ["go to the kitchen"]
    assert store.recall("zebrawood casket") == []
    assert all(b"zebrawood" not in file.read_bytes() for file in store.path.parent.iterdir())
    store.erase_all()
    assert list(store.export()) == []
    assert all(b"bedside" not in file.read_bytes() for file in store.path.parent.iterdir())


@pytest.mark.parametrize("number", [7, 2**63, -(10**30)])
def test_what_is_not_there_cannot_be_erased(store: MemoryStore, number: int) -> None:
    with pytest.raises(NoSuchEpisode, match=f"nothing number {number} is remembered"):
        store.erase(number)


def test_the_export_holds_everything_as_json(store: MemoryStore) -> None:
    store.add(told("go to the kitchen", "bring me the bottle"), [KEYS])
    lines = [json.loads(json.dumps(one)) for one in store.export()]
    assert [one["kind"] for one in lines] == ["episode", "episode", "thing"]
    assert [one["command"] for one in lines[:2]] == ["go to the kitchen", "bring me the bottle"]
    assert lines[2]["thing_kind"] == "keys"


def test_a_damaged_file_is_kept_aside_and_remembering_begins_anew(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    path.write_bytes(b"this was a database once" * 100)
    with closing(MemoryStore(path)) as store:
        store.add(told("go to the kitchen"))
        assert len(store.newest()) == 1
    assert (tmp_path / "memory.sqlite3.damaged").read_bytes().startswith(b"this was")


def test_a_file_of_a_later_release_is_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    MemoryStore(path).close()
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA user_version = 99")
    with pytest.raises(MemoryUnusable, match="it has version 99, this release knows 2"):
        MemoryStore(path)


def test_a_place_where_no_file_can_be_is_told(tmp_path: Path) -> None:
    (tmp_path / "memory").write_text("a file where a folder should be")
    with pytest.raises(MemoryUnusable, match="cannot be used"):
        MemoryStore(tmp_path / "memory" / "memory.sqlite3")


def test_two_threads_may_write_and_read_at_once(store: MemoryStore) -> None:
    roomy = MemoryStore(store.path)

    def write(name: str) -> None:
        for number in range(20):
            roomy.add(told(f"{name} {number}"))
            roomy.recall(name)

    threads = [threading.Thread(target=write, args=(name,)) for name in ("left", "right")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(roomy.newest(100)) == 40
    roomy.close()
