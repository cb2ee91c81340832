"""Training runs from the first step to a folder that the robot loads, and goes on where it was."""

import dataclasses
from pathlib import Path
from random import Random

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from training.planner.export import export  # noqa: E402
from training.planner.files import MEAN_OF, TOKENIZER  # noqa: E402
from training.planner.going_on import NEW_SHARE, mean  # noqa: E402
from training.planner.network import PlanDecoder, deepened  # noqa: E402
from training.planner.sentences.composing import Composer  # noqa: E402
from training.planner.settings import SIZES, NetworkShape  # noqa: E402
from training.planner.training import train  # noqa: E402
from vla_deploy.inference.language_model import LanguageModel  # noqa: E402
from vla_deploy.inference.manifest import Language, LanguageUse  # noqa: E402
from vla_deploy.inference.opening import PLAIN_CHOICE  # noqa: E402


def test_a_short_training_gives_a_model_whose_graph_tells_what_the_network_tells(
    tmp_path: Path,
) -> None:
    settings = dataclasses.replace(SIZES["tiny"], budget_s=1.5)
    network = train(tmp_path, settings)
    export(tmp_path, tmp_path / "model", settings.shape)
    language = Language(use=LanguageUse.COMMAND_PARSER, most_tokens=160)
    model = LanguageModel(tmp_path / "model", language, PLAIN_CHOICE)
    command = Composer().example(Random(2)).command
    prompt = model.tokenizer.encode(
        model.template.prompt([{"role": "user", "content": command}])
    ).ids
    with torch.no_grad():
        wanted = network.scores(network(torch.tensor([prompt])))[0, -1].numpy()
    np.testing.assert_allclose(model.decoder.feed(prompt), wanted, rtol=1e-3, atol=1e-4)
    longer = dataclasses.replace(settings, budget_s=2.0)
    train(tmp_path, longer)
    assert torch.load(tmp_path / "state.pt", weights_only=True)["spent_s"] >= 1.5


def _trained(folder: Path, value: float, tokenizer: str = "{}") -> Path:
    folder.mkdir()
    (folder / TOKENIZER).write_text(tokenizer)
    torch.save({"embedding.weight": torch.full((2, 2), value)}, folder / "weights.pt")
    return folder


def test_the_mean_lies_between_a_training_and_the_one_before_it(tmp_path: Path) -> None:
    new, old, into = (
        _trained(tmp_path / "new", 1.0),
        _trained(tmp_path / "old", 0.0),
        tmp_path / "m",
    )
    mean(new, old, into)
    taken = torch.load(into / "weights.pt", weights_only=True)["embedding.weight"]
    assert torch.allclose(taken, torch.full((2, 2), NEW_SHARE))
    assert "mean of both" in (into / MEAN_OF).read_text()


def test_of_trainings_with_other_tokenizers_there_is_no_mean(tmp_path: Path) -> None:
    new, old = _trained(tmp_path / "new", 1.0), _trained(tmp_path / "old", 0.0, '{"a": 1}')
    with pytest.raises(ValueError, match=TOKENIZER):
        mean(new, old, tmp_path / "m")


def test_a_deeper_network_begins_where_the_finished_one_ended() -> None:
    shallow = PlanDecoder(NetworkShape(width=32, layers=2, heads=2, inner=64))
    shape = NetworkShape(width=32, layers=6, heads=2, inner=64)
    deep = PlanDecoder(shape)
    deep.load_state_dict(deepened(shallow.state_dict(), deep.state_dict()))
    tokens = torch.tensor([[5, 9, 1, 700]])
    assert torch.allclose(deep(tokens), shallow(tokens), atol=1e-5)
    with pytest.raises(ValueError, match="expected a multiple of 4 layers, got 6"):
        deepened(PlanDecoder(NetworkShape(layers=4)).state_dict(), deep.state_dict())
