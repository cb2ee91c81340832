"""Remember over days what was asked, what came of it, and where things were.

Everything lies in one SQLite file on the robot; nothing leaves it.
"""

from vla_deploy.memory.episode import (
    Episode,
    EpisodeOutcome,
    LastSeen,
    PastAction,
    Recollection,
)
from vla_deploy.memory.errors import MemoryUnusable, RecollectionError
from vla_deploy.memory.experience import NO_EXPERIENCE, Experience, experience_of
from vla_deploy.memory.judgement import Judgement, read_judgement
from vla_deploy.memory.search import Embedder
from vla_deploy.memory.store import MemoryStore

__all__ = [
    "NO_EXPERIENCE",
    "Embedder",
    "Episode",
    "EpisodeOutcome",
    "Experience",
    "Judgement",
    "LastSeen",
    "MemoryStore",
    "MemoryUnusable",
    "PastAction",
    "Recollection",
    "RecollectionError",
    "experience_of",
    "read_judgement",
]
