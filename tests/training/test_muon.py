import pytest

torch = pytest.importorskip("torch")
from training.muon import Muon, orthogonalised  # noqa: E402


@pytest.mark.parametrize("shape", [(8, 40), (40, 8), (16, 4, 3, 3), (12, 2, 1, 1)])
def test_all_directions_come_out_about_as_long(shape: tuple[int, ...]) -> None:
    values = torch.randn(shape, generator=torch.Generator().manual_seed(3))

    found = orthogonalised(values)

    lengths = torch.linalg.svdvals(found.flatten(1))
    assert found.shape == values.shape
    assert lengths.min() > 0.5
    assert lengths.max() < 1.3


def test_a_rare_direction_is_learnt_as_fast_as_a_common_one() -> None:
    common, rare = torch.eye(4)[:, :1], torch.eye(4)[:, 1:2]
    wanted = common @ common.T + rare @ rare.T
    weight = torch.nn.Parameter(torch.zeros(4, 4))
    optimiser = Muon([weight], learning_rate=0.02, weight_decay=0.0)
    for _ in range(40):
        optimiser.zero_grad()
        off = weight - wanted
        (1.0 * (off @ common).square().sum() + 0.01 * (off @ rare).square().sum()).backward()
        optimiser.step()

    learnt = (weight @ torch.cat([common, rare], dim=1)).diagonal()[:2]
    assert learnt[1] > 0.7 * learnt[0] > 0.3


def test_zero_gradients_move_nothing() -> None:
    weight = torch.nn.Parameter(torch.ones(3, 5))
    optimiser = Muon([weight], learning_rate=0.1, weight_decay=0.0)
    weight.grad = torch.zeros_like(weight)

    optimiser.step()

    assert torch.equal(weight, torch.ones(3, 5))
