import contextlib
import dataclasses
import hashlib
import itertools
import json
import ssl
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from platforms import ModelChoice
from tests.vla_deploy.hub import Hub, served
from tests.vla_deploy.image_inputs import letterboxed
from vla_deploy.inference.manifest import (
    DetectionOutputs,
    EncoderContext,
    Manifest,
    ModelFile,
    Tensor,
    Variant,
    Whisper,
)
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.store import sha256_of

CLASSES = ("red", "green", "blue")
WIDTH_PX, HEIGHT_PX, CELL_PX, BOX_PX = 96, 64, 8, 20
CELLS = (WIDTH_PX // CELL_PX) * (HEIGHT_PX // CELL_PX)
CPU_CHOICE = ModelChoice(
    tiers=("blobs",),
    providers=("CPUExecutionProvider",),
    precision="fp32",
    threads=1,
    cpu_fallback=False,
    memory_arena=True,
)
FLOAT, INT32 = 1, 6  # as onnx.TensorProto numbers them


class BlobGraphs:
    """Build detectors by hand: each cell of 8x8 pixels that is plainly red, green or blue scores.

    Its box is 20 px wide around the cell's middle, so that neighbouring cells tell of one thing.
    """

    width_px, height_px, cell_px, box_px = WIDTH_PX, HEIGHT_PX, CELL_PX, BOX_PX

    def raw(self, *, transposed: bool = False, names: str = "", red_gain: float = 1.0) -> Any:
        """Tell (1, 7, cells): middle, size, a score for each class.

        `red_gain` makes red loud inside and takes it back at once: int8 hears nothing else then.
        """
        gains = np.array([red_gain, 1.0, 1.0], dtype=np.float32).reshape(3, 1, 1, 1)
        constants = self._constants()
        loud = {"contrast": constants["contrast"] * gains, "mean": constants["mean"] / gains}
        nodes = [*self._network(), self._node("Concat", ["boxes", "scores"], "table", axis=1)]
        if transposed:
            nodes.append(self._node("Transpose", ["table"], "output", perm=[0, 2, 1]))
            return self._model(nodes, {"output": [1, CELLS, 7]}, names, loud)
        nodes.append(self._node("Identity", ["table"], "output"))
        return self._model(nodes, {"output": [1, 7, CELLS]}, names, loud)

    def end_to_end(self, count: int = 12) -> Any:
        """Tell (1, count, 6): corners, score, class of the surest cells, as YOLO v10 does."""
        nodes = [
            *self._network(),
            self._node("ReduceMax", ["scores"], "best", axes=[1], keepdims=0),
            self._node("ArgMax", ["scores"], "which", axis=1, keepdims=0),
            self._node("TopK", ["best", "count"], ("top", "at")),
            self._node("GatherElements", ["which", "at"], "class_number", axis=1),
            self._node("Cast", ["class_number"], "class_float", to=FLOAT),
            self._node("Squeeze", ["at", "zero"], "at_flat"),
            self._node("Transpose", ["corners"], "corner_rows", perm=[0, 2, 1]),
            self._node("Gather", ["corner_rows", "at_flat"], "top_corners", axis=1),
            self._node("Unsqueeze", ["top", "two"], "top_column"),
            self._node("Unsqueeze", ["class_float", "two"], "class_column"),
            self._node("Concat", ["top_corners", "top_column", "class_column"], "output", axis=2),
        ]
        constants = {
            "count": np.array([count]),
            "zero": np.array([0]),
            "two": np.array([2]),
            "corners": self._corners(),
        }
        return self._model(nodes, {"output": [1, count, 6]}, constants=constants)

    def counted(self, count: int = 10, iou: float = 0.3) -> Any:
        """Tell count, boxes, scores, classes; ONNX's own NonMaxSuppression removes doubles.

        What lies behind the count is a box that was left over: a red one in cell 13.
        """
        nodes = [
            *self._network(),
            self._node("Transpose", ["corners"], "rows", perm=[0, 2, 1]),
            self._node("NonMaxSuppression", ["rows", "scores", "most", "iou", "least"], "chosen"),
            self._node("Shape", ["chosen"], "chosen_shape"),
            self._node("Slice", ["chosen_shape", "zero", "one"], "found"),
            self._node("Cast", ["found"], "found_small", to=INT32),
            self._node("Reshape", ["found_small", "square"], "num"),
            self._node("Sub", ["room", "found"], "missing"),
            self._node("Concat", ["missing", "one"], "repeats", axis=0),
            self._node("Tile", ["left_over", "repeats"], "filling"),
            self._node("Concat", ["chosen", "filling"], "padded", axis=0),
            self._node("Slice", ["padded", "one", "two", "one"], "class_column"),
            self._node("Slice", ["padded", "two", "three", "one"], "cell_column"),
            self._node("Squeeze", ["cell_column", "one"], "cells"),
            self._node("Gather", ["rows", "cells"], "det_boxes", axis=1),
            self._node("Concat", ["class_column", "cell_column"], "class_and_cell", axis=1),
            self._node("Squeeze", ["scores", "zero"], "score_table"),
            self._node("GatherND", ["score_table", "class_and_cell"], "flat_scores"),
            self._node("Unsqueeze", ["flat_scores", "zero"], "det_scores"),
            self._node("Cast", ["class_column"], "class_small", to=INT32),
            self._node("Transpose", ["class_small"], "det_classes", perm=[1, 0]),
        ]
        constants = {
            "corners": self._corners(),
            "most": np.array([count]),
            "iou": np.array([iou], dtype=np.float32),
            "least": np.array([0.2], dtype=np.float32),
            "room": np.array([count]),
            "square": np.array([1, 1]),
            "left_over": np.array([[0, 0, 13]]),
            **{name: np.array([n]) for n, name in enumerate(("zero", "one", "two", "three"))},
        }
        outputs = {
            "num": [1, 1],
            "det_boxes": [1, count, 4],
            "det_scores": [1, count],
            "det_classes": [1, count],
        }
        dtypes = {"num": INT32, "det_classes": INT32}
        return self._model(nodes, outputs, constants=constants, dtypes=dtypes)

    def score_table(self, rgb: np.ndarray) -> np.ndarray:
        """Return what each cell scores (classes, cells), by loops instead of a network."""
        table = []
        for own, others in ((0, (1, 2)), (1, (0, 2)), (2, (0, 1))):
            pixels = rgb.astype(np.float64) / 255.0
            plain = pixels[..., own] - pixels[..., others[0]] - pixels[..., others[1]]
            plain = np.maximum(plain, 0.0)
            corners = itertools.product(range(0, HEIGHT_PX, CELL_PX), range(0, WIDTH_PX, CELL_PX))
            table.append([plain[y : y + CELL_PX, x : x + CELL_PX].mean() for y, x in corners])
        return np.array(table)

    def photograph(self, seed: int) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
        """Return a noisy grey image with coloured cells, and class, middle x, middle y of each."""
        random = np.random.default_rng(seed)
        rgb = random.integers(80, 100, (HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)
        places = [(x, y) for x in range(1, 11, 3) for y in range(1, 7, 3)]
        things = []
        for number, place in enumerate(random.permutation(len(places))[:3]):
            x, y = (CELL_PX * one for one in places[place])
            rgb[y : y + CELL_PX, x : x + CELL_PX] = 0
            rgb[y : y + CELL_PX, x : x + CELL_PX, number] = random.integers(180, 256)
            things.append((number, x + CELL_PX // 2, y + CELL_PX // 2))
        return rgb, things

    def _network(self) -> list[Any]:
        return [
            self._node("Conv", ["images", "contrast"], "plain"),
            self._node("Relu", ["plain"], "lit"),
            self._node("Conv", ["lit", "mean"], "pooled", group=3, strides=[CELL_PX] * 2),
            self._node("Conv", ["pooled", "same"], "head"),
            self._node("Clip", ["head", "low", "high"], "clipped"),
            self._node("Reshape", ["clipped", "flat"], "scores"),
        ]

    def _constants(self) -> dict[str, np.ndarray]:
        eye = np.eye(3, dtype=np.float32)
        return {
            "contrast": (2 * eye - 1).reshape(3, 3, 1, 1),
            "mean": np.full((3, 1, CELL_PX, CELL_PX), 1 / CELL_PX**2, dtype=np.float32),
            "same": eye.reshape(3, 3, 1, 1),
            "low": np.array(0, dtype=np.float32),
            "high": np.array(1, dtype=np.float32),
            "flat": np.array([1, 3, CELLS]),
            "boxes": self._boxes(),
        }

    def _boxes(self) -> np.ndarray:
        across = WIDTH_PX // CELL_PX
        cells = np.arange(CELLS)
        middles = [(cells % across + 0.5) * CELL_PX, (cells // across + 0.5) * CELL_PX]
        sizes = [np.full(CELLS, BOX_PX)] * 2
        return np.array([*middles, *sizes], dtype=np.float32)[None]

    def _corners(self) -> np.ndarray:
        boxes = self._boxes()
        return np.concatenate([boxes[:, :2] - BOX_PX / 2, boxes[:, :2] + BOX_PX / 2], axis=1)

    def _node(
        self, kind: str, inputs: list[str], outputs: str | tuple[str, ...], **attributes: Any
    ) -> Any:
        from onnx import helper  # most tests do without it

        listed = [outputs] if isinstance(outputs, str) else list(outputs)
        return helper.make_node(kind, inputs, listed, name=f"{kind}_{listed[0]}", **attributes)

    def _model(
        self,
        nodes: list[Any],
        outputs: Mapping[str, list[int]],
        names: str = "",
        constants: Mapping[str, np.ndarray] | None = None,
        dtypes: Mapping[str, int] | None = None,
    ) -> Any:
        from onnx import checker, helper, numpy_helper

        used = {name for node in nodes for name in node.input}
        held = {**self._constants(), **(constants or {})}
        image = helper.make_tensor_value_info("images", FLOAT, [1, 3, HEIGHT_PX, WIDTH_PX])
        told = [
            helper.make_tensor_value_info(name, (dtypes or {}).get(name, FLOAT), shape)
            for name, shape in outputs.items()
        ]
        weights = [
            numpy_helper.from_array(value, name) for name, value in held.items() if name in used
        ]
        graph = helper.make_graph(nodes, "blobs", [image], told, weights)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
        model.ir_version = 9
        if names:
            helper.set_model_props(model, {"names": names})
        checker.check_model(model)
        return model


@pytest.fixture(scope="session")
def blobs() -> BlobGraphs:
    return BlobGraphs()


@pytest.fixture(scope="session")
def cpu_choice() -> Callable[..., ModelChoice]:
    """Return the choice to run on the CPU, with some values replaced."""

    def choice(**changes: Any) -> ModelChoice:
        return dataclasses.replace(CPU_CHOICE, **changes)

    return choice


@pytest.fixture(scope="session")
def blob_manifest() -> Manifest:
    """Describe the raw blob detector; its files are empty yet."""
    detection = DetectionOutputs(
        adapter="yolo",
        classes=CLASSES,
        score_threshold=0.25,
        iou_threshold=0.3,
        image=letterboxed(WIDTH_PX, HEIGHT_PX),
    )
    return Manifest(
        name="blobs",
        role="detector",
        summary="coloured blobs",
        licence="Apache-2.0",
        card="",
        inputs=(Tensor(name="images", shape=(1, 3, HEIGHT_PX, WIDTH_PX), dtype="float32"),),
        outputs=(Tensor(name="output", shape=(1, 7, CELLS), dtype="float32"),),
        files={},
        detection=detection,
    )


@pytest.fixture(scope="session")
def lay_out() -> Callable[[Path, Manifest, Mapping[Variant, bytes]], Path]:
    """Write a model's folder, its manifest naming what the files hold."""

    def write(root: Path, manifest: Manifest, contents: Mapping[Variant, bytes]) -> Path:
        folder = root / manifest.name
        folder.mkdir(parents=True)
        files = {}
        for variant, content in contents.items():
            (folder / f"{variant}.onnx").write_bytes(content)
            digest = hashlib.sha256(content).hexdigest()
            files[variant] = ModelFile(path=f"{variant}.onnx", sha256=digest)
        write_manifest(folder, dataclasses.replace(manifest, files=files))
        return folder

    return write


Answer = Callable[[BaseHTTPRequestHandler], None]


@dataclass
class Heard:
    """One request as the server got it."""

    method: str
    path: str
    headers: Mapping[str, str]
    body: dict[str, Any] | None


@dataclass
class LoopbackServer:
    """A real HTTP server on loopback that answers by a script, the last answer for ever."""

    server: ThreadingHTTPServer
    answers: deque[Answer] = field(default_factory=deque)
    heard: list[Heard] = field(default_factory=list)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server.server_port}"

    def secure(self, certificate: Path, key: Path) -> None:
        """Speak TLS from now on."""
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate, key)
        self.server.socket = context.wrap_socket(self.server.socket, server_side=True)

    def then(self, *answers: Answer) -> None:
        self.answers.extend(answers)

    @staticmethod
    def sends(status: int, content: bytes | object, **headers: str) -> Answer:
        """Answer with bytes, or with JSON; `_` in a header's name stands for `-`."""
        body = content if isinstance(content, bytes) else json.dumps(content).encode()

        def answer(handler: BaseHTTPRequestHandler) -> None:
            handler.send_response(status)
            handler.send_header("Content-Length", str(len(body)))
            for name, value in headers.items():
                handler.send_header(name.replace("_", "-"), value)
            handler.end_headers()
            handler.wfile.write(body)

        return answer

    @staticmethod
    def raw(*pieces: bytes, pause_s: float = 0.0) -> Answer:
        """Answer with bytes that need not be HTTP, piece by piece, then hang up."""

        def answer(handler: BaseHTTPRequestHandler) -> None:
            for piece in pieces:
                handler.wfile.write(piece)
                handler.wfile.flush()
                time.sleep(pause_s)  # the slowness is what the test is about

        return answer

    @classmethod
    def says(cls, text: str | None, finish: str = "stop", **message: Any) -> Answer:
        """Answer as an OpenAI-compatible server whose model says `text`."""
        said = {"role": "assistant", "content": text, **message}
        usage = {"prompt_tokens": 11, "completion_tokens": 7}
        reply = {"choices": [{"message": said, "finish_reason": finish}], "usage": usage}
        return cls.sends(200, reply)


@pytest.fixture
def loopback() -> Iterator[LoopbackServer]:
    played: LoopbackServer

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            length = int(self.headers.get("Content-Length", 0))
            body = json.loads(self.rfile.read(length)) if length else None
            heard = Heard(self.command, self.path, dict(self.headers), body)
            played.heard.append(heard)
            answer = played.answers.popleft() if len(played.answers) > 1 else played.answers[0]
            self.close_connection = True
            # The client may have seen enough, which is what some tests are about.
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                answer(self)

        do_GET = do_POST  # noqa: N815 - http.server's name

        def log_message(self, *args: Any) -> None:
            """Say nothing on the terminal."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    played = LoopbackServer(server)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    yield played
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def open_hub(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Hub]]:
    """Return what serves a folder's files as a repository, in a folder `under` its root."""
    import huggingface_hub.constants

    monkeypatch.setattr(huggingface_hub.constants, "HF_HUB_OFFLINE", False)
    with contextlib.ExitStack() as stack:

        def open_hub(folder: Path, under: str = "") -> Hub:
            hub = Hub(folder, under)
            hub.url = stack.enter_context(served(hub))
            return hub

        yield open_hub


@dataclass(frozen=True, slots=True)
class ScriptedWhisper:
    """Make models of the Whisper family that always say one text, as surely as they are told."""

    folder: Path

    def write(self, name: str, text: str, sureness: float = 30.0) -> Path:
        """Write a model's files, without a manifest: weights that say a text by its positions."""
        folder = self.folder / name
        folder.mkdir(parents=True)
        tokenizer = _tokenizer(text)
        tokenizer.save(str(folder / "tokenizer.json"))
        end = tokenizer.token_to_id("<|endoftext|>")
        spec = _quiet_spec(tokenizer.get_vocab_size(), width=128)
        said = [*tokenizer.encode(" " + text).ids, end]
        weight = spec.decoder.projection.weight
        weight[end, 2 * len(said) :: 2] = sureness
        for position, token in enumerate(said, start=1):  # after <|startoftranscript|>
            weight[token, 2 * position] = sureness
        spec.config.suppress_ids, spec.config.suppress_ids_begin = [], [end]
        spec.config.lang_ids, spec.config.alignment_heads = [], [[0, 0]]
        vocabulary = sorted(tokenizer.get_vocab().items(), key=lambda one: one[1])
        spec.register_vocabulary([token for token, _ in vocabulary])
        spec.validate()
        spec.optimize(quantization="int8")
        spec.save(str(folder))
        return folder

    def model(self, name: str, text: str, sureness: float = 30.0, **declared: Any) -> Path:
        """Write a model with a manifest that says how it is read."""
        folder = self.write(name, text, sureness)
        paths = sorted(path.name for path in folder.iterdir())
        whisper: dict[str, Any] = {"context": EncoderContext.TRIMMED, **declared}
        manifest = Manifest(
            name=name,
            role="speech_to_text",
            summary="says one text",
            licence="Apache-2.0",
            card="",
            parts=tuple(ModelFile(path=path, sha256=sha256_of(folder / path)) for path in paths),
            whisper=Whisper(languages=("en",), **whisper),
        )
        write_manifest(folder, manifest)
        return folder


def _tokenizer(text: str) -> Any:
    """A byte-level vocabulary in Whisper's order: text, then its special tokens, times last."""
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers

    tokenizer = Tokenizer(models.BPE())
    tokenizer.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    tokenizer.decoder = decoders.ByteLevel()
    trainer = trainers.BpeTrainer(
        vocab_size=320,
        initial_alphabet=pre_tokenizers.ByteLevel.alphabet(),
        show_progress=False,
    )
    tokenizer.train_from_iterator(5 * [" " + text], trainer)
    words = ("endoftext", "startoftranscript", "en", "fr", "translate", "transcribe", "startoflm")
    tokenizer.add_special_tokens(
        [f"<|{word}|>" for word in (*words, "startofprev", "nospeech", "notimestamps")]
        + [f"<|{0.02 * number:.2f}|>" for number in range(1501)]
    )
    return tokenizer


def _quiet_spec(vocabulary: int, width: int) -> Any:
    """Weights of which none says anything but the position: one layer each, all zeros.

    Positions take every other column: without VNNI, int8 kernels add the products of two that lie
    side by side in 16 bits, which two full ones overflow.
    """
    from ctranslate2.specs import WhisperSpec

    def zeros(*shape: int) -> Any:
        return np.zeros(shape, np.float32)

    spec = WhisperSpec(1, 1, 1, 1)
    encoder, decoder = spec.encoder, spec.decoder
    encoder.conv1.weight, encoder.conv1.bias = zeros(width, 80, 3), zeros(width)
    encoder.conv2.weight, encoder.conv2.bias = zeros(width, width, 3), zeros(width)
    encoder.position_encodings.encodings = zeros(1500, width)
    decoder.embeddings.weight = zeros(vocabulary, width)
    columns = np.minimum(2 * np.arange(448), width - 2)
    decoder.position_encodings.encodings = np.eye(width, dtype=np.float32)[columns]
    decoder.projection.weight = zeros(vocabulary, width)
    layers = (*encoder.layer, *decoder.layer)
    for linear in [one for layer in layers for one in _linears(layer)]:
        linear[0].weight, linear[0].bias = zeros(linear[1] * width, width), zeros(linear[1] * width)
    norms = [encoder.layer_norm, decoder.layer_norm]
    norms += [part.layer_norm for layer in layers for part in _parts(layer)]
    for norm in norms:
        norm.gamma, norm.beta = np.ones(width, np.float32), zeros(width)
    return spec


def _parts(layer: Any) -> list[Any]:
    attention = [layer.attention] if hasattr(layer, "attention") else []
    return [layer.self_attention, *attention, layer.ffn]


def _linears(layer: Any) -> list[tuple[Any, int]]:
    """The linear maps of a layer, each with the rows that it has for one of its columns."""
    own, ffn = layer.self_attention.linear, layer.ffn
    found = [(own[0], 3), (own[1], 1), (ffn.linear_0, 1), (ffn.linear_1, 1)]
    if hasattr(layer, "attention"):
        query, memory, out = layer.attention.linear
        found += [(query, 1), (memory, 2), (out, 1)]
    return found


@pytest.fixture
def scripted_whisper(tmp_path: Path) -> ScriptedWhisper:
    pytest.importorskip("ctranslate2")
    return ScriptedWhisper(tmp_path / "models")
