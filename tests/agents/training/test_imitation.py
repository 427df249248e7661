"""Imitating a planner: what it shows, what a mirror makes of it, and that it is learnt."""

import dataclasses

import numpy as np
import pytest
import torch

from farm_ar.agents.policies import AnalyticPolicy
from farm_ar.agents.training.demonstrations import Demonstrations, demonstration
from farm_ar.agents.training.imitation import ImitatingPPO, _errors, mirrored
from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.agents.training.run_folder import RunFolder
from farm_ar.agents.training.surrogate_env import SurrogateEnv
from farm_ar.agents.training.training import train
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import MOVE_ACTIONS
from farm_ar.errors import OptionError
from farm_ar.scenes import builtin_scene

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}
IMITATE = {"steps": 64, "beam": 2, "batches": 4, "learning_rate": 0.003}


def seen_by(surrogate, beam=8):
    """What is on the tables of a surrogate environment, and what a planner would do."""
    shown = surrogate.demonstrate(beam)
    count = surrogate.num_envs
    return {
        **surrogate._observation(),
        "masks": surrogate.action_masks(),
        "actions": shown.actions,
        "worth": shown.worth,
        "returns": np.zeros(count, dtype=np.float32),
    }


def in_a_mirror(surrogate):
    """The same tables with left and right exchanged."""
    surrogate._position[..., 0] = surrogate._scene.size[0] - surrogate._position[..., 0]
    surrogate._home[..., 0] = surrogate._scene.size[0] - surrogate._home[..., 0]
    surrogate._eye[:, 0] = surrogate._scene.size[0] - surrogate._eye[:, 0]
    surrogate._yaw *= -1
    surrogate._facing *= -1
    surrogate._gaze[0] *= -1
    surrogate._look()


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_a_planner_shows_what_the_analytic_player_does(action):
    surrogate = SurrogateEnv(1, 0, action=action)
    env = FarmToTableEnv(action=action, **QUICK)
    player = AnalyticPolicy(beam=8)
    for _ in range(3):
        surrogate.reset()
        start = {"layout": surrogate._template.with_poses(surrogate._position[0], surrogate._yaw[0])}
        order = np.argsort([int(label) for label in start["layout"].labels])
        scene = surrogate._scene.layout
        start["layout"] = scene.with_poses(surrogate._position[0][order], surrogate._yaw[0][order])
        yaw, pitch, height = surrogate._gaze[:, 0]
        start["camera"] = {"position": surrogate._eye[0], "yaw": yaw, "pitch": pitch, "height": height}
        env.reset(seed=0, options=start)
        shown = surrogate.demonstrate(8)
        best = shown.actions[0][shown.worth[0] == 1.0]
        assert player.act(env).tolist() in best.tolist()


def test_what_is_shown_twice_counts_once():
    surrogate = SurrogateEnv(64, 0, action="displacement")
    surrogate.reset()
    shown = surrogate.demonstrate(8)
    several = 0
    for actions, worth in zip(shown.actions.tolist(), shown.worth, strict=True):
        counted = [tuple(action) for action, value in zip(actions, worth, strict=True) if value > 0]
        assert len(set(counted)) == len(counted)
        several += len(counted) > 1
    assert several > 32


def test_a_step_that_gains_a_useless_move_less_is_worth_e_times_less():
    """The gain of .005 is less than what the effort of a move costs that changes no label."""
    actions = np.array([[[0, 1, 2], [1, 0, 0], [2, 2, 2]]])
    shown = demonstration(actions, np.array([[1.0, 0.995, 0.98]]), 10)
    assert shown.actions[0, :3].tolist() == actions[0].tolist()
    assert shown.worth[0, :3] == pytest.approx([1.0, np.exp(-1), np.exp(-4)])
    assert shown.actions[0, -1].tolist() == [10, 0, 0]
    assert shown.worth[0, -1] == pytest.approx(np.exp(-200))


def test_where_few_steps_are_possible_the_rest_is_to_leave():
    farm = builtin_scene("farm")
    kinds = farm.layout.category_code
    few = [i for i in range(len(kinds)) if farm.layout.fixed[i] or np.sum(kinds[:i] == kinds[i]) < 2]
    scene = dataclasses.replace(farm, layout=farm.layout.subset(few))
    surrogate = SurrogateEnv(16, 0, action="slot", scene=scene)
    surrogate.reset()
    shown = surrogate.demonstrate(8)
    assert np.all(shown.actions < surrogate.action_space.nvec)
    assert np.all(shown.worth[shown.actions[..., 0] == len(few) - 1] >= 0)
    spaces = surrogate.observation_space, surrogate.action_space
    policy = ObjectPolicy(*spaces, lambda _: 1e-3, width=16, pair_width=8, rounds=1)
    assert torch.isfinite(_errors(policy, seen_by(surrogate))[0])


def test_where_no_plan_is_worth_its_effort_it_leaves():
    surrogate = SurrogateEnv(2, 0, action="slot", effort_weight=100.0)
    surrogate.reset()
    shown = surrogate.demonstrate(2)
    best = np.argmax(shown.worth, axis=1)
    assert shown.actions[[0, 1], best].tolist() == [[10, 0, 0]] * 2


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_the_mirror_shows_what_the_planner_would_do_on_the_mirrored_table(action):
    surrogate = SurrogateEnv(16, 0, action=action)
    surrogate.reset()
    before = seen_by(surrogate, 64)
    in_a_mirror(surrogate)
    after = seen_by(surrogate, 64)
    every = type("Always", (), {"random": staticmethod(lambda n: np.zeros(n))})()
    found = mirrored(before, every, MOVE_ACTIONS[action](10, 5, 1.0))
    for name in surrogate.observation_space.spaces:
        assert found[name] == pytest.approx(after[name], abs=1e-5), name
    ours, theirs = (
        [{tuple(a) for a, w in zip(*pair, strict=True) if w > 0.999} for pair in zip(*both, strict=True)]
        for both in ((found["actions"].tolist(), found["worth"]), (after["actions"].tolist(), after["worth"]))
    )
    # Of plans that gain the same, others may be found; but what is best here is best there.
    assert all(a & b for a, b in zip(ours, theirs, strict=True))


def test_half_of_the_moments_are_left_as_they_are():
    surrogate = SurrogateEnv(64, 0, action="displacement")
    surrogate.reset()
    before = seen_by(surrogate)
    found = mirrored(before, np.random.default_rng(0), MOVE_ACTIONS["displacement"](10, 5, 1.0))
    same = np.all(found["position"] == before["position"], axis=1)
    assert 16 < same.sum() < 48
    assert np.array_equal(found["actions"][same], before["actions"][same])
    assert before["position"] is not found["position"]


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_the_planner_leads_as_often_as_it_is_asked(action):
    surrogate = SurrogateEnv(64, 0, action=action)
    surrogate.reset()
    leave = np.zeros((64, len(surrogate.action_space.nvec)), dtype=np.int64)
    leave[:, 0] = 10
    for led, low, high in ((0.0, 0, 0), (0.5, 20, 44), (1.0, 60, 64)):
        surrogate.beam, surrogate.led = 2, led
        surrogate.step_async(leave)
        assert low <= np.sum(surrogate._actions[:, 0] != 10) <= high
    assert len(surrogate.shown) == 3
    assert np.all(leave[:, 0] == 10)


def test_the_planner_acts_less_and_less_but_half_of_the_time_to_the_end(tiny, tmp_path, monkeypatch):
    led, step = [], SurrogateEnv.step_async

    def watched(self, actions):
        led.append(self.led)
        step(self, actions)

    monkeypatch.setattr(SurrogateEnv, "step_async", watched)
    train(tiny(n_timesteps=160, imitate={**IMITATE, "steps": 128}), tmp_path)
    assert sorted(set(led), reverse=True) == [1.0, 0.875, 0.75, 0.625]
    assert led == sorted(led, reverse=True)


def test_values_learnt_apart_change_no_choice():
    surrogate = SurrogateEnv(4, 0, action="slot")
    seen = {name: torch.as_tensor(values) for name, values in surrogate.reset().items()}
    spaces = surrogate.observation_space, surrogate.action_space
    for apart in (False, True):
        policy = ObjectPolicy(*spaces, lambda _: 1e-3, width=16, pair_width=8, rounds=1)
        policy.network(seen, apart).value.sum().backward()
        moved = {name for name, weight in policy.named_parameters() if weight.grad is not None}
        assert (moved == {"network._value.weight", "network._value.bias"}) is apart


@pytest.mark.parametrize("action", ["slot", "displacement"])
def test_what_is_shown_becomes_likelier(action):
    surrogate = SurrogateEnv(32, 0, action=action)
    model = ImitatingPPO(
        ObjectPolicy,
        surrogate,
        n_steps=2,
        batch_size=64,
        seed=0,
        device="cpu",
        policy_kwargs={"width": 16, "pair_width": 8, "rounds": 1},
        imitate={**IMITATE, "batches": 60, "steps": 64},
    )
    other = SurrogateEnv(64, 1, action=action)
    other.reset()
    unknown = seen_by(other)
    before, optimizer = _errors(model.policy, unknown)[0].item(), model.policy.optimizer
    model.learn(64)
    assert model.policy.optimizer is not optimizer
    assert model.policy.optimizer.param_groups[0]["lr"] == model.learning_rate
    assert _errors(model.policy, unknown)[0].item() < before - 0.2
    assert len(model.demonstrations) == 0
    assert surrogate.shown == []
    model.learn(64, reset_num_timesteps=False)
    assert surrogate.beam == 0


def test_many_actions_have_the_probabilities_of_each():
    for action in ("slot", "displacement"):
        surrogate = SurrogateEnv(8, 0, action=action)
        surrogate.reset()
        moments = seen_by(surrogate)
        torch.manual_seed(0)
        spaces = surrogate.observation_space, surrogate.action_space
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
        ({"env_kwargs": {**QUICK, "visits": 2}}, "visits: must be 1 in the surrogate environment"),
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
