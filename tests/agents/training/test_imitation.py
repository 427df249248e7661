"""Imitating a planner: what it shows, what a mirror makes of it, and that it is learnt."""

import dataclasses

import numpy as np
import pytest
import torch

from farm_ar.agents.training.demonstrated_env import DemonstratedEnv, lifted
from farm_ar.agents.training.demonstrations import Demonstrations, demonstration
from farm_ar.agents.training.imitation import ImitatingPPO, _errors, mirrored
from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.agents.training.run_folder import RunFolder
from farm_ar.agents.training.training import train
from farm_ar.envs.actions import MOVE_ACTIONS
from farm_ar.errors import OptionError
from farm_ar.scenes import builtin_scene

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}
IMITATE = {"steps": 64, "beam": 2, "batches": 4, "learning_rate": 0.003}


def made(count, seed=0, **arguments):
    """A batch that has begun, and what is seen in it."""
    envs = lifted("FarmToTable-v0", {**QUICK, **arguments}, count, seed, 1)
    return envs, envs.reset()


def moments_of(envs, seen, beam=8):
    """What is on the tables, and what a planner would do."""
    shown = envs.demonstrate(beam)
    return {
        **seen,
        "masks": np.stack(envs.env_method("action_masks")),
        "actions": shown.actions,
        "worth": shown.worth,
        "returns": np.zeros(envs.num_envs, dtype=np.float32),
    }


def test_a_step_that_gains_a_useless_move_less_is_worth_e_times_less():
    """The gain of .005 is less than what the effort of a move costs that changes no label."""
    actions = np.array([[[0, 1, 2], [1, 0, 0], [2, 2, 2]]])
    shown = demonstration(actions, np.array([[1.0, 0.995, 0.98]]), 10)
    assert shown.actions[0, :3].tolist() == actions[0].tolist()
    assert shown.worth[0, :3] == pytest.approx([1.0, np.exp(-1), np.exp(-4)])
    assert shown.actions[0, -1].tolist() == [10, 0, 0]
    assert shown.worth[0, -1] == pytest.approx(np.exp(-200))


REVERSED = [4, 3, 2, 1, 0, 9, 8, 7, 6, 5, 10]
"""Each kind is met from left to right, so in a mirror the other way round."""


def in_a_mirror(envs, k):
    """What is seen and shown where everything stands as in the k-th environment, left and right exchanged."""
    farm, state = builtin_scene("farm"), envs.venv.batch.state
    place = np.column_stack([farm.size[0] - state.bodies[k]["x"], state.bodies[k]["z"]])
    eye, action = state.eyes[k], envs.venv.batch.config.action
    camera = {"position": (farm.size[0] - eye.x, eye.z), "yaw": -eye.yaw, "pitch": eye.pitch}
    other = lifted("FarmToTable-v0", {**QUICK, "action": action}, 1, 0, 1)
    layout = farm.layout.with_poses(place, state.bodies[k]["angle"])
    other.venv.set_options({"layout": layout, "camera": {**camera, "height": eye.height}})
    moments = {name: values[0] for name, values in moments_of(other, other.reset(), 64).items()}
    for name, values in moments.items():
        if len(values.flat) % 11 == 0 and name in envs.observation_space.spaces:
            moments[name] = values.reshape(11, -1)[REVERSED].ravel()
    cost = moments["cost"].reshape(11, 5)
    cost[:10] = cost[:10, ::-1]
    actions = moments["actions"]
    stays = actions[:, 0] == 10
    actions[:, 0] = np.array(REVERSED)[actions[:, 0]]
    if action == "slot":
        actions[~stays, 1] = 4 - actions[~stays, 1]
    return moments


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_the_mirror_shows_what_the_planner_would_do_on_the_mirrored_table(action):
    envs, seen = made(12, action=action)
    before = moments_of(envs, seen, 64)
    every = type("Always", (), {"random": staticmethod(lambda n: np.zeros(n))})()
    found = mirrored(before, every, MOVE_ACTIONS[action](10, 5, 1.0))
    for k in range(12):
        after = in_a_mirror(envs, k)
        for name in envs.observation_space.spaces:
            assert found[name][k] == pytest.approx(after[name], abs=1e-5), name
        ours, theirs = (
            {tuple(a) for a, w in zip(actions.tolist(), worth, strict=True) if w > 0.999}
            for actions, worth in (
                (found["actions"][k], found["worth"][k]),
                (after["actions"], after["worth"]),
            )
        )
        # Of plans that gain the same, others may be found; but what is best here is best there.
        assert ours & theirs


def test_half_of_the_moments_are_left_as_they_are():
    envs, seen = made(64, action="displacement")
    before = moments_of(envs, seen)
    found = mirrored(before, np.random.default_rng(0), MOVE_ACTIONS["displacement"](10, 5, 1.0))
    same = np.all(found["position"] == before["position"], axis=1)
    assert 16 < same.sum() < 48
    assert np.array_equal(found["actions"][same], before["actions"][same])
    assert before["position"] is not found["position"]


def test_the_planner_acts_less_and_less_but_half_of_the_time_to_the_end(tiny, tmp_path, monkeypatch):
    led, step = [], DemonstratedEnv.step_async

    def watched(self, actions):
        led.append(self.led)
        step(self, actions)

    monkeypatch.setattr(DemonstratedEnv, "step_async", watched)
    train(tiny(n_timesteps=160, imitate={**IMITATE, "steps": 128}), tmp_path)
    assert sorted(set(led), reverse=True) == [1.0, 0.875, 0.75, 0.625]
    assert led == sorted(led, reverse=True)


def test_values_learnt_apart_change_no_choice():
    envs, seen = made(4, action="slot")
    seen = {name: torch.as_tensor(values) for name, values in seen.items()}
    spaces = envs.observation_space, envs.action_space
    for apart in (False, True):
        policy = ObjectPolicy(*spaces, lambda _: 1e-3, width=16, pair_width=8, rounds=1)
        policy.network(seen, apart).value.sum().backward()
        moved = {name for name, weight in policy.named_parameters() if weight.grad is not None}
        assert (moved == {"network._value.weight", "network._value.bias"}) is apart


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_what_is_shown_becomes_likelier(action):
    envs, _ = made(32, action=action)
    model = ImitatingPPO(
        ObjectPolicy,
        envs,
        n_steps=2,
        batch_size=64,
        seed=0,
        device="cpu",
        policy_kwargs={"width": 16, "pair_width": 8, "rounds": 1},
        imitate={**IMITATE, "batches": 60, "steps": 64},
    )
    unknown = moments_of(*made(64, 1000, action=action))
    before, optimizer = _errors(model.policy, unknown)[0].item(), model.policy.optimizer
    model.learn(64)
    assert model.policy.optimizer is not optimizer
    assert model.policy.optimizer.param_groups[0]["lr"] == model.learning_rate
    assert _errors(model.policy, unknown)[0].item() < before - 0.2
    assert len(model.demonstrations) == 0
    assert envs.shown == []
    model.learn(64, reset_num_timesteps=False)
    assert envs.beam == 0


def test_many_actions_have_the_probabilities_of_each():
    for action in ("slot", "displacement"):
        envs, seen = made(8, action=action)
        moments = moments_of(envs, seen)
        torch.manual_seed(0)
        spaces = envs.observation_space, envs.action_space
        policy = ObjectPolicy(*spaces, lambda _: 1e-3, width=16, pair_width=8, rounds=1)
        seen = {name: torch.as_tensor(moments[name]) for name in spaces[0].spaces}
        distribution, _ = policy.outlook(seen, moments["masks"])
        actions = torch.as_tensor(moments["actions"])
        each = torch.stack([distribution.log_prob(one) for one in actions.unbind(1)], dim=1)
        assert torch.allclose(distribution.log_probs(actions), each, atol=1e-5)


def test_demonstrations_are_kept_and_drawn(tmp_path):
    kept = Demonstrations()
    assert len(kept) == 0
    for k in range(3):
        kept.add({"returns": np.full(4, k, dtype=np.float32), "actions": np.full((4, 2), k)})
    kept.save(tmp_path / "shown.npz")
    again = Demonstrations()
    again.load(tmp_path / "shown.npz")
    assert len(again) == 12
    drawn = again.draw(100, np.random.default_rng(0))
    assert set(drawn["returns"]) == {0, 1, 2}
    assert np.array_equal(drawn["actions"][:, 0], drawn["returns"])


def test_a_run_that_was_interrupted_while_it_imitated_knows_what_it_was_shown(tiny, tmp_path, monkeypatch):
    run = tiny(n_timesteps=32, imitate=IMITATE)
    train(run, tmp_path)
    saved = RunFolder(tmp_path).newest("checkpoints")
    kept = Demonstrations()
    kept.load(saved / "demonstrations.npz")
    assert len(kept) == 32
    drawn, learn = [], Demonstrations.draw
    monkeypatch.setattr(
        Demonstrations, "draw", lambda self, *rest: drawn.append(len(self)) or learn(self, *rest)
    )
    model = train(run, tmp_path, resume=True, steps=96)
    assert drawn == [64] * IMITATE["batches"]
    assert model.num_timesteps == 96
    assert not (RunFolder(tmp_path).newest("checkpoints") / "demonstrations.npz").exists()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"policy": "MultiInputPolicy", "policy_kwargs": {}}, "imitate: must be 0 but for maskable-ppo"),
        ({"env_kwargs": {**QUICK, "sign": -1}}, "imitate: must be 0 for a helper"),
        ({"env_kwargs": {**QUICK, "reid": "likelihood"}}, "reid: must be spatial or distance in a batch"),
    ],
)
def test_what_cannot_be_shown_is_seen_before(tiny, tmp_path, values, message):
    with pytest.raises(OptionError, match=message):
        train(tiny(imitate=IMITATE, **values), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_same_seed_same_weights(tiny, tmp_path):
    run = tiny(n_timesteps=64, imitate=IMITATE)
    first, second = (train(run, tmp_path / name) for name in "ab")
    other = train(dataclasses.replace(run, seed=1), tmp_path / "c")
    weights = [torch.cat([w.flatten() for w in m.policy.parameters()]) for m in (first, second, other)]
    assert torch.equal(weights[0], weights[1])
    assert not torch.equal(weights[0], weights[2])
