import copy

import pytest

torch = pytest.importorskip("torch", reason="pip install '.[train]'")

from farm_ar.agents.training.object_policy import ADAM_SHARE, MuonAdam  # noqa: E402


@pytest.fixture
def network():
    torch.manual_seed(0)
    return torch.nn.Sequential(torch.nn.Linear(16, 24), torch.nn.ReLU(), torch.nn.Linear(24, 1))


def descend(network, optimizer, steps):
    inputs = torch.linspace(-1, 1, 16 * 64).view(64, 16).sin()
    losses = []
    for _ in range(steps):
        optimizer.zero_grad()
        loss = (network(inputs).squeeze(-1) - inputs[:, 3] ** 2).square().mean()
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    return losses


def change(network, earlier):
    return [(p - q).detach() for p, q in zip(network.parameters(), earlier, strict=True)]


def test_a_step_is_as_large_in_every_direction_of_a_matrix():
    rng = torch.Generator().manual_seed(0)
    one, other = (torch.linalg.qr(torch.randn(16, 16, generator=rng))[0] for _ in range(2))
    weight = torch.nn.Parameter(torch.zeros(16, 16))
    weight.grad = one @ torch.diag(torch.logspace(-2, 0, 16)) @ other
    MuonAdam([weight], lr=0.01).step()
    length = torch.linalg.svdvals(weight.detach()) / 0.01
    assert length.min() > 0.5
    assert length.max() < 1.5


def test_what_is_no_matrix_or_a_small_one_goes_as_adam_has_it(network):
    before = [p.clone() for p in network.parameters()]
    descend(network, MuonAdam(network.parameters(), lr=0.01), 1)
    _, *others = change(network, before)
    for part in others:
        assert part.abs().max().item() == pytest.approx(0.01 * ADAM_SHARE, rel=0.02)


def test_it_learns_and_heeds_the_rate_that_it_has_now(network):
    optimizer = MuonAdam(network.parameters(), lr=0.01)
    losses = descend(network, optimizer, 100)
    assert losses[-1] < 0.1 * losses[0]
    optimizer.param_groups[0]["lr"] = 0.0
    before = [p.clone() for p in network.parameters()]
    descend(network, optimizer, 3)
    assert all(not part.any() for part in change(network, before))


def test_what_was_saved_goes_on_as_if_nothing_had_been(network):
    optimizer = MuonAdam(network.parameters(), lr=0.01)
    descend(network, optimizer, 5)
    again = copy.deepcopy(network)
    other = MuonAdam(again.parameters(), lr=0.5)
    other.load_state_dict(copy.deepcopy(optimizer.state_dict()))
    third, same = copy.deepcopy((network, optimizer))
    losses = descend(network, optimizer, 5)
    assert losses == descend(again, other, 5) == descend(third, same, 5)


def test_the_state_of_another_optimizer_is_refused(network):
    adam = torch.optim.Adam(network.parameters())
    with pytest.raises(ValueError, match="must be that of a MuonAdam"):
        MuonAdam(network.parameters(), lr=0.01).load_state_dict(adam.state_dict())


@pytest.mark.parametrize("sides", [(3, 4), (16, 16)])
def test_it_makes_do_with_small_matrices_only_or_large_ones_only(sides):
    weight = torch.nn.Parameter(torch.ones(sides))
    optimizer = MuonAdam([weight], lr=0.01)
    weight.square().sum().backward()
    optimizer.step()
    assert torch.all(weight < 1)
