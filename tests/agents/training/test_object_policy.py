"""The policy that points at objects: numbering them otherwise changes nothing but the numbers."""

import itertools

import numpy as np
import pytest
import torch
from gymnasium.spaces import MultiDiscrete
from hypothesis import given, settings
from hypothesis import strategies as st
from sb3_contrib import MaskablePPO

from farm_ar.agents.training.object_policy import MuonAdam, ObjectPolicy
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}


def policy_for(env, seed=0, **size):
    """A policy with weights large enough to have opinions."""
    torch.manual_seed(seed)
    policy = ObjectPolicy(env.observation_space, env.action_space, lambda _: 1e-3, **size)
    with torch.no_grad():
        for weights in policy.parameters():
            weights.normal_(0, 0.3)
    return policy


@pytest.mark.parametrize("choices", [[11, 5, 5], [11, 25], [11, 7, 7], [3, 5, 3], [11, 7, 7, 7, 7]])
def test_a_space_of_another_action_is_refused(choices):
    env = FarmToTableEnv(**QUICK)
    with pytest.raises(OptionError, match="plays slot and displacement"):
        ObjectPolicy(env.observation_space, MultiDiscrete(choices), lambda _: 1e-3)


def batch(*observations):
    return {key: torch.as_tensor(np.stack([o[key] for o in observations])) for key in observations[0]}


def in_another_order(env, order):
    """What the environment would show, had the agent met the objects in another order."""
    env._order, env._movable = order, order[env.world.truth.movable[order]]
    env._view = None
    env._features.meet(env.world.truth, order)
    return env.observe(), env.action_masks()


@settings(max_examples=10 * settings().max_examples // 50)
@given(st.sampled_from(["displacement", "slot"]), st.integers(0, 99), st.randoms(use_true_random=False))
def test_objects_numbered_otherwise_are_treated_the_same(action, seed, random):
    env = FarmToTableEnv(action=action, **QUICK)
    env.reset(seed=seed)
    env.action_space.seed(seed)
    policy = policy_for(env, seed)
    before, masks = env.observe(), env.action_masks()
    old = env.view.order
    code = env.world.truth.category_code[old]
    kinds = [list(old[code == kind]) for kind in dict.fromkeys(code.tolist())]
    for same in kinds:
        random.shuffle(same)
    order = np.array(list(itertools.chain(*kinds)))
    after, other_masks = in_another_order(env, order)
    choice = env.action_space.sample()
    moved = choice.copy()
    if choice[0] < 10:
        moved[0] = int(np.flatnonzero(order == old[choice[0]])[0])
        if action == "slot":
            mates = old[code == code[choice[0]]]
            now = [i for i in order if i in mates]
            choice[1] %= len(mates)
            moved[1] = now.index(mates[choice[1]])
    with torch.no_grad():
        value, log_probability, entropy = policy.evaluate_actions(
            batch(before), torch.tensor(choice)[None], masks
        )
        again = policy.evaluate_actions(batch(after), torch.tensor(moved)[None], other_masks)
    assert torch.allclose(value, again[0], atol=1e-4)
    assert torch.allclose(log_probability, again[1], atol=1e-3)
    assert torch.allclose(entropy, again[2], atol=1e-3)


@pytest.mark.parametrize("action", ["slot", "displacement"])
@pytest.mark.parametrize("knowledge", ["white-box", "black-box"])
def test_the_probabilities_of_all_actions_sum_to_one(action, knowledge):
    env = FarmToTableEnv(action=action, knowledge=knowledge, **QUICK)
    env.reset(seed=3)
    policy = policy_for(env)
    first, *others = env.action_space.nvec.tolist()
    taken = itertools.product(range(first - 1), *map(range, others))
    actions = np.array([*taken, [first - 1] + [0] * len(others)])
    distribution = policy.get_distribution(batch(*[env.observe()] * len(actions)), None)
    with torch.no_grad():
        total = distribution.log_prob(torch.as_tensor(actions)).exp().sum()
    assert float(total) == pytest.approx(1.0, abs=1e-4)


def test_the_entropy_is_the_mean_of_what_draws_say_of_themselves():
    """With slots nothing is hidden, so that the entropy of the whole action is exact on the average."""
    env = FarmToTableEnv(action="slot", **QUICK)
    env.reset(seed=3)
    policy = policy_for(env, width=16, pair_width=8, rounds=1)
    many = batch(*[env.observe()] * 4000)
    with torch.no_grad():
        torch.manual_seed(0)
        actions, _, log_probability = policy(many)
        _, again, entropy = policy.evaluate_actions(many, actions)
    assert torch.allclose(log_probability, again, atol=1e-5)
    assert float(entropy.mean()) == pytest.approx(float(-log_probability.mean()), abs=0.06)


def test_the_mixture_is_drawn_as_its_probabilities_say():
    env = FarmToTableEnv(action="displacement", **QUICK)
    env.reset(seed=5)
    policy = policy_for(env, width=16, pair_width=8, rounds=1)
    many = batch(*[env.observe()] * 10000)
    with torch.no_grad():
        torch.manual_seed(0)
        actions = policy.get_distribution(many, None).get_actions().numpy()
        found, counts = np.unique(actions, axis=0, return_counts=True)
        some = found[np.argsort(-counts)[:10]]
        said = (
            policy.get_distribution(batch(*[env.observe()] * 10), None).log_prob(torch.as_tensor(some)).exp()
        )
    assert np.allclose(np.sort(counts)[::-1][:10] / 10000, said.numpy(), atol=0.02)


@pytest.mark.parametrize("action", ["slot", "displacement"])
@pytest.mark.parametrize("deterministic", [True, False])
def test_only_what_is_in_view_is_taken(action, deterministic):
    env = FarmToTableEnv(action=action, **QUICK)
    policy = policy_for(env)
    for seed in range(10):
        observation, _ = env.reset(seed=seed)
        masks = env.action_masks()
        choice, _ = policy.predict(observation, action_masks=masks, deterministic=deterministic)
        assert masks[choice[0]]
        assert env.action_space.contains(choice)


def test_it_learns_with_maskable_ppo_and_can_be_saved(tmp_path):
    env = FarmToTableEnv(**QUICK)
    model = MaskablePPO(ObjectPolicy, env, n_steps=16, batch_size=16, n_epochs=1, seed=0, device="cpu")
    before = [weights.clone() for weights in model.policy.parameters()]
    model.learn(16)
    assert any(not torch.equal(a, b) for a, b in zip(before, model.policy.parameters(), strict=True))
    model.save(tmp_path / "model.zip")
    again = MaskablePPO.load(tmp_path / "model.zip")
    observation, _ = env.reset(seed=0)
    first, _ = model.predict(observation, action_masks=env.action_masks(), deterministic=True)
    second, _ = again.predict(observation, action_masks=env.action_masks(), deterministic=True)
    assert np.array_equal(first, second)


def test_all_of_the_network_learns():
    env = FarmToTableEnv(action="displacement", **QUICK)
    env.reset(seed=1)
    policy = policy_for(env)
    value, log_probability, entropy = policy.evaluate_actions(
        batch(env.observe()), torch.tensor([[2, 1, 5, 0]]), env.action_masks()
    )
    (value.sum() + log_probability.sum() + entropy.sum()).backward()
    without = [name for name, weights in policy.named_parameters() if weights.grad is None]
    assert without == []


def test_it_learns_with_muon_unless_adam_is_asked_for():
    env = FarmToTableEnv(**QUICK)
    assert isinstance(policy_for(env).optimizer, MuonAdam)
    policy = policy_for(env, optimizer="adam", optimizer_kwargs={"weight_decay": 0.5})
    earlier = policy.optimizer
    policy.renew_optimizer(0.1)
    assert policy.optimizer is not earlier
    assert isinstance(policy.optimizer, torch.optim.Adam)
    assert policy.optimizer.defaults["lr"] == 0.1
    assert policy.optimizer.defaults["weight_decay"] == 0.5
    with pytest.raises(OptionError, match=r"policy_kwargs.optimizer: must be one of adam, muon, got"):
        policy_for(env, optimizer="sgd")
