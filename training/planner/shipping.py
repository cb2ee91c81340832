"""Put a trained model into the software, unless the one there is better."""

import json
import logging
import shutil
from pathlib import Path
from typing import Final

from training.planner.files import CARD, MANIFEST, METRICS, NAME, PARTS

SHIPPED: Final = Path(__file__).parents[2] / "vla_deploy" / "models" / NAME
_LOG = logging.getLogger(__name__)


def ship(models: Path, place: Path = SHIPPED) -> bool:
    """Copy the files of a model; return whether it was done.

    Raises:
        FileNotFoundError: the model is not complete.
    """
    new, old = _right(models), _right(place) if (place / METRICS).exists() else 0.0
    if new <= old:
        _LOG.warning("not shipped: %.4f of phrases kept back, %s has %.4f", new, place, old)
        return False
    place.mkdir(parents=True, exist_ok=True)
    for name in (*PARTS, METRICS, CARD, MANIFEST):
        shutil.copyfile(models / name, place / name)
    _LOG.info("shipped to %s: %.4f of phrases kept back, before %.4f", place, new, old)
    return True


def _right(models: Path) -> float:
    metrics = json.loads((models / METRICS).read_text(encoding="utf-8"))
    return float(metrics["sets"]["kept_back_phrases"]["right"])
