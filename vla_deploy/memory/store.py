"""Keep episodes and places of things in one bounded file; find, export and erase them."""

import json
import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Self

from vla_deploy.memory.episode import Episode, EpisodeOutcome, LastSeen, Recollection
from vla_deploy.memory.errors import MemoryUnusable, NoSuchEpisode
from vla_deploy.memory.schema import open_file
from vla_deploy.memory.search import EMBEDDING, Vectors, embed, search
from vla_deploy.runtime.state_dir import state_dir_of

FILE_NAME: Final = "memory.sqlite3"
MOST_EPISODES: Final = 5_000
MOST_THINGS: Final = 1_000
PATIENCE_S: Final = 2.0
_EPISODE: Final = (
    "number, told_s, command, outcome, source, goal, reasoning, plan, rung, error, duration_s"
)
_THING: Final = "run_id, thing_id, kind, colour, place, x_m, y_m, z_m, seen_s"


class MemoryStore:
    """Hold the memory of one robot; may be used from several threads and processes.

    Beyond `most_episodes` and `most_things` the oldest are forgotten.
    """

    def __init__(
        self,
        path: Path,
        *,
        most_episodes: int = MOST_EPISODES,
        most_things: int = MOST_THINGS,
        patience_s: float = PATIENCE_S,
    ) -> None:
        """Open the memory; each act waits for `patience_s` while another process writes.

        Raises:
            MemoryUnusable: the file cannot be used.
        """
        self.path = path
        self._most_episodes = most_episodes
        self._most_things = most_things
        self._lock = threading.Lock()
        self._connection = open_file(path, patience_s)

    @classmethod
    def of_base(cls, base: Path, most_episodes: int = MOST_EPISODES) -> Self:
        """Open the memory of the robot that runs in a runtime directory.

        Raises:
            MemoryUnusable: the file cannot be used.
        """
        return cls(state_dir_of(base) / "memory" / FILE_NAME, most_episodes=most_episodes)

    def close(self) -> None:
        """Release the file."""
        with self._lock:
            self._connection.close()

    def add(self, episodes: Sequence[Episode], things: Sequence[LastSeen] = ()) -> None:
        """Remember commands that have ended, and where things are now, in one act.

        Raises:
            MemoryUnusable: the file cannot be written, such as for a full disk; nothing is lost
                of what was remembered before.
        """
        vectors = embed([one.text for one in episodes])
        with self._transaction() as connection:
            for episode, vector in zip(episodes, vectors, strict=True):
                self._insert(connection, episode, vector)
            connection.executemany(
                f"INSERT OR REPLACE INTO thing ({_THING}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [_thing_row(one) for one in things],
            )
            self._forget_the_oldest(connection)

    def recall(self, text: str, count: int = 5) -> list[Recollection]:
        """Return the episodes that fit a text best, by words and by vectors.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        with self._transaction() as connection:
            found = search(connection, text)[:count]
            return [Recollection(episode=self._one(number), score=score) for number, score in found]

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
        row = self._connection.execute(
            f"SELECT {_EPISODE} FROM episode WHERE number = ?", (number,)
        ).fetchone()
        if row is None:
            raise NoSuchEpisode(
                f"nothing number {number} is remembered; see: vla-deploy memory list"
            )
        return _episode(row)

    def _insert(self, connection: sqlite3.Connection, episode: Episode, vector: Vectors) -> None:
        values = (
            episode.told_s, episode.command, episode.outcome.value, episode.source, episode.goal,
            episode.reasoning, json.dumps(dict(episode.plan)), episode.rung, episode.error,
            episode.duration_s,
        )  # fmt: skip
        number = connection.execute(
            f"INSERT INTO episode ({_EPISODE.removeprefix('number, ')}) "
            f"VALUES ({', '.join('?' * len(values))})",
            values,
        ).lastrowid
        connection.execute(
            "INSERT INTO episode_text (rowid, text) VALUES (?, ?)", (number, episode.text)
        )
        connection.execute(
            "INSERT INTO vector (number, embedder, value) VALUES (?, ?, ?)",
            (number, EMBEDDING, vector.tobytes()),
        )

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


def _episode(row: Sequence[Any]) -> Episode:
    values = dict(zip(_EPISODE.split(", "), row, strict=True))
    return Episode(
        **{
            **values,
            "outcome": EpisodeOutcome(values["outcome"]),
            "plan": json.loads(values["plan"]),
        }
    )


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
