"""Declare which keys a manifest has, what each may hold, and what must fit together."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any, Final

from platforms.profile_schema import ROLES
from vla_deploy.inference.manifest import (
    EncoderContext,
    Fit,
    LanguageUse,
    Pooling,
    TensorLayout,
    Variant,
)
from vla_deploy.runtime.table_schema import (
    NUMBER,
    POSITIVE,
    TABLE,
    TABLES,
    TEXT,
    Shape,
    TableFault,
    ValueCheck,
    check_record,
    check_tables,
    integer,
    is_number,
    number,
    numbers,
    one_of,
)

DETECTOR: Final = "detector"
KEY_WORDS: Final = "key_words"
SPEECH_TO_TEXT: Final = "speech_to_text"
PLANNER: Final = "planner"
TEXT_EMBEDDER: Final = "text_embedder"
DTYPES: Final = ("float32", "float16", "uint8", "int8", "int32", "int64", "bool")
PIXEL_DTYPES: Final = ("float32", "float16", "uint8", "int32", "int64")
COLOURS: Final = ("rgb", "bgr")
THRESHOLDS: Final = ("low", "normal", "high")
"""How easily a word is taken for said: high alarms at the slightest."""
WHISPER_PARTS: Final = ("model.bin", "config.json", "tokenizer.json")
VOCABULARIES: Final = ("vocabulary.json", "vocabulary.txt")
"""CTranslate2 converters of different age name it differently; one of them is there."""
GENAI_CONFIG: Final = "genai_config.json"
TOKENIZER: Final = "tokenizer.json"
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9_.-]{0,63}")
_SHA256: Final = re.compile(r"[0-9a-f]{64}")


def is_name(value: object) -> bool:
    """Return whether a value may name a model: it is a folder's name too."""
    return isinstance(value, str) and _NAME.fullmatch(value) is not None


def _is_shape(value: object) -> bool:
    return isinstance(value, list) and all(
        COUNT.holds(one) or (isinstance(one, str) and one != "") for one in value
    )


def _is_file_name(value: object) -> bool:
    """Return whether a value names a file below the model's folder."""
    if not isinstance(value, str) or not value:
        return False
    path = PurePosixPath(value)
    return not path.is_absolute() and ".." not in path.parts


def _are_names(value: object) -> bool:
    return (
        isinstance(value, list)
        and value != []
        and all(isinstance(one, str) and one for one in value)
        and len(set(value)) == len(value)
    )


def _are_words(value: object) -> bool:
    return (
        isinstance(value, list)
        and _are_names(value)
        and all(one.isalpha() and one.islower() for one in value)
    )


COUNT: Final = integer(1)
TALLY: Final = integer(0)
RATIO: Final = number(0, 1)

_HEAD: Shape = {
    "name": ValueCheck(expected="small letters, digits, '_', '-' or '.'", holds=is_name),
    "role": one_of(*ROLES),
    "summary": TEXT,
    "licence": TEXT,
    "card": TEXT.optional,
}
_GRAPH: Shape = {
    **_HEAD,
    "inputs": TABLES,
    "outputs": TABLES,
    "files": TABLE,
    "detection": TABLE.optional,
    "key_words": TABLE.optional,
}
_TENSOR: Shape = {
    "name": TEXT,
    "shape": ValueCheck(
        expected="a list of sizes, or of names for those that are free", holds=_is_shape
    ),
    "dtype": one_of(*DTYPES),
}
_FILE: Shape = {
    "path": ValueCheck(expected="a file in the model's folder", holds=_is_file_name),
    "sha256": ValueCheck(
        expected="64 hexadecimal digits",
        holds=lambda value: isinstance(value, str) and _SHA256.fullmatch(value) is not None,
    ),
}
_SHAPES: Final[Mapping[str, Shape]] = {
    "inputs": _TENSOR,
    "outputs": _TENSOR,
    "files": dict.fromkeys(Variant, TABLE.optional),
    "files.*": _FILE,
    "parts": _FILE,
    "detection": {
        "adapter": TEXT,
        "classes": ValueCheck(expected="a list of names, none twice", holds=_are_names),
        "score_threshold": RATIO,
        "weak_score_threshold": RATIO.optional,
        "iou_threshold": RATIO,
        "image": TABLE,
        "measured": TABLE.optional,
    },
    "detection.measured": {
        "precision": RATIO,
        "recall": RATIO,
        "boxes": TALLY.optional,
        "things": TALLY.optional,
        "classes": TABLES.optional,
    },
    "detection.measured.classes": {
        "name": TEXT,
        "precision": RATIO,
        "recall": RATIO,
        "boxes": TALLY,
        "things": TALLY,
    },
    "detection.image": {
        "width_px": COUNT,
        "height_px": COUNT,
        "layout": one_of(*TensorLayout),
        "colour": one_of(*COLOURS),
        "fit": one_of(*Fit),
        "fill": integer(0, 255),
        "scale": POSITIVE,
        "mean": numbers(3),
        "std": ValueCheck(
            expected="three numbers above 0",
            holds=lambda value: numbers(3).holds(value) and min(value) > 0,
        ),
    },
    "key_words": {
        "features": TEXT,
        "words": ValueCheck(
            expected="a list of words in small letters, none twice", holds=_are_words
        ),
        "smoothing_frames": integer(1, 50),
        "refractory_s": POSITIVE,
        "thresholds": TABLE,
        "measured": TABLE.optional,
    },
    "key_words.thresholds": dict.fromkeys(
        THRESHOLDS,
        ValueCheck(
            expected="a number above 0 and up to 1",
            holds=lambda value: is_number(value) and 0 < value <= 1,
        ),
    ),
    "key_words.measured": dict.fromkeys(
        ("missed_ratio", "false_alarms_per_hour", "delay_p95_s"), NUMBER
    ),
    "whisper": {
        "languages": ValueCheck(
            expected='a list of language codes such as "en", none twice', holds=_are_words
        ),
        "context": one_of(*EncoderContext),
        # Manifests of earlier releases have it; it has no meaning any more.
        "hot_words": ValueCheck(expected="true or false", holds=lambda _: True).optional,
        "calibration": TABLE.optional,
    },
    "whisper.calibration": dict.fromkeys(
        ("bias", "log_probability", "no_speech", "compression"), NUMBER
    ),
    "language": {
        "use": one_of(*LanguageUse),
        "most_tokens": COUNT,
        "certainty": TABLE.optional,
    },
    "embedding": {
        "graph": ValueCheck(expected="a file in the model's folder", holds=_is_file_name),
        "output": TEXT,
        "pooling": one_of(*Pooling),
        "dimensions": COUNT,
        "most_tokens": COUNT,
        "least_cosine": RATIO,
    },
    "language.certainty": dict.fromkeys(
        ("bias", "least", "mean", "strange", "read_back_below", "decline_below"), NUMBER
    ),
}
"""What each table holds, by its path."""


def manifest_faults(document: Mapping[str, Any], folder_name: str) -> Iterator[TableFault]:
    """Find every key that is unknown, missing or wrong, then what does not fit together."""
    faults = [*_key_faults(document)]
    yield from faults or _cross_faults(document, folder_name)


def _key_faults(document: Mapping[str, Any]) -> Iterator[TableFault]:
    parts_of = next(
        (name for name in ("whisper", "language", "embedding") if name in document), None
    )
    shape = {**_HEAD, "parts": TABLES, parts_of: TABLE} if parts_of else _GRAPH
    yield from check_record(document, "", shape)
    yield from check_tables(document, _SHAPES)


def _cross_faults(document: Mapping[str, Any], folder_name: str) -> Iterator[TableFault]:
    if document["name"] != folder_name:
        expected = f"{folder_name!r}, as its folder"
        yield TableFault(key="name", got=repr(document["name"]), expected=expected)
    paths = [part["path"] for part in document.get("parts", ())]
    if "whisper" in document:
        needed = [*WHISPER_PARTS]
        needed += [] if any(name in paths for name in VOCABULARIES) else [VOCABULARIES[0]]
        yield from _part_faults(document, paths, "whisper", SPEECH_TO_TEXT, needed)
    elif "language" in document:
        needed = [GENAI_CONFIG, TOKENIZER]
        needed += [] if any(path.endswith(".onnx") for path in paths) else ["an .onnx file"]
        yield from _part_faults(document, paths, "language", PLANNER, needed)
    elif "embedding" in document:
        needed = [TOKENIZER, document["embedding"]["graph"]]
        yield from _part_faults(document, paths, "embedding", TEXT_EMBEDDER, needed)
    else:
        yield from _graph_faults(document)


def _part_faults(
    document: Mapping[str, Any], paths: list[str], table: str, role: str, needed: Sequence[str]
) -> Iterator[TableFault]:
    """Find a role that is not that of the manifest's `[table]`, and parts that are missing."""
    if document["role"] != role:
        yield TableFault(key="role", got=document["role"], expected=f"{role}, for [{table}]")
    for name in needed:
        if name not in paths:
            yield TableFault(key="parts", got=f"{paths}", expected=f"{name} among them")


def _graph_faults(document: Mapping[str, Any]) -> Iterator[TableFault]:
    for group in ("inputs", "outputs", "files"):
        if not document[group]:
            yield TableFault(key=group, got="none", expected="one at least")
    for table, role in (("key_words", KEY_WORDS), ("detection", DETECTOR)):
        if document["role"] == role and table not in document:
            expected = f"a table, as the role is {role}"
            yield TableFault(key=table, got="nothing", expected=expected)
    if "key_words" in document:
        yield from _word_score_faults(document)
    if "detection" in document and document["inputs"]:
        yield from _image_faults(document)
        yield from _score_faults(document["detection"])
        yield from _class_faults(document["detection"])


def _word_score_faults(document: Mapping[str, Any]) -> Iterator[TableFault]:
    """Find a spotter whose scores are not those of its words."""
    wanted = 1 + len(document["key_words"]["words"])
    shapes = [record["shape"] for record in document["outputs"]]
    if len(shapes) != 1 or len(shapes[0]) != 3 or shapes[0][1] != wanted:
        expected = f"one of shape [1, {wanted}, moments], none and each word"
        yield TableFault(key="outputs", got=f"shapes {shapes}", expected=expected)


def _score_faults(detection: Mapping[str, Any]) -> Iterator[TableFault]:
    """Find a weak score that is above the sure one."""
    sure = detection["score_threshold"]
    weak = detection.get("weak_score_threshold", sure)
    if weak > sure:
        expected = f"at most score_threshold, {sure}"
        yield TableFault(key="detection.weak_score_threshold", got=repr(weak), expected=expected)


def _class_faults(detection: Mapping[str, Any]) -> Iterator[TableFault]:
    """Compare the classes that were measured with those that there are."""
    names = [row["name"] for row in detection.get("measured", {}).get("classes", [])]
    if len(set(names)) != len(names) or not set(names) <= set(detection["classes"]):
        expected = f"each once, of {detection['classes']}"
        yield TableFault(key="detection.measured.classes", got=repr(names), expected=expected)


def _image_faults(document: Mapping[str, Any]) -> Iterator[TableFault]:
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
        yield TableFault(key="inputs", got=f"shapes {got}", expected=f"one of shape {wanted}")
    yield from _pixel_faults(image, document["inputs"][0]["dtype"])


def _pixel_faults(image: Mapping[str, Any], dtype: str) -> Iterator[TableFault]:
    """Hold the normalisation against the input's type: integers would cut shares of 255 to 0."""
    if dtype not in PIXEL_DTYPES:
        expected = f"one of {', '.join(PIXEL_DTYPES)}, which hold pixels"
        yield TableFault(key="inputs[0].dtype", got=repr(dtype), expected=expected)
    if dtype.startswith("float"):
        return
    for key, plain in (("scale", 1), ("mean", [0, 0, 0]), ("std", [1, 1, 1])):
        if image[key] != plain:
            expected = f"{plain}, as its input is of {dtype}: pixels as they are"
            yield TableFault(key=f"detection.image.{key}", got=repr(image[key]), expected=expected)
