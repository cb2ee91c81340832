"""Declare which keys a manifest has and what each may hold."""

import re
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any, Final

from platforms.profile_schema import ROLES
from vla_deploy.inference.key_words_schema import key_words_cross_faults, key_words_faults
from vla_deploy.inference.language_schema import language_cross_faults, language_faults
from vla_deploy.inference.manifest import Fit, TensorLayout, Variant
from vla_deploy.inference.whisper_schema import whisper_cross_faults, whisper_faults
from vla_deploy.robots.schema import (
    OPTIONAL_TABLE,
    OPTIONAL_TEXT,
    POSITIVE,
    TABLE,
    TABLES,
    TEXT,
    RobotFileFault,
    Shape,
    ValueCheck,
    check_record,
    is_number,
    one_of,
)

DTYPES: Final = ("float32", "float16", "uint8", "int8", "int32", "int64", "bool")
PIXEL_DTYPES: Final = ("float32", "float16", "uint8", "int32", "int64")
COLOURS: Final = ("rgb", "bgr")
DETECTOR: Final = "detector"
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9_.-]{0,63}")
_SHA256: Final = re.compile(r"[0-9a-f]{64}")


def is_name(value: object) -> bool:
    """Return whether a value may name a model: it is a folder's name too."""
    return isinstance(value, str) and _NAME.fullmatch(value) is not None


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value > 0


def _is_tally(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_shape(value: object) -> bool:
    return isinstance(value, list) and all(
        _is_count(one) or (isinstance(one, str) and one != "") for one in value
    )


def _is_file_name(value: object) -> bool:
    """Return whether a value names a file below the model's folder."""
    if not isinstance(value, str) or not value:
        return False
    path = PurePosixPath(value)
    return not path.is_absolute() and ".." not in path.parts


def _is_three(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(is_number, value))


def _are_classes(value: object) -> bool:
    return (
        isinstance(value, list)
        and value != []
        and all(isinstance(one, str) and one for one in value)
        and len(set(value)) == len(value)
    )


NAME: Final = ValueCheck(expected="small letters, digits, '_', '-' or '.'", holds=is_name)
FILE_NAME: Final = ValueCheck(expected="a file in the model's folder", holds=_is_file_name)
RATIO: Final = ValueCheck(
    expected="a number from 0 to 1", holds=lambda value: is_number(value) and 0 <= value <= 1
)
COUNT: Final = ValueCheck(expected="an integer above 0", holds=_is_count)
TALLY: Final = ValueCheck(expected="an integer from 0", holds=_is_tally)
OPTIONAL_RATIO: Final = ValueCheck(expected=RATIO.expected, holds=RATIO.holds, is_optional=True)
OPTIONAL_TALLY: Final = ValueCheck(expected=TALLY.expected, holds=TALLY.holds, is_optional=True)
OPTIONAL_TABLES: Final = ValueCheck(expected=TABLES.expected, holds=TABLES.holds, is_optional=True)
THREE: Final = ValueCheck(expected="three numbers", holds=_is_three)

_HEAD: Shape = {
    "name": NAME,
    "role": one_of(*ROLES),
    "summary": TEXT,
    "licence": TEXT,
    "card": OPTIONAL_TEXT,
}
_GRAPH: Shape = {
    **_HEAD,
    "inputs": TABLES,
    "outputs": TABLES,
    "files": TABLE,
    "detection": OPTIONAL_TABLE,
    "key_words": OPTIONAL_TABLE,
}
_WHISPER: Shape = {**_HEAD, "parts": TABLES, "whisper": TABLE}
_LANGUAGE: Shape = {**_HEAD, "parts": TABLES, "language": TABLE}
_TENSOR: Shape = {
    "name": TEXT,
    "shape": ValueCheck(
        expected="a list of sizes, or of names for those that are free", holds=_is_shape
    ),
    "dtype": one_of(*DTYPES),
}
_FILE: Shape = {
    "path": FILE_NAME,
    "sha256": ValueCheck(
        expected="64 hexadecimal digits",
        holds=lambda value: isinstance(value, str) and _SHA256.fullmatch(value) is not None,
    ),
}
_DETECTION: Shape = {
    "adapter": TEXT,
    "classes": ValueCheck(expected="a list of names, none twice", holds=_are_classes),
    "score_threshold": RATIO,
    "weak_score_threshold": OPTIONAL_RATIO,
    "iou_threshold": RATIO,
    "image": TABLE,
    "measured": OPTIONAL_TABLE,
}
_MEASURED: Shape = {
    "precision": RATIO,
    "recall": RATIO,
    "boxes": OPTIONAL_TALLY,
    "things": OPTIONAL_TALLY,
    "classes": OPTIONAL_TABLES,
}
_CLASS_MEASURED: Shape = {
    "name": TEXT,
    "precision": RATIO,
    "recall": RATIO,
    "boxes": TALLY,
    "things": TALLY,
}
_IMAGE: Shape = {
    "width_px": COUNT,
    "height_px": COUNT,
    "layout": one_of(*TensorLayout),
    "colour": one_of(*COLOURS),
    "fit": one_of(*Fit),
    "fill": ValueCheck(
        expected="an integer in 0..255",
        holds=lambda value: isinstance(value, int) and 0 <= value <= 255,
    ),
    "scale": POSITIVE,
    "mean": THREE,
    "std": ValueCheck(
        expected="three numbers above 0",
        holds=lambda value: _is_three(value) and min(value) > 0,
    ),
}


def manifest_faults(document: Mapping[str, Any], folder_name: str) -> Iterator[RobotFileFault]:
    """Find every key that is unknown, missing or wrong, then what does not fit together."""
    faults = [*_key_faults(document)]
    yield from faults or _cross_faults(document, folder_name)


def _key_faults(document: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    if "whisper" in document:
        yield from _part_faults(document, _WHISPER)
        yield from whisper_faults(_table(document["whisper"]))
    elif "language" in document:
        yield from _part_faults(document, _LANGUAGE)
        yield from language_faults(_table(document["language"]))
    else:
        yield from _graph_key_faults(document)


def _part_faults(document: Mapping[str, Any], shape: Shape) -> Iterator[RobotFileFault]:
    """Check a model that has several files, all of them needed."""
    yield from check_record(document, "", shape)
    for number, record in enumerate(_rows(document.get("parts"))):
        yield from check_record(record, f"parts[{number}]", _FILE)


def _graph_key_faults(document: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    yield from check_record(document, "", _GRAPH)
    for group in ("inputs", "outputs"):
        for number, record in enumerate(_rows(document.get(group))):
            yield from check_record(record, f"{group}[{number}]", _TENSOR)
    files = _table(document.get("files"))
    for name in files:
        if name not in tuple(Variant):
            expected = f"one of {', '.join(Variant)}"
            yield RobotFileFault(key=f"files.{name}", got="an unknown key", expected=expected)
        yield from check_record(_table(files[name]), f"files.{name}", _FILE)
    if isinstance(document.get("key_words"), dict):
        yield from key_words_faults(document["key_words"])
    if isinstance(document.get("detection"), dict):
        detection = document["detection"]
        yield from check_record(detection, "detection", _DETECTION)
        if isinstance(detection.get("measured"), dict):
            yield from _measured_faults(detection["measured"])
        if isinstance(detection.get("image"), dict):
            yield from check_record(detection["image"], "detection.image", _IMAGE)


def _measured_faults(measured: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    yield from check_record(measured, "detection.measured", _MEASURED)
    for number, record in enumerate(_rows(measured.get("classes"))):
        yield from check_record(record, f"detection.measured.classes[{number}]", _CLASS_MEASURED)


def _cross_faults(document: Mapping[str, Any], folder_name: str) -> Iterator[RobotFileFault]:
    if document["name"] != folder_name:
        expected = f"{folder_name!r}, as its folder"
        yield RobotFileFault(key="name", got=repr(document["name"]), expected=expected)
    if "whisper" in document:
        yield from whisper_cross_faults(document)
        return
    if "language" in document:
        yield from language_cross_faults(document)
        return
    for group in ("inputs", "outputs", "files"):
        if not document[group]:
            yield RobotFileFault(key=group, got="none", expected="one at least")
    yield from key_words_cross_faults(document)
    if document["role"] == DETECTOR and "detection" not in document:
        yield RobotFileFault(
            key="detection", got="nothing", expected="a table, as the role is detector"
        )
    if "detection" in document and document["inputs"]:
        yield from _image_faults(document)
        yield from _score_faults(document["detection"])
        yield from _class_faults(document["detection"])


def _score_faults(detection: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find a weak score that is above the sure one."""
    sure = detection["score_threshold"]
    weak = detection.get("weak_score_threshold", sure)
    if weak > sure:
        expected = f"at most score_threshold, {sure}"
        yield RobotFileFault(
            key="detection.weak_score_threshold", got=repr(weak), expected=expected
        )


def _class_faults(detection: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Compare the classes that were measured with those that there are."""
    names = [row["name"] for row in detection.get("measured", {}).get("classes", [])]
    if len(set(names)) != len(names) or not set(names) <= set(detection["classes"]):
        expected = f"each once, of {detection['classes']}"
        yield RobotFileFault(key="detection.measured.classes", got=repr(names), expected=expected)


def _image_faults(document: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Compare the image with the input it is for."""
    image, shape = document["detection"]["image"], document["inputs"][0]["shape"]
    width, height = image["width_px"], image["height_px"]
    wanted = (
        [1, 3, height, width] if image["layout"] == TensorLayout.NCHW else [1, height, width, 3]
    )
    fits = len(shape) == 4 and all(
        isinstance(got, str) or got == want for got, want in zip(shape, wanted, strict=True)
    )
    if len(document["inputs"]) != 1 or not fits:
        got = [record["shape"] for record in document["inputs"]]
        yield RobotFileFault(key="inputs", got=f"shapes {got}", expected=f"one of shape {wanted}")
    yield from _pixel_faults(image, document["inputs"][0]["dtype"])


def _pixel_faults(image: Mapping[str, Any], dtype: str) -> Iterator[RobotFileFault]:
    """Hold the normalisation against the input's type: integers would cut shares of 255 to 0."""
    if dtype not in PIXEL_DTYPES:
        expected = f"one of {', '.join(PIXEL_DTYPES)}, which hold pixels"
        yield RobotFileFault(key="inputs[0].dtype", got=repr(dtype), expected=expected)
    if dtype.startswith("float"):
        return
    for key, plain in (("scale", 1), ("mean", [0, 0, 0]), ("std", [1, 1, 1])):
        if image[key] != plain:
            expected = f"{plain}, as its input is of {dtype}: pixels as they are"
            yield RobotFileFault(
                key=f"detection.image.{key}", got=repr(image[key]), expected=expected
            )


def _rows(value: object) -> list[Mapping[str, Any]]:
    return [row for row in value if isinstance(row, dict)] if isinstance(value, list) else []


def _table(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}
