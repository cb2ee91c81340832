"""Read labelled images: YOLO's text files, or a COCO JSON file.

YOLO: for each image `NAME.txt`, next to it or with `labels` for `images` in its path; in each line
a class number and middle, width and height as shares of the image. `classes.txt`, where there is
one, names the classes. COCO: a JSON file with `images`, `annotations` and `categories`, `bbox` in
pixels; the images lie next to it or in `images`.
"""

import json
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from vla_deploy.inference.errors import ImagesInvalid
from vla_deploy.perception.detectors.boxes import Floats, Indices
from vla_deploy.perception.detectors.image_input import Image
from vla_deploy.runtime.table_schema import TEXT, Shape, ValueCheck, is_number

SUFFIXES: Final = (".bmp", ".jpeg", ".jpg", ".png", ".ppm", ".tif", ".tiff", ".webp")
_NAMES: Final = "classes.txt"
_ID: Final = ValueCheck(
    expected="a number or a text", holds=lambda value: is_number(value) or isinstance(value, str)
)
_BOX: Final = ValueCheck(
    expected="left, top, width, height",
    holds=lambda value: (
        isinstance(value, list)
        and len(value) == 4
        and all(map(is_number, value))
        and min(value[2:]) > 0
    ),
)
_COCO: Final[Mapping[str, Shape]] = {
    "images": {"id": _ID, "file_name": TEXT},
    "annotations": {"image_id": _ID, "category_id": _ID, "bbox": _BOX},
    "categories": {"id": _ID, "name": TEXT},
}
_VALUES: Final = 5


def image_paths(folder: Path) -> list[Path]:
    """Return the images of a folder and of those below it.

    Raises:
        ImagesInvalid: it is no folder, or holds none.
    """
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    if not paths:
        what = "holds no image" if folder.is_dir() else "no such folder"
        raise ImagesInvalid(f"{folder}: {what}; expected files ending in {', '.join(SUFFIXES)}")
    return paths


def read_image(path: Path) -> Image:
    """Return an image as RGB (h, w, 3).

    Raises:
        ImagesInvalid: it cannot be read.
    """
    bgr = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if bgr is None:
        raise ImagesInvalid(f"{path}: no image that can be read; remove it or save it anew")
    rgb: Image = cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)
    return rgb


def spread_paths(folder: Path, most: int) -> list[Path]:
    """Return at most so many images, spread over the folder.

    Raises:
        ImagesInvalid: there is none.
    """
    paths = image_paths(folder)
    step = max(1.0, len(paths) / most)
    return [paths[int(number * step)] for number in range(min(most, len(paths)))]


@dataclass(frozen=True, slots=True, kw_only=True)
class Labels:
    """Hold what is really in an image: boxes (n, 4) in pixels, and their class numbers (n,)."""

    corners_px: Floats
    classes: Indices


@dataclass(frozen=True, slots=True, kw_only=True)
class LabelledImage:
    """Hold where an image is, and what is in it: class and box of each thing.

    Boxes (n, 4) are corners in pixels, or shares of the image, whose size is not known yet.
    """

    path: Path
    classes: Indices
    corners: Floats
    are_shares: bool

    def read(self) -> tuple[Image, Labels]:
        """Return the image and what is in it.

        Raises:
            ImagesInvalid: the image cannot be read.
        """
        rgb = read_image(self.path)
        size = [rgb.shape[1], rgb.shape[0]] if self.are_shares else [1, 1]
        corners = self.corners * np.array([*size, *size], dtype=np.float32)
        return rgb, Labels(corners_px=corners, classes=self.classes)


def read_labelled(path: Path, classes: tuple[str, ...]) -> list[LabelledImage]:
    """Return the labelled images of a folder, or of a COCO file, with the numbers of `classes`.

    All labels are checked here; images are read later, as they do not fit into memory together.

    Raises:
        ImagesInvalid: images or labels are missing or wrong, or name other classes.
    """
    if path.suffix.lower() == ".json":
        return list(_coco(path, classes))
    if not path.is_dir():
        raise ImagesInvalid(
            f"{path}: expected a folder with labels, or a COCO file ending in .json"
        )
    return list(_yolo(path, classes))


def _yolo(folder: Path, classes: tuple[str, ...]) -> Iterator[LabelledImage]:
    _check_names(folder / _NAMES, classes)
    labelled = [(path, _label_file(path)) for path in image_paths(folder)]
    if not any(label.is_file() for _, label in labelled):
        raise ImagesInvalid(f"{folder}: no image has labels; the first would be {labelled[0][1]}")
    for path, label in labelled:
        # An image without a file of labels shows nothing.
        rows = _rows(label, len(classes)) if label.is_file() else []
        table = np.array(rows, dtype=np.float32).reshape(-1, _VALUES)
        middle, half = table[:, 1:3], 0.5 * table[:, 3:5]
        yield LabelledImage(
            path=path,
            classes=table[:, 0].astype(np.intp),
            corners=np.hstack([middle - half, middle + half]),
            are_shares=True,
        )


def read_names(file: Path) -> tuple[str, ...]:
    """Return the classes that a file names, one in each line.

    Raises:
        ImagesInvalid: it cannot be read as text.
    """
    return tuple(line.strip() for line in _lines(file) if line.strip())


def _check_names(file: Path, classes: tuple[str, ...]) -> None:
    if not file.is_file():
        return
    names = read_names(file)
    if names != classes:
        raise ImagesInvalid(
            f"{file}: expected the model's classes {list(classes)}, got {list(names)}"
        )


def _label_file(image: Path) -> Path:
    """Return where an image's labels are: next to it, or in `labels` for the last `images`."""
    sibling = image.with_suffix(".txt")
    parts = list(image.parts)
    if sibling.is_file() or "images" not in parts:
        return sibling
    last = len(parts) - 1 - parts[::-1].index("images")
    parts[last] = "labels"
    return Path(*parts).with_suffix(".txt")


def _rows(file: Path, class_count: int) -> list[list[float]]:
    """Return the rows of a label file.

    Raises:
        ImagesInvalid: a line is not five numbers, each in its range.
    """
    rows = []
    for number, line in enumerate(_lines(file), start=1):
        if line.strip():
            rows.append(_row(f"{file}:{number}", line, class_count))
    return rows


def _lines(file: Path) -> list[str]:
    try:
        return file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ImagesInvalid(f"{file}: expected a text file in UTF-8: {error}") from error


def _row(where: str, line: str, class_count: int) -> list[float]:
    try:
        row = [float(word) for word in line.split()]
    except ValueError:
        row = []
    if len(row) != _VALUES:
        raise ImagesInvalid(
            f"{where}: expected class, x, y, width, height as shares of the image, got {line!r}"
        )
    if not (row[0].is_integer() and 0 <= row[0] < class_count):
        raise ImagesInvalid(
            f"{where}: expected a class from 0 to {class_count - 1}, as the model has, "
            f"got {line.split()[0]}"
        )
    if not all(0.0 <= value <= 1.0 for value in row[1:]):
        raise ImagesInvalid(f"{where}: expected shares of the image from 0 to 1, got {line!r}")
    return row


def _coco(file: Path, classes: tuple[str, ...]) -> Iterator[LabelledImage]:
    document = _document(file)
    numbers = _class_numbers(file, document["categories"], classes)
    by_image: dict[Any, list[Mapping[str, Any]]] = defaultdict(list)
    for annotation in document["annotations"]:
        by_image[annotation["image_id"]].append(annotation)
    unknown = by_image.keys() - {image["id"] for image in document["images"]}
    if unknown:
        raise ImagesInvalid(
            f"{file}: annotations name images {sorted(map(str, unknown))[:5]}, unknown"
        )
    for image in document["images"]:
        path = _image_of(file, image["file_name"])
        yield _coco_image(file, path, by_image[image["id"]], numbers)


def _document(file: Path) -> Mapping[str, Any]:
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ImagesInvalid(f"{file}: expected a COCO file: {error}") from error
    missing = [
        key
        for key in _COCO
        if not isinstance(document, dict) or not isinstance(document.get(key), list)
    ]
    if missing:
        raise ImagesInvalid(f"{file}: expected a COCO file, it has no list {', '.join(missing)}")
    for group, shape in _COCO.items():
        for number, row in enumerate(document[group]):
            _check_row(f"{file}: {group}[{number}]", row, shape)
    checked: Mapping[str, Any] = document
    return checked


def _check_row(where: str, row: object, shape: Shape) -> None:
    """Accept a table that has what is needed; what else it has is of no interest."""
    table = row if isinstance(row, dict) else {}
    lacking = [key for key in shape if key not in table]
    if lacking:
        raise ImagesInvalid(f"{where} has no {', '.join(lacking)}")
    for key, check in shape.items():
        if not check.holds(table[key]):
            raise ImagesInvalid(f"{where}.{key}: expected {check.expected}, got {table[key]!r}")


def _class_numbers(
    file: Path, categories: list[Mapping[str, Any]], classes: tuple[str, ...]
) -> dict[Any, int]:
    """Return the model's class number for each category; one that it lacks is a fault."""
    foreign = [row["name"] for row in categories if row["name"] not in classes]
    if foreign:
        raise ImagesInvalid(
            f"{file}: categories {foreign} are none of the model's: {list(classes)}"
        )
    return {row["id"]: classes.index(row["name"]) for row in categories}


def _image_of(file: Path, name: str) -> Path:
    places = (file.parent / name, file.parent / "images" / name)
    for place in places:
        if place.is_file():
            return place
    raise ImagesInvalid(f"{file}: image {name!r} is neither {places[0]} nor {places[1]}")


def _coco_image(
    file: Path, path: Path, annotations: list[Mapping[str, Any]], numbers: Mapping[Any, int]
) -> LabelledImage:
    for annotation in annotations:
        if annotation["category_id"] not in numbers:
            raise ImagesInvalid(f"{file}: category {annotation['category_id']} is not declared")
    boxes = np.array([one["bbox"] for one in annotations], dtype=np.float32).reshape(-1, 4)
    corners = np.hstack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])
    found = np.array([numbers[one["category_id"]] for one in annotations], dtype=np.intp)
    return LabelledImage(path=path, classes=found, corners=corners, are_shares=False)
