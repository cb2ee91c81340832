"""Declare what a model is: its files, its tensors, and how its outputs are to be read."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

# A dimension is a size, or a name for one that is free.
Dimension = int | str


class Variant(StrEnum):
    """Name the files a model may have: activations, then weights, of the two int8 ones.

    CPUs are fast with unsigned activations, TensorRT takes only symmetric signed ones.
    """

    FP32 = "fp32"
    FP16 = "fp16"
    INT8_U8S8 = "int8_u8s8"
    INT8_S8S8 = "int8_s8s8"


class TensorLayout(StrEnum):
    """Name the order of an image tensor's dimensions."""

    NCHW = "nchw"
    NHWC = "nhwc"


class Fit(StrEnum):
    """Say how an image is brought to the size of the input.

    `letterbox` keeps its proportions and pads, centred; `stretch` does not.
    """

    LETTERBOX = "letterbox"
    STRETCH = "stretch"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tensor:
    """Declare an input or output of the graph; `dtype` is numpy's name."""

    name: str
    shape: tuple[Dimension, ...]
    dtype: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFile:
    """Name a file in the model's folder and what it must hold."""

    path: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageInput:
    """Declare how an image becomes the input: (pixel * `scale` - `mean`) / `std` per channel."""

    width_px: int
    height_px: int
    layout: TensorLayout
    colour: str
    fit: Fit
    fill: int
    scale: float
    mean: tuple[float, float, float]
    std: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassMeasured:
    """Declare how good a detector was at one class: of so many boxes, and of so many things."""

    name: str
    precision: float
    recall: float
    boxes: int
    things: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Declare how good a detector was on images that it had not seen, at its own threshold.

    `precision` is the share of its `boxes` that were right, `recall` that of the `things` it found;
    the counts are None where they were not written down. Where `classes` are given, each class has
    its own figures, and one that is missing was not measured.
    """

    precision: float
    recall: float
    boxes: int | None = None
    things: int | None = None
    classes: tuple[ClassMeasured, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionOutputs:
    """Declare how a detector's outputs are read; `adapter` names the reader.

    Boxes of one class that overlap by more than `iou_threshold` count as one thing. Boxes below
    `score_threshold`, from `weak_score_threshold` on if there is one, only help to name what other
    senses show. `measured` is None where it was not measured.
    """

    adapter: str
    classes: tuple[str, ...]
    score_threshold: float
    iou_threshold: float
    image: ImageInput
    weak_score_threshold: float | None = None
    measured: Measured | None = None

    @property
    def least_score(self) -> float:
        """Return the score below which no box is read."""
        weak = self.weak_score_threshold
        return self.score_threshold if weak is None else weak


class EncoderContext(StrEnum):
    """Say how much sound a Whisper's encoder takes.

    Stock weights know only windows of 30 s, `padded` with silence; `trimmed` ones were trained on
    what is there and a little silence, which costs a hundredth for a short command.
    """

    PADDED = "padded"
    TRIMMED = "trimmed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """Declare how sure a model's words are: the weights of a logistic function.

    Of the mean log-probability of a token, of the probability of no speech, and of by how much
    the text's compression ratio exceeds 2: such a text repeats itself.
    """

    bias: float
    log_probability: float
    no_speech: float
    compression: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Whisper:
    """Declare a model of the Whisper family in CTranslate2's form.

    `languages` are those that may be understood; `calibration` is None where it was not
    measured.
    """

    languages: tuple[str, ...]
    context: EncoderContext
    calibration: Calibration | None = None


class LanguageUse(StrEnum):
    """Say what a language model is asked: anything in words, or plain commands alone."""

    CHAT = "chat"
    COMMAND_PARSER = "command_parser"


@dataclass(frozen=True, slots=True, kw_only=True)
class Certainty:
    """Declare how sure a command parser's answers are: the weights of a logistic function.

    Of the log-probability of the least sure token, of their mean, and of the number of words that
    the model was never shown; `read_back_below` and `decline_below` are the bounds to act by.
    """

    bias: float
    least: float
    mean: float
    strange: float
    read_back_below: float
    decline_below: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Language:
    """Declare a language model in the layout of onnxruntime-genai.

    An answer has `most_tokens` at most. `certainty` is None where it was not measured.
    """

    use: LanguageUse
    most_tokens: int
    certainty: Certainty | None = None


class Pooling(StrEnum):
    """Say how an encoder's values for tokens become one for the text; `none` if they are one."""

    MEAN = "mean"
    FIRST = "first"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class Embedding:
    """Declare a text embedder: its graph, which output is read, and how.

    Texts whose vectors have a cosine below `least_cosine` count as having nothing in common.
    """

    graph: str
    output: str
    pooling: Pooling
    dimensions: int
    most_tokens: int
    least_cosine: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SpottingMeasured:
    """Declare how good a spotter was at its normal threshold, on voices that it had not learnt.

    `missed_ratio` is of words in noise at 10 dB; `delay_p95_s` is from a word's end.
    """

    missed_ratio: float
    false_alarms_per_hour: float
    delay_p95_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyWords:
    """Declare how a key word spotter's scores are read; `features` names what it is given.

    Its output has the score of no word, then of each of `words`, for each moment. The mean score of
    a word over `smoothing_frames` moments is held against one of `thresholds`: a name for each.
    For `refractory_s` after a word, no other is reported. `measured` is None where it was not
    measured.
    """

    features: str
    words: tuple[str, ...]
    smoothing_frames: int
    refractory_s: float
    thresholds: Mapping[str, float]
    measured: SpottingMeasured | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """Declare one model; `card` where there is one.

    A graph has tensors and `files`, one for each variant, detectors a `detection` too, spotters
    `key_words`; a Whisper, a language model and a text embedder have `parts`, which are all needed,
    and `whisper`, `language` or `embedding`.
    """

    name: str
    role: str
    summary: str
    licence: str
    card: str = ""
    inputs: tuple[Tensor, ...] = ()
    outputs: tuple[Tensor, ...] = ()
    files: Mapping[Variant, ModelFile] = field(default_factory=dict)
    detection: DetectionOutputs | None = None
    key_words: KeyWords | None = None
    parts: tuple[ModelFile, ...] = ()
    whisper: Whisper | None = None
    language: Language | None = None
    embedding: Embedding | None = None
