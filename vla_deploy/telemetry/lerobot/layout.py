"""Name the files and features of a LeRobot dataset, version 3.0."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final

from vla_deploy.telemetry.errors import ExtraMissing

VERSION: Final = "v3.0"
INFO: Final = "meta/info.json"
STATS: Final = "meta/stats.json"
TASKS: Final = "meta/tasks.parquet"
EPISODES: Final = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA: Final = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO: Final = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
FILES_PER_CHUNK: Final = 1000
DATA_FILE_MB: Final = 100
VIDEO_FILE_MB: Final = 200
ACTION: Final = "action"
STATE: Final = "observation.state"
IMAGE_PREFIX: Final = "observation.images."
COUNTERS: Final[Mapping[str, str]] = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""The columns that every dataset has, and their types."""
ROBOT_TYPES: Final[Mapping[str, str]] = {"so101": "so_follower"}
"""LeRobot's names of robots that have another one here."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FilePlace:
    """Say which file of its kind it is."""

    chunk_index: int = 0
    file_index: int = 0

    @property
    def following(self) -> "FilePlace":
        """Return the place of the next file."""
        if self.file_index + 1 < FILES_PER_CHUNK:
            return FilePlace(chunk_index=self.chunk_index, file_index=self.file_index + 1)
        return FilePlace(chunk_index=self.chunk_index + 1)

    def path(self, pattern: str, **names: str) -> str:
        """Return the path below the dataset's folder."""
        return pattern.format(chunk_index=self.chunk_index, file_index=self.file_index, **names)


def numeric_features(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return the features of states, actions and counters, as info.json has them."""
    vector = {"dtype": "float32", "shape": [len(names)], "names": list(names)}
    counters = {
        key: {"dtype": dtype, "shape": [1], "names": None} for key, dtype in COUNTERS.items()
    }
    return {ACTION: vector, STATE: vector, **counters}


def extra(module: str) -> Any:
    """Import a module of the extra.

    Raises:
        ExtraMissing: it is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise ExtraMissing(
            f"LeRobot datasets need {module.partition('.')[0]}, which is not installed: "
            f"pip install 'vla-deploy[lerobot]' ({error})"
        ) from error
