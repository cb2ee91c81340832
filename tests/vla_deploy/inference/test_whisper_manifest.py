"""A Whisper declares its parts and how to read it; the files on disk are what was checked in."""

import hashlib
from pathlib import Path

import pytest

from vla_deploy.inference.errors import ManifestInvalid, ModelFileSpoiled
from vla_deploy.inference.file_check import check_parts
from vla_deploy.inference.manifest import Calibration, EncoderContext, Manifest, ModelFile, Whisper
from vla_deploy.inference.manifest_file import read_manifest, write_manifest
from vla_deploy.inference.store import StoredModel

PARTS = ("model.bin", "config.json", "vocabulary.json", "tokenizer.json")


def manifest_of(paths: tuple[str, ...] = PARTS, role: str = "speech_to_text") -> Manifest:
    return Manifest(
        name="ours",
        role=role,
        summary="commands, by synthetic voices",
        licence="Apache-2.0",
        card="card.md",
        parts=tuple(
            ModelFile(path=path, sha256=hashlib.sha256(path.encode()).hexdigest()) for path in paths
        ),
        whisper=Whisper(
            languages=("en",),
            context=EncoderContext.TRIMMED,
            calibration=Calibration(bias=3, log_probability=4.5, no_speech=-3, compression=-2),
        ),
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "ours"
    folder.mkdir()
    for path in PARTS:
        (folder / path).write_text(path)
    write_manifest(folder, manifest_of())
    return folder


def test_what_is_written_is_read_back(folder: Path) -> None:
    assert read_manifest(folder) == manifest_of()


def test_all_faults_of_a_whisper_are_listed(folder: Path) -> None:
    file = folder / "model.toml"
    text = file.read_text()
    text = text.replace('["en"]', '["EN"]').replace("trimmed", "short").replace("bias", "bios")
    file.write_text(text)
    with pytest.raises(ManifestInvalid) as caught:
        read_manifest(folder)
    faults = "\n".join(caught.value.faults)
    for key in ("whisper.languages", "whisper.context", "whisper.calibration.bios"):
        assert key in faults
    assert "expected one of padded, trimmed" in faults


@pytest.mark.parametrize("missing", PARTS)
def test_a_part_that_the_recogniser_needs_must_be_declared(folder: Path, missing: str) -> None:
    left = tuple(path for path in PARTS if path != missing)
    write_manifest(folder, manifest_of(left))
    with pytest.raises(ManifestInvalid, match=f"expected {missing} among them"):
        read_manifest(folder)


def test_a_whisper_plays_no_other_role(folder: Path) -> None:
    write_manifest(folder, manifest_of(role="detector"))
    with pytest.raises(ManifestInvalid, match=r"role: got detector, expected speech_to_text"):
        read_manifest(folder)


def test_a_half_written_part_is_found(folder: Path) -> None:
    model = StoredModel(manifest=manifest_of(), folder=folder, is_embedded=False)
    check_parts(model)
    (folder / "model.bin").write_text("model.b")
    with pytest.raises(ModelFileSpoiled, match=r"model\.bin.*add the model again"):
        check_parts(model)
    (folder / "model.bin").unlink()
    with pytest.raises(ModelFileSpoiled, match=r"model\.bin: No such file"):
        check_parts(model)
