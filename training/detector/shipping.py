"""Put a trained model into the software, unless the one there is better."""

import json
import logging
import shutil
from pathlib import Path

from training.detector.files import CARD, FILES, MANIFEST, METRICS

SHIPPED = Path(__file__).parents[2] / "vla_deploy" / "models" / "detector"
SPLIT = "heldout"
_LOG = logging.getLogger(__name__)


def ship(models: Path, place: Path = SHIPPED) -> bool:
    """Copy the files of a model; return whether it was done.

    Raises:
        FileNotFoundError: the model is not complete.
    """
    new, old = _accuracy(models), _accuracy(place) if (place / METRICS).exists() else 0.0
    if new <= old:
        _LOG.warning("not shipped: mAP50 is %.4f, that of %s is %.4f", new, place, old)
        return False
    place.mkdir(parents=True, exist_ok=True)
    for name in (*FILES.values(), METRICS, CARD, MANIFEST):
        shutil.copyfile(models / name, place / name)
    _LOG.info("shipped to %s: mAP50 %.4f, before %.4f", place, new, old)
    return True


def _accuracy(models: Path) -> float:
    """Return the least mAP50 of the three files."""
    metrics = json.loads((models / METRICS).read_text(encoding="utf-8"))
    judged = metrics["splits"][SPLIT]["models"]
    return min(float(judged[name]["map50"]) for name in FILES)
