import dataclasses

import pytest

from vla_deploy.inference.manifest import ModelFile, Variant
from vla_deploy.inference.providers import candidates, provider_list, variant_for

CPU, CUDA, TENSORRT = (f"{name}ExecutionProvider" for name in ("CPU", "CUDA", "Tensorrt"))


@pytest.fixture
def whole(blob_manifest):
    files = {variant: ModelFile(path=f"{variant}.onnx", sha256="0" * 64) for variant in Variant}
    return dataclasses.replace(blob_manifest, files=files)


@pytest.mark.parametrize(
    ("precision", "provider", "variant"),
    [
        ("int8", CPU, Variant.INT8_U8S8),
        ("int8", TENSORRT, Variant.INT8_S8S8),
        ("int8", CUDA, Variant.FP32),
        ("fp16", CUDA, Variant.FP16),
        ("fp16", TENSORRT, Variant.FP32),
        ("fp16", CPU, Variant.FP32),
        ("fp32", TENSORRT, Variant.FP32),
    ],
)
def test_each_provider_gets_the_file_it_is_fast_with(whole, precision, provider, variant):
    assert variant_for(whole, precision, provider) == (variant, "")


def test_a_model_that_was_never_fp32_gives_what_it_has(whole):
    only = {Variant.INT8_U8S8: whole.files[Variant.INT8_U8S8]}
    model = dataclasses.replace(whole, files=only)
    assert variant_for(model, "fp32", CUDA) == (
        Variant.INT8_U8S8,
        f"blobs has no fp32 file: int8_u8s8 runs on {CUDA}",
    )


def test_the_cpu_is_tried_last_where_it_is_allowed_unlisted(cpu_choice):
    assert candidates(cpu_choice(providers=(TENSORRT, CUDA), cpu_fallback=True))[-1] == CPU
    assert CPU not in candidates(cpu_choice(providers=(TENSORRT, CUDA)))
    assert candidates(cpu_choice(providers=(CPU, CUDA), cpu_fallback=True)) == (CPU, CUDA)


def test_tensorrt_keeps_engines_and_timings_and_leaves_the_rest_to_cuda(cpu_choice, tmp_path):
    choice = cpu_choice(providers=(TENSORRT, CUDA), precision="int8")
    (first, options), (second, none) = provider_list(
        TENSORRT, choice, (TENSORRT, CUDA, CPU), tmp_path
    )
    assert (first, second, none) == (TENSORRT, CUDA, {})
    assert options == {
        "trt_engine_cache_enable": "1",
        "trt_engine_cache_path": str(tmp_path),
        "trt_timing_cache_enable": "1",
        "trt_timing_cache_path": str(tmp_path),
        "trt_int8_enable": "1",
        "trt_fp16_enable": "1",
    }


@pytest.mark.parametrize(("precision", "reduced"), [("fp16", {"trt_fp16_enable"}), ("fp32", set())])
def test_tensorrt_computes_in_nothing_smaller_than_asked(cpu_choice, tmp_path, precision, reduced):
    choice = cpu_choice(providers=(TENSORRT,), precision=precision)
    ((_, options),) = provider_list(TENSORRT, choice, (TENSORRT, CUDA, CPU), tmp_path)
    assert {key for key in options if key.endswith(("fp16_enable", "int8_enable"))} == reduced
