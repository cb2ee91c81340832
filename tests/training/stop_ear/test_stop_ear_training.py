"""What the head learns is what the robot reads; each state is asked for what it can know."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from training.speech.framing import IGNORED  # noqa: E402
from training.speech.shipping import SHIPPED  # noqa: E402
from training.stop_head.batches import _targets  # noqa: E402
from training.stop_head.export import ship  # noqa: E402
from training.stop_head.network import StopHead  # noqa: E402
from training.stop_head.training import WEIGHTS  # noqa: E402
from vla_deploy.inference.manifest_file import read_manifest  # noqa: E402
from vla_deploy.inference.store import Model  # noqa: E402
from vla_deploy.speech.stop_head import FILE, SETTLING, open_stop_head  # noqa: E402

WIDTH = 256


def test_the_robot_reads_what_was_learnt(tmp_path: Path) -> None:
    torch.manual_seed(0)
    head = StopHead(WIDTH).eval()
    torch.save(head.state_dict(), tmp_path / WEIGHTS)
    (tmp_path / "commands-whisper").mkdir()
    manifest = SHIPPED / "model.toml"
    (tmp_path / "commands-whisper" / "model.toml").write_text(manifest.read_text())
    for _ in range(2):
        ship(tmp_path, tmp_path / "commands-whisper")
    entered = read_manifest(tmp_path / "commands-whisper")
    assert [part.path for part in entered.parts].count(FILE) == 1
    folder = tmp_path / "commands-whisper"
    read = open_stop_head(Model(manifest=entered, folder=folder, is_embedded=False))
    assert read is not None
    states = torch.randn(1, 50, WIDTH)
    chances = head(states).softmax(2)[0, :, 1:].detach().numpy()
    runs = np.lib.stride_tricks.sliding_window_view(chances, SETTLING, axis=0)
    assert read.surety(states[0].numpy()) == pytest.approx(runs.mean(axis=2).max(), abs=1e-5)


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
