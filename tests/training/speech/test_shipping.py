import json
from pathlib import Path

from training.speech.card import AIMS, METRICS, verdict, went_on
from training.speech.shipping import MODEL, ship

_NAMES = ("held_out_voices", "held_out_voices_10db", "unseen_engine", "unseen_engine_10db")


def _trained(out: Path, errors: float | None) -> Path:
    folder = out / MODEL
    folder.mkdir(parents=True)
    metrics = {f"wer_{name}": errors for name in _NAMES}
    (folder / METRICS).write_text(json.dumps(metrics))
    (folder / "model.bin").write_bytes(str(errors).encode())
    return out


def test_only_a_better_recogniser_replaces_the_one_that_is_there(tmp_path: Path) -> None:
    place = tmp_path / "shipped"
    assert ship(_trained(tmp_path / "first", 0.2), place)
    assert not ship(_trained(tmp_path / "worse", 0.3), place)
    assert not ship(_trained(tmp_path / "equal", 0.2), place)
    assert (place / "model.bin").read_bytes() == b"0.2"
    assert ship(_trained(tmp_path / "better", 0.1), place)
    assert (place / "model.bin").read_bytes() == b"0.1"


def test_a_card_says_in_its_first_words_what_falls_short() -> None:
    good = dict(AIMS)
    assert verdict(good).startswith("It reaches its aims")
    assert verdict(good | {"wer_unseen_engine": 0.11}).startswith("**It does not reach its aims")
    assert "not measured" in verdict(good | {"wer_unseen_engine": None})


def test_a_card_tells_what_the_training_began_with() -> None:
    assert "at random" in went_on(0.0)
    assert "793 h" in went_on(793 * 3600.0)
    assert "mean" in went_on(793 * 3600.0, is_mean=True)
