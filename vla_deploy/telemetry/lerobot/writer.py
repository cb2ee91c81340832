"""Write a LeRobot dataset, one frame at a time; it appears when it is whole.

Numbers of one episode are held in memory, images are not. Video goes on from episode to episode
in one file until that is large enough.
"""

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from vla_deploy.telemetry.errors import DatasetRefused
from vla_deploy.telemetry.lerobot import layout, statistics
from vla_deploy.telemetry.lerobot.layout import FilePlace, extra
from vla_deploy.telemetry.lerobot.statistics import FeatureStatistics
from vla_deploy.telemetry.lerobot.video import MB, CameraVideo, Image

Floats = NDArray[np.float64]
MAX_FPS: Final = 120


class DatasetWriter:
    """Write episodes for a `with` block; an exception in it leaves nothing behind."""

    def __init__(
        self,
        root: Path,
        *,
        names: Sequence[str],
        cameras: Sequence[str],
        fps: int,
        robot_type: str,
        video_file_mb: float = layout.VIDEO_FILE_MB,
    ) -> None:
        """Begin a dataset beside the folder in which it will be.

        Raises:
            DatasetRefused: the folder is there already, or the rate is out of range.
            ExtraMissing: the extra is not installed.
        """
        if not 1 <= fps <= MAX_FPS:
            raise DatasetRefused(f"fps: expected 1 to {MAX_FPS}, got {fps}")
        if root.exists():
            raise DatasetRefused(f"{root} exists; name a folder that does not, with -o")
        self._arrow, self._parquet = extra("pyarrow"), extra("pyarrow.parquet")
        self._root = root
        self._part = root.with_name(f".{root.name}.part")
        self._features = layout.numeric_features(names)
        self._videos = {
            camera: CameraVideo(self._part, layout.IMAGE_PREFIX + camera, fps, video_file_mb)
            for camera in cameras
        }
        self._fps = fps
        self._robot_type = robot_type
        self._data = FilePlace()
        self._data_writer: Any = None
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._statistics: dict[str, list[FeatureStatistics]] = {}
        self._frames = 0
        self._states: list[Floats] = []
        self._actions: list[Floats] = []

    def __enter__(self) -> Self:
        """Make the folder of the unfinished dataset; what an aborted one left goes."""
        shutil.rmtree(self._part, ignore_errors=True)
        try:
            self._part.mkdir(parents=True)
        except OSError as error:
            raise DatasetRefused(f"{self._part}: {error.strerror}; name another folder") from error
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the dataset, or remove it.

        Raises:
            DatasetRefused: it has no episode, or the disk refuses it.
        """
        try:
            self._close_files()
            if error is None:
                self._finish()
        except OSError as refused:
            raise DatasetRefused(f"{self._root}: {refused.strerror or refused}") from refused
        finally:
            shutil.rmtree(self._part, ignore_errors=True)

    @property
    def episodes(self) -> int:
        """Return the number of whole episodes."""
        return len(self._episodes)

    @property
    def frames(self) -> int:
        """Return the number of frames of whole episodes."""
        return self._frames

    def add_frame(self, state: Floats, action: Floats, images: Mapping[str, Image]) -> None:
        """Add the next frame of the episode; images are RGB, by camera.

        Raises:
            DatasetRefused: a number is not finite, or an image does not fit.
        """
        if not (np.isfinite(state).all() and np.isfinite(action).all()):
            raise DatasetRefused(f"frame {len(self._states)}: a state or action is not finite")
        for camera, video in self._videos.items():
            video.add(images[camera], begins=not self._states)
        self._states.append(state)
        self._actions.append(action)

    def end_episode(self, task: str) -> None:
        """End the episode, which was the task of these words.

        Raises:
            DatasetRefused: it has no frames.
        """
        length = len(self._states)
        if not length:
            raise DatasetRefused(f"episode {self.episodes} ({task}): it has no frames")
        columns = self._columns(length, self._tasks.setdefault(task, len(self._tasks)))
        place = self._write_rows(columns)
        found = {key: statistics.of_values(values) for key, values in columns.items()}
        row: dict[str, Any] = {
            "episode_index": self.episodes,
            "tasks": [task],
            "length": length,
            "data/chunk_index": place.chunk_index,
            "data/file_index": place.file_index,
            "dataset_from_index": self._frames,
            "dataset_to_index": self._frames + length,
        }
        for video in self._videos.values():
            place_of_video, found[video.key] = video.end_episode()
            row |= place_of_video
        for key, one in found.items():
            self._statistics.setdefault(key, []).append(one)
            row |= {f"stats/{key}/{name}": value for name, value in one.document().items()}
        row |= {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        self._episodes.append(row)
        self._frames += length
        self._states, self._actions = [], []

    def _columns(self, length: int, task_index: int) -> dict[str, NDArray[Any]]:
        frame_index = np.arange(length)
        return {
            layout.ACTION: np.array(self._actions, dtype=np.float32),
            layout.STATE: np.array(self._states, dtype=np.float32),
            "timestamp": (frame_index / self._fps).astype(np.float32),
            "frame_index": frame_index,
            "episode_index": np.full(length, self.episodes),
            "index": self._frames + frame_index,
            "task_index": np.full(length, task_index),
        }

    def _write_rows(self, columns: Mapping[str, NDArray[Any]]) -> FilePlace:
        """Write an episode as a row group, and return the place of its file."""
        table = self._arrow.table({key: self._column(one) for key, one in columns.items()})
        place = self._data
        path = self._part / place.path(layout.DATA)
        if self._data_writer is None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._data_writer = self._parquet.ParquetWriter(path, table.schema)
        self._data_writer.write_table(table, row_group_size=table.num_rows)
        if path.stat().st_size >= layout.DATA_FILE_MB * MB:
            self._data_writer.close()
            self._data_writer = None
            self._data = place.following
        return place

    def _column(self, values: NDArray[Any]) -> Any:
        """Return a column; a vector of one dimension is plain numbers there, as LeRobot has it."""
        if values.ndim == 1 or values.shape[1] == 1:
            return self._arrow.array(values.ravel())
        flat = self._arrow.array(values.ravel())
        return self._arrow.FixedSizeListArray.from_arrays(flat, values.shape[1])

    def _close_files(self) -> None:
        for video in self._videos.values():
            video.close()
        if self._data_writer is not None:
            self._data_writer.close()
            self._data_writer = None

    def _finish(self) -> None:
        if not self._episodes:
            raise DatasetRefused(f"{self._root}: there is no episode to write")
        place = FilePlace()
        self._write_table(
            place.path(layout.EPISODES), self._arrow.Table.from_pylist(self._episodes)
        )
        self._write_table(layout.TASKS, self._task_table())
        found = {
            key: statistics.of_all(parts).document() for key, parts in self._statistics.items()
        }
        self._write_json(layout.STATS, found)
        self._write_json(layout.INFO, self._info())
        self._part.rename(self._root)

    def _task_table(self) -> Any:
        """Return the tasks as pandas would write them: the text is the index of the table."""
        table = self._arrow.table(
            {"task_index": list(self._tasks.values()), "task": list(self._tasks)}
        )
        described = {
            "index_columns": ["task"],
            "column_indexes": [],
            "columns": [
                _pandas_column("task_index", "int64", "int64"),
                _pandas_column("task", "unicode", "object"),
            ],
            "creator": {"library": "pyarrow", "version": self._arrow.__version__},
            "pandas_version": "2.2.0",
        }
        return table.replace_schema_metadata({"pandas": json.dumps(described)})

    def _info(self) -> dict[str, Any]:
        videos = {video.key: video.feature() for video in self._videos.values()}
        return {
            "codebase_version": layout.VERSION,
            "robot_type": self._robot_type,
            "total_episodes": self.episodes,
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": layout.FILES_PER_CHUNK,
            "data_files_size_in_mb": layout.DATA_FILE_MB,
            "video_files_size_in_mb": layout.VIDEO_FILE_MB,
            "fps": self._fps,
            "splits": {"train": f"0:{self.episodes}"},
            "data_path": layout.DATA,
            "video_path": layout.VIDEO if videos else None,
            "features": {**self._features, **videos},
        }

    def _write_table(self, name: str, table: Any) -> None:
        path = self._part / name
        path.parent.mkdir(parents=True, exist_ok=True)
        self._parquet.write_table(table, path)

    def _write_json(self, name: str, document: Mapping[str, Any]) -> None:
        (self._part / name).write_text(json.dumps(document, indent=4), encoding="utf-8")


def _pandas_column(name: str, pandas_type: str, numpy_type: str) -> dict[str, Any]:
    return {
        "name": name,
        "field_name": name,
        "pandas_type": pandas_type,
        "numpy_type": numpy_type,
        "metadata": None,
    }
