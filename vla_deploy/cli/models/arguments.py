"""Declare the arguments of `vla-deploy models`, and read those that several kinds share."""

import argparse
import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from platforms import ModelChoice, Profile
from vla_deploy.cli.commands import (
    Run,
    add_command,
    add_top_command,
    number_within,
    whole_number,
)
from vla_deploy.inference.manifest import Fit, Pooling
from vla_deploy.inference.manifest_schema import COLOURS
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.published import LANGUAGE_MODELS, TEXT_EMBEDDERS, WHISPERS
from vla_deploy.model_tools.text_embedders import LEAST_COSINE
from vla_deploy.perception.detectors.adapters import ADAPTERS

EXAMPLES: Final = """  vla-deploy models list
  vla-deploy models add mugs --onnx best.onnx --classes classes.txt
  vla-deploy models quantise mugs --images photos --labelled validation
  vla-deploy models calibrate mugs --labelled validation
  vla-deploy models bench mugs
  vla-deploy models fetch whisper-small.en
  vla-deploy models fetch llama-3.2-1b-gpu
  vla-deploy models verify
"""
_SIZE: Final = re.compile(r"([1-9]\d{0,4})x([1-9]\d{0,4})")
Result = tuple[object, str]
"""What an act prints: a JSON document, and a text for a person."""


def register_acts(commands: Any, runs: Mapping[str, Run]) -> None:
    """Add the command; `runs` has the function of each act."""
    models = add_top_command(commands, "models", EXAMPLES)
    acts = models.add_subparsers(dest="act", required=True, metavar="ACT")
    add_command(acts, "list", "list the models, and who uses them", "  vla-deploy models list\n")
    show = add_command(acts, "show", "show what a model is", "  vla-deploy models show detector\n")
    remove = add_command(
        acts, "remove", "delete a model that was added", "  vla-deploy models remove mugs\n"
    )
    for act in (show, remove):
        act.add_argument("name", help="of the model")
    _add(acts)
    _fetch(acts)
    _calibrate(acts)
    _bench(acts)
    _quantise(acts)
    _verify(acts)
    for name, act in acts.choices.items():
        act.add_argument("--json", action="store_true", help="print JSON")
        act.set_defaults(run=runs[name])


def _add(acts: Any) -> None:
    add = add_command(
        acts,
        "add",
        "add a detector, a Whisper, a language model or a text embedder of your own, after a trial",
        "  vla-deploy models add mugs --onnx best.onnx --classes classes.txt\n"
        "  vla-deploy models add mugs --onnx best.onnx --adapter yolo_end_to_end --licence MIT\n"
        "  vla-deploy models add mine --whisper whisper-mine-ct2 --languages en\n"
        "  vla-deploy models add qwen --language qwen2.5-1.5b-int4 --licence Apache-2.0\n"
        "  vla-deploy models add minilm --embedder all-MiniLM-L6-v2-onnx --licence Apache-2.0\n",
    )
    add.add_argument("name", help="to call it by; profiles name it as a tier")
    kind = add.add_mutually_exclusive_group(required=True)
    kind.add_argument("--onnx", type=Path, metavar="FILE", help="a detector, in fp32")
    kind.add_argument(
        "--whisper", type=Path, metavar="DIR", help="a Whisper, as CTranslate2 converts it"
    )
    kind.add_argument(
        "--language",
        type=Path,
        metavar="DIR",
        help="a language model in the layout of onnxruntime-genai",
    )
    kind.add_argument(
        "--embedder",
        type=Path,
        metavar="DIR",
        help="a text embedder: tokenizer.json and one .onnx file; the memory is searched by it",
    )
    _most_tokens(add)
    _profile(add)
    _add_embedder_arguments(add)
    _add_whisper_arguments(add)
    add.add_argument(
        "--classes",
        type=Path,
        metavar="FILE",
        help="a name in each line, in the order of the numbers (default: as the export names them)",
    )
    listed = "; ".join(f"{name}: {one.summary}" for name, one in ADAPTERS.items())
    add.add_argument(
        "--adapter",
        choices=[*ADAPTERS],
        help=f"how its outputs are read (default: as they fit): {listed}",
    )
    add.add_argument("--size", type=_size, metavar="WxH", help="of the input, where it is free")
    add.add_argument("--score", type=float, default=0.25, help="least score (default: 0.25)")
    add.add_argument("--iou", type=float, default=0.45, help="overlap of doubles (default: 0.45)")
    _add_image_arguments(add)
    add.add_argument("--summary", help="what it is")
    add.add_argument("--licence", default="not stated", help="the licence of its weights")
    add.add_argument("--card", type=Path, metavar="FILE", help="a model card to keep with it")
    add.add_argument("--replace", action="store_true", help="replace one of that name")


def _most_tokens(act: argparse.ArgumentParser) -> None:
    act.add_argument(
        "--most-tokens",
        type=whole_number(),
        default=512,
        help="of one answer of a language model (default: 512)",
    )


def _add_embedder_arguments(add: argparse.ArgumentParser) -> None:
    add.add_argument(
        "--pooling",
        choices=[Pooling.MEAN.value, Pooling.FIRST.value],
        default=Pooling.MEAN.value,
        help="of a text embedder: of all tokens, or the first one's vector (default: mean)",
    )
    add.add_argument(
        "--least-cosine",
        type=number_within(0.0, 1.0, "a cosine from 0 to 1"),
        default=LEAST_COSINE,
        help=f"below which a text embedder finds two texts unlike (default: {LEAST_COSINE:g})",
    )


def _add_whisper_arguments(add: argparse.ArgumentParser) -> None:
    add.add_argument(
        "--languages", default="en", metavar="CODES", help="that may be understood (default: en)"
    )
    add.add_argument(
        "--trimmed",
        action="store_true",
        help="its weights were trained on sound without the padding to 30 s",
    )


def _add_image_arguments(add: argparse.ArgumentParser) -> None:
    add.add_argument("--colour", choices=COLOURS, default="rgb", help="order (default: rgb)")
    add.add_argument(
        "--fit", choices=[*Fit], default=Fit.LETTERBOX, help="to its size (default: letterbox)"
    )
    add.add_argument("--fill", type=int, default=114, help="grey of the padding (default: 114)")
    add.add_argument(
        "--scale",
        type=float,
        help="factor for pixels (default: 1/255, or 1 where the input is of integers)",
    )
    add.add_argument(
        "--mean", type=float, nargs=3, default=[0.0, 0.0, 0.0], help="subtracted after the factor"
    )
    add.add_argument("--std", type=float, nargs=3, default=[1.0, 1.0, 1.0], help="divided by last")


def _bench(acts: Any) -> None:
    bench = add_command(
        acts,
        "bench",
        "compare the files of a detector, or measure a Whisper on sounds",
        "  vla-deploy models bench detector\n"
        "  vla-deploy models bench mugs --images photos --profile jetson_orin_nx --json\n",
    )
    bench.add_argument("name", help="of the model")
    bench.add_argument("--images", type=Path, metavar="DIR", help="to run on (default: noise)")
    bench.add_argument(
        "--sounds", type=Path, metavar="DIR", help="WAV files to read (default: noise)"
    )
    bench.add_argument(
        "--rounds", type=whole_number(), default=60, help="frames of each (default: 60)"
    )
    _profile(bench)
    bench.add_argument("--threads", type=whole_number(), help="(default: as the profile says)")


def _fetch(acts: Any) -> None:
    fetch = add_command(
        acts,
        "fetch",
        "fetch a published Whisper, language model or text embedder from the Hugging Face hub, "
        "checked by its hashes",
        "  vla-deploy models fetch whisper-small.en\n"
        "  vla-deploy models fetch llama-3.2-1b-gpu\n"
        "  vla-deploy models fetch minilm-l6\n"
        "  vla-deploy models fetch --language OWNER/REPO:FOLDER --as mine\n",
    )
    fetch.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        choices=[*WHISPERS, *LANGUAGE_MODELS, *TEXT_EMBEDDERS],
        help=f"Whispers: {', '.join(WHISPERS)}; language models: {', '.join(LANGUAGE_MODELS)}; "
        f"text embedders: {', '.join(TEXT_EMBEDDERS)}",
    )
    fetch.add_argument(
        "--language",
        metavar="OWNER/REPO[:FOLDER]",
        help="a language model of any repository, in the layout of onnxruntime-genai",
    )
    fetch.add_argument("--as", dest="new_name", metavar="NAME", help="call it by another name")
    fetch.add_argument("--revision", help="branch, tag or commit (default: main)")
    fetch.add_argument("--licence", help="of its weights (default: as the hub states it)")
    _most_tokens(fetch)
    fetch.add_argument("--endpoint", metavar="URL", help="a mirror of the hub")
    _profile(fetch)
    fetch.add_argument("--replace", action="store_true", help="replace one of that name")


def _calibrate(acts: Any) -> None:
    calibrate = add_command(
        acts,
        "calibrate",
        "measure how reliable an added detector or Whisper is",
        "  vla-deploy models calibrate mugs --labelled validation\n"
        "  vla-deploy models calibrate whisper-small.en --sounds recordings\n",
    )
    calibrate.add_argument("name", help="of the model")
    known = calibrate.add_mutually_exclusive_group(required=True)
    known.add_argument(
        "--labelled",
        type=Path,
        metavar="PATH",
        help="for a detector: a folder with YOLO text files, or a COCO file, none of it trained on",
    )
    known.add_argument(
        "--sounds",
        type=Path,
        metavar="DIR",
        help="WAV files, each with its words in a .txt file, which is empty for other sound",
    )
    _profile(calibrate)


def _quantise(acts: Any) -> None:
    quantise = add_command(
        acts,
        "quantise",
        "make the int8 files with your images, and keep them if it still sees as well",
        "  vla-deploy models quantise mugs --images photos --labelled validation\n"
        "  vla-deploy models quantise mugs --images photos --labelled coco.json --max-drop 0.5\n",
    )
    quantise.add_argument("name", help="of the model")
    quantise.add_argument(
        "--images",
        type=Path,
        required=True,
        metavar="DIR",
        help="to calibrate with, as the robot sees them; a hundred do",
    )
    quantise.add_argument(
        "--labelled",
        type=Path,
        required=True,
        metavar="PATH",
        help="to measure with: a folder with YOLO text files, or a COCO file",
    )
    quantise.add_argument(
        "--max-drop",
        type=number_within(0.0, 100.0, "points from 0 to 100"),
        default=1.0,
        metavar="POINTS",
        help="of mAP50 (default: 1.0)",
    )
    quantise.add_argument("--as", dest="new_name", help="install it under another name")
    quantise.add_argument(
        "--limit", type=whole_number(), default=200, help="images to calibrate with (default: 200)"
    )


def _verify(acts: Any) -> None:
    verify = add_command(
        acts,
        "verify",
        "check files, graphs and a trial run, and what a profile makes of a model",
        "  vla-deploy models verify\n"
        "  vla-deploy models verify mugs --profile jetson_orin_nx     builds TensorRT's engine\n",
    )
    verify.add_argument("names", nargs="*", help="of models (default: all)")
    _profile(verify)


def _profile(act: argparse.ArgumentParser) -> None:
    act.add_argument("--profile", help="name or path (default: the one of the next start)")


def _size(text: str) -> tuple[int, int]:
    match = _SIZE.fullmatch(text)
    if match is None:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, such as 640x480, got {text!r}")
    return int(match[1]), int(match[2])


def choice_of(
    arguments: argparse.Namespace, model: StoredModel, profile: Profile, otherwise: ModelChoice
) -> ModelChoice:
    """Return the profile's choice for the model's role, with the threads that are asked for."""
    choice = profile.models.get(model.manifest.role, otherwise)
    threads = arguments.threads
    return dataclasses.replace(choice, threads=threads) if threads else choice
