"""Read and write occupancy maps in the format of ROS map_server: a YAML file beside a grey image.

What a shade means is said by the file's mode, with p = (255 - shade) / 255, or shade / 255 where
`negate` is set:

    trinary   p above occupied_thresh is occupied, below free_thresh free, unknown between
    scale     the same, but between the two it is as probable as p says
    raw       the shade is the probability in percent; above 100 is unknown

This project uses one shade more: black is what crosses the lidar's plane, dark grey only what the
body would hit above or below it. To every other reader of the format both are occupied.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml
from numpy.typing import NDArray

from vla_deploy.robots.errors import MapInvalid
from vla_deploy.runtime.one_line import one_line

Shades = NDArray[np.uint8]

OCCUPIED_SHADE: Final = 0
LOW_SHADE: Final = 60
UNKNOWN_SHADE: Final = 205
FREE_SHADE: Final = 254
REQUIRED_KEYS: Final = ("image", "resolution", "origin", "occupied_thresh", "free_thresh")
RESOLUTION_RANGE_M: Final = (0.001, 5.0)
MOST_CELLS: Final = 25_000_000
"""250 m by 250 m at 0.05 m: reading so many takes 0.3 GB, which the smallest board has."""
MOST_ORIGIN_M: Final = 100_000.0
UNKNOWN: Final = -1
_RAW_MOST: Final = 100
# A binary PGM of eight bits: comments may stand between all that its head holds.
_GAP: Final = rb"(?:\s|#[^\n]*\n)+"
_PGM: Final = re.compile(rb"P5" + _GAP + rb"(\d+)" + _GAP + rb"(\d+)" + _GAP + rb"255\s")
_SWITCH: Final = {"0": False, "1": True, "false": False, "true": True, "no": False, "yes": True}


class MapMode(StrEnum):
    """Say what the shades between free and occupied mean."""

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapFile:
    """Hold a map as its file says it; row 0 of `shades` is the northernmost.

    `origin_m` is the map-frame position of the image's lower left corner.
    """

    shades: Shades
    resolution_m: float
    origin_m: tuple[float, float]
    mode: MapMode = MapMode.TRINARY
    negate: bool = False
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196

    def probability(self) -> NDArray[np.float64]:
        """Return how probably each cell is occupied, NaN where that is unknown; row 0 is south."""
        return self._probability_of_shades()[np.flipud(self.shades)]

    def occupancy(self) -> NDArray[np.int8]:
        """Return each cell as nav_msgs/OccupancyGrid has it: 0..100, -1 unknown; row 0 is south."""
        probability = self._probability_of_shades()
        percent = np.rint(np.nan_to_num(probability, nan=0.0) * 100.0)
        percent[np.isnan(probability)] = UNKNOWN
        return percent.astype(np.int8)[np.flipud(self.shades)]

    def as_trinary(self) -> "MapFile":
        """Return the map in the shades that map_server writes; low cells keep their dark grey."""
        if self.mode is MapMode.TRINARY and not self.negate:
            return self
        probability = np.flipud(self.probability())
        shades = np.full(probability.shape, UNKNOWN_SHADE, dtype=np.uint8)
        shades[probability > self.occupied_thresh] = OCCUPIED_SHADE
        shades[probability < self.free_thresh] = FREE_SHADE
        return replace(
            self,
            shades=shades,
            mode=MapMode.TRINARY,
            negate=False,
            occupied_thresh=0.65,
            free_thresh=0.196,
        )

    def _probability_of_shades(self) -> NDArray[np.float64]:
        shades = np.arange(256, dtype=np.float64)
        if self.mode is MapMode.RAW:
            return np.where(shades > _RAW_MOST, np.nan, shades / _RAW_MOST)
        dark = shades / 255.0 if self.negate else (255.0 - shades) / 255.0
        certain = np.where(dark > self.occupied_thresh, 1.0, np.nan)
        certain = np.where(dark < self.free_thresh, 0.0, certain)
        if self.mode is MapMode.TRINARY:
            return certain
        span = self.occupied_thresh - self.free_thresh
        return np.where(np.isnan(certain), (dark - self.free_thresh) / span, certain)


def read_map_file(yaml_path: Path) -> MapFile:
    """Read a map.

    Raises:
        MapInvalid: a file is missing or not readable, or keys are missing or out of range; the
            message names all of them.
    """
    entries = _entries(yaml_path)
    faults = list(_faults(entries))
    if faults:
        raise MapInvalid(f"{yaml_path}: {'; '.join(faults)}")
    origin = _numbers(entries["origin"])
    return MapFile(
        shades=_read_shades(yaml_path.parent / str(entries["image"])),
        resolution_m=_number(entries["resolution"]),
        origin_m=(origin[0], origin[1]),
        mode=MapMode(_word(entries, "mode", "trinary")),
        negate=_SWITCH[_word(entries, "negate", "0")],
        occupied_thresh=_number(entries["occupied_thresh"]),
        free_thresh=_number(entries["free_thresh"]),
    )


def image_of(yaml_path: Path) -> Path:
    """Return the image that a map's file names.

    Raises:
        MapInvalid: the file is missing or not readable, or keys are missing.
    """
    return yaml_path.parent / str(_entries(yaml_path)["image"])


def files_of(yaml_path: Path) -> tuple[Path, Path]:
    """Return the two files that `write_map_file` writes."""
    return yaml_path, yaml_path.with_suffix(".pgm")


def require_free(yaml_path: Path) -> None:
    """Check that writing a map overwrites nothing.

    Raises:
        MapInvalid: one of its files exists.
    """
    existing = [str(one) for one in files_of(yaml_path) if one.exists()]
    if existing:
        raise MapInvalid(
            f"{' and '.join(existing)} is there already; choose another, or: --replace"
        )


def write_map_file(yaml_path: Path, file: MapFile, *, comment: str = "") -> None:
    """Write a map: `<name>.yaml` and `<name>.pgm` beside it; readers see the old or the new one.

    Raises:
        MapInvalid: the files cannot be written.
    """
    _, image_path = files_of(yaml_path)
    height, width = file.shades.shape
    header = f"P5\n{width} {height}\n255\n".encode("ascii")
    try:
        _replace(image_path, header + np.ascontiguousarray(file.shades).tobytes())
        _replace(yaml_path, _as_yaml(file, image_path.name, comment).encode())
    except OSError as error:
        raise MapInvalid(f"{yaml_path}: cannot write the map: {error.strerror}") from error


def _as_yaml(file: MapFile, image: str, comment: str) -> str:
    return "".join(f"# {line}\n" for line in comment.splitlines()) + (
        f"image: {image}\n"
        f"resolution: {file.resolution_m}\n"
        f"origin: [{file.origin_m[0]}, {file.origin_m[1]}, 0.0]\n"
        f"negate: {int(file.negate)}\n"
        f"occupied_thresh: {file.occupied_thresh}\n"
        f"free_thresh: {file.free_thresh}\n"
        f"mode: {file.mode}\n"
    )


def _replace(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_bytes(content)
    fresh.replace(path)


def _faults(entries: Mapping[str, Any]) -> list[str]:
    """Return every fault of a map file's values."""
    faults = []
    low_m, high_m = RESOLUTION_RANGE_M
    if not low_m <= _number(entries["resolution"]) <= high_m:
        faults.append(
            f"resolution: expected metres from {low_m} to {high_m:g}, got {entries['resolution']}"
        )
    origin = _numbers(entries["origin"])
    is_near = all(abs(one_m) <= MOST_ORIGIN_M for one_m in origin)  # nan is not
    if len(origin) != 3 or not is_near or origin[2] != 0.0:
        faults.append(
            f"origin: expected [x, y, 0.0] within {MOST_ORIGIN_M:g} m, got {entries['origin']}; "
            "a turned map must be drawn straight first"
        )
    free, occupied = _number(entries["free_thresh"]), _number(entries["occupied_thresh"])
    if not 0.0 <= free < occupied <= 1.0:
        faults.append(
            f"free_thresh, occupied_thresh: expected 0..1, rising, got {free}, {occupied}"
        )
    mode = _word(entries, "mode", "trinary")
    if mode not in list(MapMode):
        faults.append(f"mode: expected {', '.join(MapMode)}, got {mode!r}")
    negate = _word(entries, "negate", "0")
    if negate not in _SWITCH:
        faults.append(f"negate: expected 0 or 1, got {negate!r}")
    return faults


def _read_shades(path: Path) -> Shades:
    expected = f"{path}: expected a grey image"
    if not path.is_file():
        raise MapInvalid(f"{expected}, found no such file")
    image = _read_pgm(path)
    if image is None:
        image = _read_by_opencv(path, expected)
    if image.size > MOST_CELLS:
        raise MapInvalid(f"{path}: expected at most {MOST_CELLS} cells, got {image.size}")
    return np.asarray(image, dtype=np.uint8)


def _read_pgm(path: Path) -> Shades | None:
    """Return the shades of a whole binary PGM of eight bits, None for any other file.

    It needs no OpenCV, which the Python of ROS need not have.
    """
    try:
        content = path.read_bytes()
    except OSError:
        return None  # OpenCV says in its words what is wrong
    head = _PGM.match(content)
    if head is None:
        return None
    width, height = int(head[1]), int(head[2])
    if width * height == 0 or len(content) - head.end() < width * height:
        return None
    shades = np.frombuffer(content, np.uint8, width * height, head.end())
    return shades.reshape(height, width).copy()


def _read_by_opencv(path: Path, expected: str) -> Shades:
    try:
        import cv2
    except ImportError as error:
        raise MapInvalid(
            f"{path}: expected a binary PGM of eight bits: this Python has no OpenCV to read others"
        ) from error
    try:
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    except cv2.error as error:
        raise MapInvalid(f"{expected}, found one that cannot be read: {error}") from error
    if image is None or image.size == 0:
        raise MapInvalid(f"{expected}, found one that cannot be read")
    if _has_transparent_cells(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)):
        raise MapInvalid(
            f"{expected}, found transparent cells, whose shade means nothing: draw what is unknown "
            f"in the shade {UNKNOWN_SHADE}, and without transparency"
        )
    return np.asarray(image, dtype=np.uint8)


def _has_transparent_cells(image: NDArray[Any] | None) -> bool:
    """Return whether some cell shows what is behind the image; cv2 gives four channels then."""
    if image is None or image.ndim < 3 or image.shape[2] < 4:
        return False
    opaque = np.iinfo(image.dtype).max
    return bool((image[..., 3] < opaque).any())


def _entries(path: Path) -> dict[str, Any]:
    """Return what a map's file says, with all keys that it must have."""
    try:
        entries = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is no text"
        raise MapInvalid(f"{path}: cannot read the map: {why}") from error
    except RecursionError:
        raise MapInvalid(f"{path}: expected `key: value`, in YAML: nested too deeply") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "context_mark", None) or getattr(error, "problem_mark", None)
        where = f"{path}:{mark.line + 1}" if mark else str(path)
        why = one_line(getattr(error, "problem", None) or error)
        raise MapInvalid(f"{where}: expected `key: value`, in YAML: {why}") from error
    if not isinstance(entries, dict):
        raise MapInvalid(f"{path}: expected lines of `key: value`, got {entries!r:.40}")
    missing = [key for key in REQUIRED_KEYS if entries.get(key) is None]
    if missing:
        raise MapInvalid(f"{path}: missing {', '.join(missing)}; see ROS map_server's format")
    return entries


def _word(entries: Mapping[str, Any], key: str, default: str) -> str:
    return str(entries.get(key, default)).lower()


def _number(value: Any) -> float:
    """Return a number, NaN where it is none."""
    try:
        return float(str(value))
    except ValueError:
        return math.nan


def _numbers(value: Any) -> list[float]:
    return [_number(item) for item in value] if isinstance(value, list) else []
