from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import pytest

torch = pytest.importorskip("torch")
from training.detector import training  # noqa: E402
from training.detector.classes import CLASSES  # noqa: E402
from training.detector.dataset import Shard, shard_path  # noqa: E402
from training.detector.network import CentreNet  # noqa: E402
from training.detector.settings import DetectorSettings  # noqa: E402
from training.detector.training import STATE, WEIGHTS, train  # noqa: E402

SETTINGS = DetectorSettings(
    name="test",
    shards=(("train", 3),),
    epochs=3,
    settling_epochs=1,
    piece_px=(64, 96),
    epoch_shards=2,
    batch=4,
    whole_batch=4,
)
IMAGES = 8


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Return a folder with shards of grey images that each show one bright cup."""
    random = np.random.default_rng(5)
    for number in range(3):
        images = random.integers(60, 90, (IMAGES, 224, 320, 3), np.uint8)
        rows = []
        for k, image in enumerate(images):
            x, y = (int(value) for value in random.integers(40, 180, 2))
            image[y : y + 30, x : x + 30] = 230
            rows.append((k, 0, x, y, x + 30, y + 30, 1))
        path = shard_path(tmp_path / "data", "train", number)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            np.savez(file, images=images, labels=np.array(rows, np.float32))
    return tmp_path


def test_every_weight_learns(out: Path) -> None:
    train(out, SETTINGS)

    told, fresh = torch.load(out / STATE, weights_only=True), _fresh()
    moved = {
        name: not torch.equal(value, fresh[name])
        for name, value in told["model"].items()
        if value.dtype.is_floating_point
    }
    assert all(moved.values()), [name for name, did in moved.items() if not did]
    assert told["epoch"] == 4


def test_a_training_that_was_broken_off_ends_as_one_that_was_not(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    train(out, SETTINGS)
    whole = torch.load(out / WEIGHTS, weights_only=True)
    (out / STATE).unlink()
    _break_off_after(2, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        train(out, SETTINGS)
    monkeypatch.undo()

    train(out, SETTINGS)

    again = torch.load(out / WEIGHTS, weights_only=True)
    assert all(torch.equal(whole[name], again[name]) for name in whole)


def _fresh() -> Mapping[str, torch.Tensor]:
    torch.manual_seed(SETTINGS.seed)
    return CentreNet(len(CLASSES)).state_dict()


def _break_off_after(epochs: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Press Ctrl-C while the epoch after these is loaded."""
    load: Final = training.load
    loaded: list[str] = []

    def interrupted(folder: Path, split: str, numbers: Iterable[int]) -> Shard:
        loaded.append(split)
        if len(loaded) > epochs:
            raise KeyboardInterrupt
        return load(folder, split, numbers)

    monkeypatch.setattr(training, "load", interrupted)
