"""Open the memory's file: its tables, its version, what becomes of a damaged one."""

import logging
import os
import sqlite3
from pathlib import Path
from typing import Final

from vla_deploy.memory.errors import MemoryUnusable

VERSION: Final = 2
_log = logging.getLogger(__name__)

# What each version adds to the one before.
_STEPS: Final = (
    """
CREATE TABLE episode (
    number INTEGER PRIMARY KEY AUTOINCREMENT, told_s REAL NOT NULL, command TEXT NOT NULL,
    outcome TEXT NOT NULL, source TEXT NOT NULL, goal TEXT NOT NULL, reasoning TEXT NOT NULL,
    plan TEXT NOT NULL, rung TEXT NOT NULL, error TEXT NOT NULL, duration_s REAL NOT NULL);
CREATE VIRTUAL TABLE episode_text USING fts5(text, tokenize = 'porter unicode61');
CREATE TABLE vector (
    number INTEGER NOT NULL REFERENCES episode ON DELETE CASCADE, embedder TEXT NOT NULL,
    value BLOB NOT NULL, PRIMARY KEY (number, embedder));
CREATE TABLE thing (
    run_id TEXT NOT NULL, thing_id TEXT NOT NULL, kind TEXT NOT NULL, colour TEXT NOT NULL,
    place TEXT NOT NULL, x_m REAL NOT NULL, y_m REAL NOT NULL, z_m REAL NOT NULL,
    seen_s REAL NOT NULL, PRIMARY KEY (run_id, thing_id));
CREATE INDEX thing_by_kind ON thing (kind, seen_s);
""",
    """
ALTER TABLE episode ADD COLUMN actions TEXT NOT NULL DEFAULT '[]';
ALTER TABLE episode ADD COLUMN judged_from TEXT NOT NULL DEFAULT '';
ALTER TABLE episode ADD COLUMN why TEXT NOT NULL DEFAULT '';
CREATE INDEX episode_with_actions ON episode (number) WHERE actions <> '[]' AND judged_from = '';
""",
)


def open_file(path: Path, patience_s: float) -> sqlite3.Connection:
    """Return a connection to the memory, which is made where there is none.

    It waits so long for another process that writes. A damaged file is moved aside, and an empty
    memory begins: forgetting must not stop the robot.

    Raises:
        MemoryUnusable: the file cannot be made or opened, or a later release has written it.
    """
    try:
        return _opened(path, patience_s)
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError):
            raise _unusable(path, str(error)) from error
        aside = path.with_name(f"{path.name}.damaged")
        _log.warning("%s is damaged (%s): moved to %s, remembering anew", path, error, aside.name)
        path.replace(aside)
        for rest in ("-wal", "-shm"):
            path.with_name(path.name + rest).unlink(missing_ok=True)
        return _opened(path, patience_s)
    except OSError as error:
        raise _unusable(path, error.strerror or str(error)) from error


def _opened(path: Path, patience_s: float) -> sqlite3.Connection:
    path.parent.mkdir(parents=True, exist_ok=True)
    # What people say to their robot is nobody else's business.
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    connection = sqlite3.connect(path, timeout=patience_s, check_same_thread=False)
    try:
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = NORMAL")
        connection.execute("PRAGMA foreign_keys = ON")
        connection.execute("PRAGMA secure_delete = ON")  # what is erased is gone
        _bring_up_to_date(connection, path)
    except BaseException:
        connection.close()
        raise
    return connection


def _bring_up_to_date(connection: sqlite3.Connection, path: Path) -> None:
    (found,) = connection.execute("PRAGMA user_version").fetchone()
    if found > VERSION:
        raise _unusable(path, f"it has version {found}, this release knows {VERSION}")
    if found == VERSION:
        return
    with connection:
        connection.execute("BEGIN IMMEDIATE")  # another process may be at it, too
        (found,) = connection.execute("PRAGMA user_version").fetchone()
        for statement in "".join(_STEPS[found:]).split(";"):
            connection.execute(statement)
        connection.execute(f"PRAGMA user_version = {VERSION}")


def _unusable(path: Path, reason: str) -> MemoryUnusable:
    return MemoryUnusable(
        f"{path}: the robot's memory cannot be used: {reason}; check the disk and who owns the "
        "file, or move it away to begin anew"
    )
