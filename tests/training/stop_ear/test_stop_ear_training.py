"""What the ear learns is what the robot runs; each state is asked for what it can know."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
ort = pytest.importorskip("onnxruntime")

from training.speech.framing import IGNORED  # noqa: E402
from training.speech.network import MELS, Encoder  # noqa: E402
from training.speech.shipping import SHIPPED  # noqa: E402
from training.stop_ear.batches import Corpus, _targets  # noqa: E402
from training.stop_ear.export import export, ship  # noqa: E402
from training.stop_ear.network import SIZE, StopEar  # noqa: E402
from training.stop_ear.shipped import PLACES, shipped_weights  # noqa: E402
from training.stop_ear.training import WEIGHTS, encoder_of, mean  # noqa: E402
from training.stop_words.corpus import Said, _write  # noqa: E402
from vla_deploy.inference.manifest_file import read_manifest  # noqa: E402
from vla_deploy.inference.store import Model  # noqa: E402
from vla_deploy.speech.stop_ear import FILE, SETTLING, open_stop_ear  # noqa: E402


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # torch's own exporter
def test_the_robot_runs_what_was_learnt(tmp_path: Path) -> None:
    torch.manual_seed(0)
    ear = StopEar(Encoder(SIZE)).eval()
    torch.save(ear.state_dict(), tmp_path / WEIGHTS)
    folder = tmp_path / "commands-whisper"
    folder.mkdir()
    (folder / "model.toml").write_text((SHIPPED / "model.toml").read_text())
    for _ in range(2):
        ship([tmp_path], folder)
    entered = read_manifest(folder)
    assert [part.path for part in entered.parts].count(FILE) == 1
    assert {one.name for one in folder.iterdir()} == {"model.toml", FILE}
    run = open_stop_ear(Model(manifest=entered, folder=folder, is_embedded=False))
    assert run is not None
    frames = torch.randn(1, MELS, 90)
    chances = ear(frames).softmax(2)[0, :, 1:].detach().numpy()
    runs = np.lib.stride_tricks.sliding_window_view(chances, SETTLING, axis=0)
    # The weights have eight bits.
    assert run.surety(frames[0].numpy()) == pytest.approx(runs.mean(axis=2).max(), abs=0.03)


def test_a_training_goes_on_from_what_was_shipped() -> None:
    ear = StopEar(encoder_of(SHIPPED)).eval()
    frames, told = torch.randn(1, MELS, 90), []
    for weights in shipped_weights(SHIPPED / FILE):
        assert set(ear.state_dict()) - set(weights) == {PLACES}
        ear.load_state_dict(ear.state_dict() | weights)
        told.append(ear(frames).softmax(2).detach().numpy())
    run = ort.InferenceSession(str(SHIPPED / FILE)).run(None, {"frames": frames.numpy()})[0]
    assert np.mean(told, axis=0) == pytest.approx(run, abs=0.03)
    assert np.abs(told[0] - told[1]).max() > 0.0


def test_of_ears_that_are_shipped_as_one_the_mean_is_told(tmp_path: Path) -> None:
    ears = [StopEar(encoder_of(SHIPPED)).eval() for _ in range(2)]
    with pytest.warns(DeprecationWarning):
        export(ears, tmp_path / FILE)
    frames = torch.randn(1, MELS, 90)
    run = ort.InferenceSession(str(tmp_path / FILE)).run(None, {"frames": frames.numpy()})[0]
    told = [ear(frames).softmax(2).detach().numpy() for ear in ears]
    assert np.mean(told, axis=0) == pytest.approx(run, abs=0.03)
    assert len(shipped_weights(tmp_path / FILE)) == 2


def test_the_mean_of_two_trainings_is_half_of_each(tmp_path: Path) -> None:
    for name, value in (("one", 1.0), ("two", 3.0)):
        (tmp_path / name).mkdir()
        torch.save({"w": torch.full((2, 2), value)}, tmp_path / name / WEIGHTS)
    mean(tmp_path / "one", tmp_path / "two", tmp_path / "both")
    assert torch.load(tmp_path / "both" / WEIGHTS)["w"].tolist() == [[2.0, 2.0], [2.0, 2.0]]
    torch.save({"w": torch.zeros(3)}, tmp_path / "two" / WEIGHTS)
    with pytest.raises(ValueError, match="one shape"):
        mean(tmp_path / "one", tmp_path / "two", tmp_path / "both")


def test_it_begins_as_the_recogniser_that_is_shipped() -> None:
    encoder = encoder_of(SHIPPED)
    assert float(encoder.layer_norm.weight.detach().std()) > 0.0


@pytest.fixture
def corpus(tmp_path: Path) -> Iterator[Corpus]:
    random = np.random.default_rng(0)
    for kind, events in (("stops", [[1, 0.2, 0.5]]), ("others", [])):
        clips = [
            Said(
                samples=(8000 * random.standard_normal(12_000)).astype(np.int16),
                voice="espeak/en",
                events=np.array(events, np.float32).reshape(-1, 3),
                phones=np.zeros((0, 2), np.float32),
            )
            for _ in range(6)
        ]
        _write(tmp_path / f"train-{kind}-espeak.npy", clips)
    yield Corpus(tmp_path, None, random)


def test_a_clip_that_was_taken_for_something_else_comes_again(corpus: Corpus) -> None:
    first = [number for batch in corpus.batches() for number in batch.numbers]
    assert sorted(first) == list(range(12))
    corpus.remember([3, 7])
    second = [number for batch in corpus.batches() for number in batch.numbers]
    assert sorted(second) == sorted([*range(12), 3, 7])


def test_a_batch_asks_for_words_only_where_one_was_said(corpus: Corpus) -> None:
    for batch in corpus.batches():
        for number, targets in zip(batch.numbers, batch.targets, strict=True):
            assert bool((targets > 0).any()) is (number < 6)


def test_a_state_is_to_tell_a_word_once_half_of_it_was_said_and_a_moment_longer() -> None:
    event = np.array([[2, 1.0, 1.4]], np.float32)
    targets = _targets(event, 60, 0.04)
    times_s = (np.arange(60) + 0.5) * 0.04
    assert set(targets[(times_s > 1.21) & (times_s < 1.47)]) == {2}
    assert set(targets[(times_s > 1.0) & (times_s < 1.19)]) == {IGNORED}
    assert set(targets[(times_s > 1.5) & (times_s < 1.59)]) == {IGNORED}
    assert not targets[(times_s < 0.89) | (times_s > 1.61)].any()


def test_without_a_word_every_state_is_to_tell_none() -> None:
    assert not _targets(np.zeros((0, 3), np.float32), 20, 0.04).any()
