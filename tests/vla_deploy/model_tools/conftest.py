from pathlib import Path

import cv2
import pytest

from drivers.clock import MonotonicClock
from tests.vla_deploy.tiny_language_models import folders_under
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import ModelStore


@pytest.fixture
def shelf(tmp_path):
    return ModelShelf(
        store=ModelStore(tmp_path / "models", tmp_path / "embedded"),
        engines=tmp_path / "engines",
        clock=MonotonicClock(),
    )


@pytest.fixture
def installed(shelf, lay_out, blob_manifest, blobs):
    """Lay out the blob detector, in fp32; return it as a model."""

    def installed(graph=None, name="blobs"):
        content = (graph or blobs.raw()).SerializeToString()
        lay_out(shelf.store.user, blob_manifest, {Variant.FP32: content})
        return shelf.store.load(name)

    return installed


@pytest.fixture
def photographs(tmp_path, blobs):
    """Write labelled photographs as YOLO has them; return the folder."""

    def photographs(count: int = 6):
        folder = tmp_path / "photos"
        for kind in ("images", "labels"):
            (folder / kind).mkdir(parents=True)
        share = (blobs.width_px, blobs.height_px)
        for seed in range(count):
            rgb, things = blobs.photograph(seed)
            cv2.imwrite(str(folder / "images" / f"{seed}.png"), rgb[..., ::-1])
            rows = [
                f"{number} {x / share[0]} {y / share[1]} "
                f"{blobs.box_px / share[0]} {blobs.box_px / share[1]}"
                for number, x, y in things
            ]
            (folder / "labels" / f"{seed}.txt").write_text("\n".join(rows) + "\n")
        return folder

    return photographs


@pytest.fixture(scope="session")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write small language models of two families; return their folders."""
    return folders_under(tmp_path_factory.mktemp("models"))
