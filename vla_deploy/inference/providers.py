"""Decide what runs a model: which providers in which order, with which file and options."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from platforms import ModelChoice
from vla_deploy.inference.manifest import Manifest, Variant

CPU: Final = "CPUExecutionProvider"
CUDA: Final = "CUDAExecutionProvider"
TENSORRT: Final = "TensorrtExecutionProvider"

# What is fast where; anything else takes the original. On x86, signed int8 is slower than that.
_VARIANTS: Final[Mapping[tuple[str, str], Variant]] = {
    ("int8", CPU): Variant.INT8_U8S8,
    ("int8", TENSORRT): Variant.INT8_S8S8,
    ("fp16", CUDA): Variant.FP16,
}
# TensorRT may compute in these what the file does not say in int8.
_REDUCED: Final[Mapping[str, Mapping[str, str]]] = {
    "int8": {"trt_int8_enable": "1", "trt_fp16_enable": "1"},
    "fp16": {"trt_fp16_enable": "1"},
}
Options = dict[str, str]


def candidates(choice: ModelChoice) -> tuple[str, ...]:
    """Return the providers to try in order; the CPU comes last where it is allowed unlisted."""
    last_resort = (CPU,) if choice.cpu_fallback and CPU not in choice.providers else ()
    return (*choice.providers, *last_resort)


def variant_for(manifest: Manifest, precision: str, provider: str) -> tuple[Variant, str]:
    """Return which file to load, and a note when it is not the one that was meant.

    A model without fp32 gives the first file that it has.
    """
    meant = _VARIANTS.get((precision, provider), Variant.FP32)
    if meant in manifest.files:
        return meant, ""
    taken = Variant.FP32 if Variant.FP32 in manifest.files else next(iter(manifest.files))
    return taken, f"{manifest.name} has no {meant} file: {taken} runs on {provider}"


def provider_list(
    provider: str, choice: ModelChoice, available: tuple[str, ...], engines: Path
) -> list[tuple[str, Options]]:
    """Return what to ask onnxruntime for: the provider, and CUDA for what TensorRT leaves.

    `engines` is where TensorRT keeps what takes it minutes to build.
    """
    asked: list[tuple[str, Options]] = [(provider, _options(provider, choice, engines))]
    if provider == TENSORRT and CUDA in choice.providers and CUDA in available:
        asked.append((CUDA, {}))
    return asked


def _options(provider: str, choice: ModelChoice, engines: Path) -> Options:
    if provider != TENSORRT:
        return {}
    return {
        "trt_engine_cache_enable": "1",
        "trt_engine_cache_path": str(engines),
        "trt_timing_cache_enable": "1",
        "trt_timing_cache_path": str(engines),
        **_REDUCED.get(choice.precision, {}),
    }
