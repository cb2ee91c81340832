"""Keep episodes and places of things in one bounded file; find, export and erase them."""

import json
import logging
import sqlite3
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, Self

from vla_deploy.inference.errors import InferenceError
from vla_deploy.memory.episode import (
    Episode,
    EpisodeOutcome,
    LastSeen,
    PastAction,
    Recollection,
)
from vla_deploy.memory.errors import MemoryUnusable, NoSuchEpisode
from vla_deploy.memory.judgement import Judgement
from vla_deploy.memory.schema import open_file
from vla_deploy.memory.search import Embedder, LetterGroups, Vectors, search
from vla_deploy.runtime.state_dir import state_dir_of

FILE_NAME: Final = "memory.sqlite3"
MOST_EPISODES: Final = 5_000
MOST_THINGS: Final = 1_000
PATIENCE_S: Final = 2.0
_LARGEST: Final = 2**63 - 1
"""SQLite counts no further."""
_EPISODE: Final = (
    "number, told_s, command, outcome, source, goal, reasoning, plan, rung, error, duration_s, "
    "actions, judged_from, why"
)
_THING: Final = "run_id, thing_id, kind, colour, place, x_m, y_m, z_m, seen_s"
# So many commands are looked through for how their actions went.
_RECENT: Final = 50
# Older episodes that get vectors of a new embedder along with each one that is added.
_EMBEDDED_AT_ONCE: Final = 32
_log = logging.getLogger(__name__)


class MemoryStore:
    """Hold the memory of one robot; may be used from several threads and processes.

    Beyond `most_episodes` and `most_things` the oldest are forgotten. With an `embedder` episodes
    are found by meaning, too; one that fails is done without from then on.
    """

    def __init__(
        self,
        path: Path,
        *,
        most_episodes: int = MOST_EPISODES,
        most_things: int = MOST_THINGS,
        patience_s: float = PATIENCE_S,
        embedder: Embedder | None = None,
    ) -> None:
        """Open the memory; each act waits for `patience_s` while another process writes.

        Raises:
            MemoryUnusable: the file cannot be used.
        """
        self.path = path
        self._most_episodes = most_episodes
        self._most_things = most_things
        self._embedders: tuple[Embedder, ...] = (LetterGroups(), *([embedder] if embedder else []))
        self._lock = threading.Lock()
        self._connection = open_file(path, patience_s)

    @classmethod
    def of_base(
        cls, base: Path, most_episodes: int = MOST_EPISODES, embedder: Embedder | None = None
    ) -> Self:
        """Open the memory of the robot that runs in a runtime directory.

        Raises:
            MemoryUnusable: the file cannot be used.
        """
        path = state_dir_of(base) / "memory" / FILE_NAME
        return cls(path, most_episodes=most_episodes, embedder=embedder)

    def close(self) -> None:
        """Release the file."""
        with self._lock:
            self._connection.close()

    def add(
        self,
        episodes: Sequence[Episode],
        things: Sequence[LastSeen] = (),
        judgements: Sequence[tuple[Episode, Judgement]] = (),
    ) -> None:
        """Remember commands that have ended, where things are, what people say of it, in one act.

        Raises:
            MemoryUnusable: the file cannot be written, such as for a full disk; nothing is lost
                of what was remembered before.
        """
        vectors = self._vectors([one.text for one in episodes])
        with self._transaction() as connection:
            for number, episode in enumerate(episodes):
                row = {name: rows[number] for name, rows in vectors.items()}
                self._insert(connection, episode, row)
            connection.executemany(
                f"INSERT OR REPLACE INTO thing ({_THING}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [_thing_row(one) for one in things],
            )
            for episode, judgement in judgements:
                self._judge_same(connection, episode, judgement)
            self._forget_the_oldest(connection)
        self._embed_older()

    def update_outcome(self, number: int, outcome: EpisodeOutcome, why: str = "") -> Episode:
        """Correct what came of a command, as a person judges it; return the episode as it is now.

        Raises:
            NoSuchEpisode: there is none of that number.
            MemoryUnusable: the file cannot be written.
        """
        with self._transaction() as connection:
            return self._judge(connection, self._one(number), Judgement(outcome=outcome, why=why))

    def recall(self, text: str, count: int = 5) -> list[Recollection]:
        """Return the episodes that fit a text best, by words and by vectors.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        vectors = self._vectors([text])
        asked = {one.name: (vectors[one.name][0], one.least_cosine) for one in self._embedders}
        with self._transaction() as connection:
            found = search(connection, text, asked)[:count]
            return [Recollection(episode=self._one(number), score=score) for number, score in found]

    def past_actions(self, count: int = _RECENT) -> list[PastAction]:
        """Return how actions of the last commands went, the newest first.

        Those of a command whose outcome a person has corrected are left out: which of them was
        wrong nobody knows.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        with self._transaction() as connection:
            rows = connection.execute(
                "SELECT actions FROM episode WHERE actions <> '[]' AND judged_from = '' "
                "ORDER BY number DESC LIMIT ?",
                (count,),
            ).fetchall()
        return [one for (text,) in rows for one in reversed(_actions(text))]

    def newest(self, count: int = 20) -> list[Episode]:
        """Return the last episodes, the newest first.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        with self._transaction() as connection:
            rows = connection.execute(
                f"SELECT {_EPISODE} FROM episode ORDER BY number DESC LIMIT ?", (count,)
            )
            return [_episode(row) for row in rows]

    def last_seen(self, kind: str = "", colour: str = "", count: int = 20) -> list[LastSeen]:
        """Return things of a kind and colour, "" for any, the one seen last first.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        with self._transaction() as connection:
            rows = connection.execute(
                f"SELECT {_THING} FROM thing WHERE ? IN ('', kind) AND ? IN ('', colour) "
                "ORDER BY seen_s DESC LIMIT ?",
                (kind, colour, count),
            )
            return [_last_seen(row) for row in rows]

    def export(self) -> Iterator[dict[str, Any]]:
        """Yield everything, a document each: episodes, the oldest first, then things.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        for episode in reversed(self.newest(self._most_episodes + 1)):
            yield {"kind": "episode", **episode.document()}
        for thing in self.last_seen(count=self._most_things + 1):
            yield {**thing.document(), "kind": "thing", "thing_kind": thing.kind}

    def erase_all(self) -> None:
        """Forget everything; the file holds none of it any more.

        Raises:
            MemoryUnusable: the file cannot be written.
        """
        with self._transaction() as connection:
            for table in ("vector", "episode_text", "episode", "thing"):
                connection.execute(f"DELETE FROM {table}")
        self._wipe()

    def erase(self, number: int) -> None:
        """Forget one episode.

        Raises:
            NoSuchEpisode: there is none of that number.
            MemoryUnusable: the file cannot be written.
        """
        with self._transaction() as connection:
            self._one(number)
            self._delete(connection, number)
        self._wipe()

    def _wipe(self) -> None:
        """Write the file anew: what was deleted may still stand in free pages and in the index."""
        with self._lock, _told(self.path):
            self._connection.execute("INSERT INTO episode_text (episode_text) VALUES ('optimize')")
            self._connection.commit()
            self._connection.execute("VACUUM")
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._lock, _told(self.path), self._connection:
            yield self._connection

    def _one(self, number: int) -> Episode:
        row = None
        if abs(number) <= _LARGEST:
            row = self._connection.execute(
                f"SELECT {_EPISODE} FROM episode WHERE number = ?", (number,)
            ).fetchone()
        if row is None:
            raise NoSuchEpisode(
                f"nothing number {number} is remembered; see: vla-deploy memory list"
            )
        return _episode(row)

    def _insert(
        self, connection: sqlite3.Connection, episode: Episode, vectors: Mapping[str, Vectors]
    ) -> None:
        values = _values(episode)
        number = connection.execute(
            f"INSERT INTO episode ({_EPISODE.removeprefix('number, ')}) "
            f"VALUES ({', '.join('?' * len(values))})",
            values,
        ).lastrowid
        assert number is not None, "a row was inserted"
        connection.execute(
            "INSERT INTO episode_text (rowid, text) VALUES (?, ?)", (number, episode.text)
        )
        for name, vector in vectors.items():
            _keep_vector(connection, number, name, vector)

    def _judge_same(
        self, connection: sqlite3.Connection, episode: Episode, judgement: Judgement
    ) -> None:
        """Correct the outcome of an episode that was added without its number being known."""
        row = connection.execute(
            f"SELECT {_EPISODE} FROM episode WHERE told_s = ? AND command = ? "
            "ORDER BY number DESC LIMIT 1",
            (episode.told_s, episode.command),
        ).fetchone()
        if row is not None:  # else it was erased meanwhile
            self._judge(connection, _episode(row), judgement)

    def _judge(
        self, connection: sqlite3.Connection, episode: Episode, judgement: Judgement
    ) -> Episode:
        judged = episode.judged(judgement.outcome, judgement.why)
        from_value = judged.judged_from.value if judged.judged_from is not None else ""
        connection.execute(
            "UPDATE episode SET outcome = ?, judged_from = ?, why = ? WHERE number = ?",
            (judged.outcome.value, from_value, judged.why, judged.number),
        )
        connection.execute(
            "UPDATE episode_text SET text = ? WHERE rowid = ?", (judged.text, judged.number)
        )
        return judged

    # --- vectors --------------------------------------------------------------------------------

    def _vectors(self, texts: Sequence[str]) -> dict[str, Vectors]:
        """Return the vectors of texts by each embedder; one that fails is given up."""
        made: dict[str, Vectors] = {}
        for one in self._embedders:
            try:
                made[one.name] = one.embed(texts)
            except InferenceError as error:
                _log.warning("degraded: the memory is searched by words alone: %s", error)
                self._embedders = tuple(kept for kept in self._embedders if kept is not one)
        return made

    def _embed_older(self) -> None:
        """Make vectors for some episodes that have none of the embedder that is in use."""
        for one in self._embedders[1:]:
            with self._transaction() as connection:
                rows = connection.execute(
                    f"SELECT {_EPISODE} FROM episode WHERE number NOT IN "
                    "(SELECT number FROM vector WHERE embedder = ?) ORDER BY number DESC LIMIT ?",
                    (one.name, _EMBEDDED_AT_ONCE),
                ).fetchall()
            older = [_episode(row) for row in rows]
            made = self._vectors([episode.text for episode in older]).get(one.name)
            if made is None or not older:
                continue
            with self._transaction() as connection:
                for episode, vector in zip(older, made, strict=True):
                    _keep_vector(connection, episode.number, one.name, vector)

    def _forget_the_oldest(self, connection: sqlite3.Connection) -> None:
        old = connection.execute(
            "SELECT number FROM episode ORDER BY number DESC LIMIT -1 OFFSET ?",
            (self._most_episodes,),
        ).fetchall()
        for (number,) in old:
            self._delete(connection, number)
        connection.execute(
            "DELETE FROM thing WHERE rowid IN "
            "(SELECT rowid FROM thing ORDER BY seen_s DESC LIMIT -1 OFFSET ?)",
            (self._most_things,),
        )

    def _delete(self, connection: sqlite3.Connection, number: int) -> None:
        connection.execute("DELETE FROM episode_text WHERE rowid = ?", (number,))
        connection.execute("DELETE FROM episode WHERE number = ?", (number,))


@contextmanager
def _told(path: Path) -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        raise MemoryUnusable(f"{path}: {error}; check the disk's space and rights") from error


def _keep_vector(connection: sqlite3.Connection, number: int, name: str, vector: Vectors) -> None:
    """Keep a vector of an episode, unless that was erased meanwhile."""
    connection.execute(
        "INSERT OR REPLACE INTO vector (number, embedder, value) "
        "SELECT number, ?, ? FROM episode WHERE number = ?",
        (name, vector.tobytes(), number),
    )


def _values(episode: Episode) -> tuple[Any, ...]:
    judged_from = "" if episode.judged_from is None else episode.judged_from.value
    return (
        episode.told_s, episode.command, episode.outcome.value, episode.source, episode.goal,
        episode.reasoning, json.dumps(dict(episode.plan)), episode.rung, episode.error,
        episode.duration_s, json.dumps([asdict(one) for one in episode.actions]), judged_from,
        episode.why,
    )  # fmt: skip


def _episode(row: Sequence[Any]) -> Episode:
    values = dict(zip(_EPISODE.split(", "), row, strict=True))
    judged_from = values["judged_from"]
    return Episode(
        **{
            **values,
            "outcome": EpisodeOutcome(values["outcome"]),
            "plan": json.loads(values["plan"]),
            "actions": _actions(values["actions"]),
            "judged_from": EpisodeOutcome(judged_from) if judged_from else None,
        }
    )


def _actions(text: str) -> tuple[PastAction, ...]:
    return tuple(PastAction(**one) for one in json.loads(text))


def _last_seen(row: Sequence[Any]) -> LastSeen:
    run_id, thing_id, kind, colour, place, x_m, y_m, z_m, seen_s = row
    return LastSeen(
        run_id=run_id, thing_id=thing_id, kind=kind, colour=colour, place=place,
        position_m=(x_m, y_m, z_m), seen_s=seen_s,
    )  # fmt: skip


def _thing_row(one: LastSeen) -> tuple[Any, ...]:
    return (
        one.run_id, one.thing_id, one.kind, one.colour, one.place, *one.position_m, one.seen_s,
    )  # fmt: skip
