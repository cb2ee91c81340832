import json
from pathlib import Path

import pytest

from training.detector.files import CARD, FILES, MANIFEST, METRICS
from training.detector.shipping import ship


def model(folder: Path, map50: float) -> Path:
    """Write a model's files, the last of its precisions less accurate."""
    folder.mkdir()
    models = {name: {"map50": map50} for name in FILES} | {"int8_s8s8": {"map50": map50 - 0.01}}
    (folder / METRICS).write_text(json.dumps({"splits": {"heldout": {"models": models}}}))
    for name in (*FILES.values(), CARD, MANIFEST):
        (folder / name).write_text(f"{map50}")
    return folder


def test_the_first_model_is_shipped_whole(tmp_path: Path) -> None:
    new, place = model(tmp_path / "new", 0.5), tmp_path / "shipped"

    assert ship(new, place)
    assert {path.name for path in place.iterdir()} == {path.name for path in new.iterdir()}


@pytest.mark.parametrize("map50", [0.7, 0.8])
def test_a_good_model_is_never_replaced_by_one_that_is_no_better(
    tmp_path: Path, map50: float
) -> None:
    new, place = model(tmp_path / "new", map50), model(tmp_path / "shipped", 0.8)

    assert not ship(new, place)
    assert (place / CARD).read_text() == "0.8"


def test_a_better_model_replaces_the_old_one(tmp_path: Path) -> None:
    new, place = model(tmp_path / "new", 0.9), model(tmp_path / "shipped", 0.8)

    assert ship(new, place)
    assert (place / CARD).read_text() == "0.9"
