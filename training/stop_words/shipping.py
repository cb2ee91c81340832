"""Put a trained model into the software, unless the one there misses fewer stops."""

import json
import logging
import shutil
from pathlib import Path
from typing import Final

from training.stop_words.corpus import HELD
from training.stop_words.evaluation import METRICS, chosen, heard_by
from training.stop_words.export import FILE
from training.stop_words.settings import StopWordSettings

SHIPPED: Final = Path(__file__).parents[2] / "vla_deploy" / "models" / "stop_words"
NAMES: Final = (FILE, METRICS, "card.md", "model.toml")
_LOG = logging.getLogger(__name__)


def ship(out: Path, models: Path, settings: StopWordSettings, place: Path = SHIPPED) -> bool:
    """Copy the files of a model; return whether it was done.

    The one that is there hears the clips that chose the new one's thresholds, and gets those that
    would serve it best: what either would miss at as many false alarms is compared.

    Raises:
        FileNotFoundError: the model is not complete.
    """
    new = json.loads((models / METRICS).read_text(encoding="utf-8"))["at"]["low"]["missed_mean"]
    old = 1.0
    if (place / FILE).exists():
        old = chosen(heard_by(place / FILE, out, HELD, settings))["at"]["low"]["missed_mean"]
    if new >= old:
        _LOG.warning("not shipped: it misses %.4f of the stops, that of %s %.4f", new, place, old)
        return False
    place.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        shutil.copyfile(models / name, place / name)
    _LOG.info("shipped to %s: it misses %.4f of the stops, before %.4f", place, new, old)
    return True
