"""Read LeRobot datasets, version 3.0: what they say of themselves, and an episode's actions."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.runtime.table_schema import is_number
from vla_deploy.telemetry.errors import DatasetUnusable
from vla_deploy.telemetry.lerobot.layout import ACTION, DATA, INFO, extra

Floats = NDArray[np.float64]
_MAJOR: Final = "v3."
_EPISODE_COLUMNS: Final = (
    "episode_index",
    "length",
    "tasks",
    "data/chunk_index",
    "data/file_index",
)
# Frames are told apart by their number; a stamp further off than half a frame is of another rate.
_STAMP_SLACK_FRAMES: Final = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EpisodeActions:
    """Hold the actions of an episode, an array of frame by name, in the dataset's unit."""

    index: int
    tasks: tuple[str, ...]
    fps: float
    names: tuple[str, ...]
    actions: Floats

    @property
    def duration_s(self) -> float:
        """Return the time from the first frame to the last."""
        return (len(self.actions) - 1) / self.fps


class LeRobotDataset:
    """Read a dataset's folder; video is not read."""

    def __init__(self, root: Path) -> None:
        """Read what it says of itself.

        Raises:
            DatasetUnusable: it is none, of another version, or says nothing of its actions.
            ExtraMissing: the extra is not installed.
        """
        self._parquet = extra("pyarrow.parquet")
        self._arrow_error: type[Exception] = extra("pyarrow").ArrowException
        self.root = root
        info = self._info()
        fps = info.get("fps")
        if not is_number(fps) or fps <= 0:
            raise self._unusable(INFO, f"fps: expected a number above 0, got {fps!r}")
        self.fps = float(fps)
        self.names = self._names(info)
        self._data_path = str(info.get("data_path") or DATA)
        self._episodes = self._read_episodes()

    @property
    def episodes(self) -> Sequence[int]:
        """Return the numbers of the episodes."""
        return sorted(self._episodes)

    def episode(self, index: int) -> EpisodeActions:
        """Return the actions of an episode; only its own rows are read.

        Raises:
            DatasetUnusable: there is none of that number, or its rows are not whole and finite.
        """
        row = self._episodes.get(index)
        if row is None:
            there = f"0 to {max(self._episodes)}" if self._episodes else "none"
            raise DatasetUnusable(f"{self.root}: no episode {index}; there are {there}")
        name = self._path_of(row)
        columns = self._rows(name, [ACTION, "frame_index", "timestamp"], index)
        order = np.argsort(columns["frame_index"], kind="stable")
        count = len(order)
        if count != row["length"] or not np.array_equal(
            columns["frame_index"][order], np.arange(count)
        ):
            raise self._unusable(
                name, f"episode {index}: expected frames 0 to {row['length'] - 1}, got {count}"
            )
        self._require_rate(name, index, columns["timestamp"][order])
        actions = columns[ACTION][order].reshape(count, -1)
        if actions.shape[1] != len(self.names):
            raise self._unusable(
                name, f"{ACTION}: expected {len(self.names)} numbers, got {actions.shape[1]}"
            )
        bad = np.argwhere(~np.isfinite(actions))
        if len(bad):
            frame, column = bad[0]
            raise self._unusable(
                name,
                f"episode {index}, frame {frame}: {self.names[column]} is no finite number; "
                f"{len(bad)} of them: leave this episode out",
            )
        return EpisodeActions(
            index=index,
            tasks=tuple(row["tasks"] or ()),
            fps=self.fps,
            names=self.names,
            actions=actions,
        )

    def _info(self) -> Mapping[str, Any]:
        file = self.root / INFO
        try:
            info = json.loads(file.read_text(encoding="utf-8"))
        except FileNotFoundError as error:
            raise self._unusable(INFO, "it is missing: expected a LeRobot dataset") from error
        except (OSError, ValueError) as error:
            raise self._unusable(INFO, f"expected a JSON object: {error}") from error
        version = info.get("codebase_version") if isinstance(info, dict) else None
        if not str(version).startswith(_MAJOR):
            raise self._unusable(
                INFO,
                f"codebase_version: expected v3.0, got {version!r}; LeRobot converts older ones: "
                "python -m lerobot.datasets.v30.convert_dataset_v21_to_v30",
            )
        found: Mapping[str, Any] = info
        return found

    def _names(self, info: Mapping[str, Any]) -> tuple[str, ...]:
        features = info.get("features")
        action = features.get(ACTION) if isinstance(features, dict) else None
        names = action.get("names") if isinstance(action, dict) else None
        if isinstance(names, dict) and len(names) == 1:  # older: {"motors": [...]}
            names = next(iter(names.values()))
        if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
            raise self._unusable(INFO, f"features.{ACTION}.names: expected names, got {names!r}")
        return tuple(names)

    def _read_episodes(self) -> dict[int, dict[str, Any]]:
        files = sorted((self.root / "meta/episodes").glob("*/*.parquet"))
        if not files:
            raise self._unusable("meta/episodes", "no table of episodes is there")
        rows: dict[int, dict[str, Any]] = {}
        for file in files:
            name = str(file.relative_to(self.root))
            for row in self._table(name, list(_EPISODE_COLUMNS)).to_pylist():
                if any(row[key] is None for key in _EPISODE_COLUMNS):
                    raise self._unusable(name, f"a row with nothing in it: {row}")
                rows[row["episode_index"]] = row
        return rows

    def _path_of(self, row: Mapping[str, Any]) -> str:
        try:
            return self._data_path.format(
                chunk_index=row["data/chunk_index"], file_index=row["data/file_index"]
            )
        except (KeyError, IndexError, ValueError) as error:
            raise self._unusable(INFO, f"data_path: got {self._data_path!r}") from error

    def _rows(self, name: str, columns: list[str], index: int) -> dict[str, NDArray[Any]]:
        table = self._table(name, columns, filters=[("episode_index", "==", index)])
        found = {}
        for column in columns:
            values = table.column(column).to_pylist()
            try:
                dtype = np.int64 if column == "frame_index" else np.float64
                found[column] = np.array(values, dtype=dtype)
            except (TypeError, ValueError) as error:
                raise self._unusable(
                    name, f"episode {index}: {column}: expected numbers in every row"
                ) from error
        return found

    def _table(self, name: str, columns: list[str], **how: Any) -> Any:
        try:
            return self._parquet.read_table(self.root / name, columns=columns, **how)
        except FileNotFoundError as error:
            raise self._unusable(name, "it is missing") from error
        except (OSError, self._arrow_error, KeyError, ValueError) as error:
            text = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise self._unusable(
                name, f"expected a table with {', '.join(columns)}: {text}"
            ) from error

    def _require_rate(self, name: str, index: int, stamps_s: Floats) -> None:
        """Check that the frames are as far apart as the dataset's rate says."""
        off = np.abs(stamps_s - stamps_s[:1] - np.arange(len(stamps_s)) / self.fps) * self.fps
        if len(off) and not off.max() < _STAMP_SLACK_FRAMES:
            frame = int(np.nan_to_num(off, nan=np.inf).argmax())
            raise self._unusable(
                name,
                f"episode {index}, frame {frame}: timestamp {stamps_s[frame]:.3f} s, expected "
                f"{frame / self.fps:.3f} s at {self.fps:g} frames a second",
            )

    def _unusable(self, name: str, text: str) -> DatasetUnusable:
        return DatasetUnusable(f"{self.root / name}: {text}")
