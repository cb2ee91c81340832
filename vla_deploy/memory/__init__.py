"""Remember over days what was asked, what came of it, and where things were.

Everything lies in one SQLite file on the robot; nothing leaves it.
"""

from vla_deploy.memory.episode import Episode, EpisodeOutcome, LastSeen, Recollection
from vla_deploy.memory.errors import MemoryUnusable, RecollectionError
from vla_deploy.memory.store import MemoryStore

__all__ = [
    "Episode",
    "EpisodeOutcome",
    "LastSeen",
    "MemoryStore",
    "MemoryUnusable",
    "Recollection",
    "RecollectionError",
]
