import json
from pathlib import Path

import pytest

from training.detector.card import describe, manifest, tables, verdict
from training.detector.classes import CLASSES
from training.detector.files import CARD, FILES, MANIFEST, METRICS
from training.detector.settings import FULL

SHIPPED = Path(__file__).parents[3] / "vla_deploy" / "models" / "detector"


def test_the_shipped_card_shows_the_shipped_figures() -> None:
    metrics = json.loads((SHIPPED / METRICS).read_text())

    assert tables(metrics) in (SHIPPED / CARD).read_text()


def test_the_shipped_manifest_holds_the_digests_of_the_shipped_files() -> None:
    assert (SHIPPED / MANIFEST).read_text() == manifest(SHIPPED)


@pytest.mark.parametrize("split", ["heldout", "flat"])
def test_the_shipped_figures_cover_every_class_and_file(split: str) -> None:
    models = json.loads((SHIPPED / METRICS).read_text())["splits"][split]["models"]

    assert set(models) == set(FILES)
    assert all(set(figures["classes"]) == set(CLASSES) for figures in models.values())


def test_card_and_manifest_are_written_beside_the_files(tmp_path: Path) -> None:
    for name in (*FILES.values(), METRICS):
        (tmp_path / name).write_bytes((SHIPPED / name).read_bytes())

    describe(tmp_path, FULL)

    assert "**Real photographs.**" in (tmp_path / CARD).read_text()
    assert (tmp_path / MANIFEST).read_text() == (SHIPPED / MANIFEST).read_text()


@pytest.mark.parametrize(
    ("map50", "recall", "told"),
    [(0.9, 0.93, "It reaches"), (0.89, 0.95, "does not reach"), (0.95, 0.92, "does not reach")],
)
def test_the_card_begins_with_whether_the_aim_is_reached(
    map50: float, recall: float, told: str
) -> None:
    models = {"fp32": {"map50": map50, "recall": recall, "sure_recall": 0.8}}

    assert told in verdict({"splits": {"heldout": {"models": models}}})
