"""Put a trained model into the software, unless the one there misses fewer stops."""

import json
import logging
import shutil
from pathlib import Path
from typing import Final

SHIPPED: Final = Path(__file__).parents[2] / "vla_deploy" / "models" / "stop_words"
NAMES: Final = ("stop_words.onnx", "metrics.json", "card.md", "model.toml")
_LOG = logging.getLogger(__name__)


def ship(models: Path, place: Path = SHIPPED) -> bool:
    """Copy the files of a model; return whether it was done.

    Raises:
        FileNotFoundError: the model is not complete.
    """
    new, old = _missed(models), _missed(place) if (place / "metrics.json").exists() else 1.0
    if new >= old:
        _LOG.warning("not shipped: it misses %.4f of the stops, that of %s %.4f", new, place, old)
        return False
    place.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        shutil.copyfile(models / name, place / name)
    _LOG.info("shipped to %s: it misses %.4f of the stops, before %.4f", place, new, old)
    return True


def _missed(models: Path) -> float:
    """Return the share of stops missed in noise at 10 dB, at the normal threshold."""
    metrics = json.loads((models / "metrics.json").read_text(encoding="utf-8"))
    return float(metrics["at"]["normal"]["missed_ratio"]["10"]["all"])
