import dataclasses
from types import MappingProxyType

import pytest

from platforms import load_profile
from vla_deploy.model_tools.verifying import verify


@pytest.fixture
def profile():
    desktop = load_profile("desktop")

    def profile(**changes):
        choice = dataclasses.replace(desktop.models["detector"], **changes)
        return dataclasses.replace(desktop, models=MappingProxyType({"detector": choice}))

    return profile


def test_a_sound_model_passes_and_the_profile_tells_what_it_gets(shelf, installed, profile):
    installed()
    findings = list(verify(shelf, "blobs", profile()))
    assert [(one.check, one.is_ok) for one in findings] == [
        ("manifest", True),
        ("file fp32", True),
        ("run fp32", True),
        ("profile desktop", True),
    ]
    assert "boxes in empty images: black 0, white 0, grey 0, noise 0" in findings[2].detail
    assert findings[3].detail.startswith(
        "fp32 on CPUExecutionProvider; blobs has no int8_u8s8 file: fp32 runs on CPU"
    )


def test_a_provider_that_the_computer_lacks_fails_the_profile_alone(shelf, installed, profile):
    installed()
    gpu = profile(providers=("CUDAExecutionProvider",), cpu_fallback=False)
    failed = [one for one in verify(shelf, "blobs", gpu) if not one.is_ok]
    assert [one.check for one in failed] == ["profile desktop"]
    assert "blobs: no provider runs it: CUDAExecutionProvider: this" in failed[0].detail


def test_a_spoiled_file_fails_what_needs_it(shelf, installed):
    model = installed()
    (model.folder / "fp32.onnx").write_bytes(b"")
    findings = list(verify(shelf, "blobs"))
    assert [one.check for one in findings if not one.is_ok] == ["file fp32", "run fp32"]
    assert "over 0 bytes; it was cut off or replaced" in findings[1].detail


def test_a_spoiled_manifest_is_all_there_is_to_tell(shelf, installed):
    model = installed()
    (model.folder / "model.toml").write_text("name = 3")
    (only,) = verify(shelf, "blobs")
    assert (only.check, only.is_ok) == ("manifest", False)
    assert "faults" in only.detail
