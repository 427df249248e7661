"""The surrogate environment: it shows what the environment shows, and differs in what is pushed only."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from sb3_contrib import MaskablePPO

from farm_ar.agents.training.object_policy import ObjectPolicy
from farm_ar.agents.training.surrogate_env import SurrogateEnv
from farm_ar.agents.training.surrogate_kernels import Bodies, assess_all, carry_all
from farm_ar.envs import FarmToTableEnv
from farm_ar.errors import OptionError
from farm_ar.reid.assignment import Rule
from farm_ar.scenes import builtin_scene

QUICK = {"play_seconds": 0.0, "animals_a_second": 0.0}


def both(action, **arguments):
    """A surrogate environment on one table, and the environment in the same situation."""
    surrogate = SurrogateEnv(1, 0, action=action, **arguments)
    rng = copy.deepcopy(surrogate._rng)
    shown = surrogate.reset()
    env = FarmToTableEnv(action=action, **QUICK, **arguments)
    start = {"layout": surrogate._layouts.draw(rng), "camera": surrogate._cameras.draw(rng)}
    observation, _ = env.reset(seed=0, options=start)
    return surrogate, shown, env, observation


def step(surrogate, *action):
    surrogate.step_async(np.array([action]))
    return surrogate.step_wait()


def untouched(env, index):
    """Whether an object has room on all sides for a step."""
    place = env.view.truth.position
    away = np.linalg.norm(place - place[index], axis=1)
    return np.sort(away)[1] > 0.25 and np.all(np.abs(place[index] - [0.6, 0.4]) < [0.4, 0.25])


@pytest.mark.parametrize("action", ["slot", "displacement"])
@pytest.mark.parametrize("jitter", ["easy", "default", "hard"])
def test_it_shows_what_the_environment_shows(action, jitter):
    surrogate, shown, env, observation = both(action, jitter=jitter)
    assert surrogate.observation_space == env.observation_space
    assert shown.keys() == observation.keys()
    for name, values in observation.items():
        assert shown[name].dtype == values.dtype
        assert shown[name][0] == pytest.approx(values, abs=1e-6), name
    assert np.array_equal(surrogate.env_method("action_masks")[0], env.action_masks())


@pytest.mark.parametrize(
    "reward", [{}, {"reward": "margin", "sign": -1}, {"reward": "clutter", "sign": -1}], ids=str
)
def test_where_nothing_is_in_the_way_a_move_does_what_the_hand_does(reward):
    found = 0
    for budget in (0.1, 0.2, 0.3, 0.4):
        surrogate, _, env, _ = both("displacement", jitter="hard", budget_m=budget, moves=2, **reward)
        free = [k for k, i in enumerate(env.view.movable) if env.view.in_view[i] and untouched(env, i)]
        for k in free[:1]:
            found += 1
            shown, gained, over, _ = step(surrogate, k, 4, 3, 4)
            observation, expected, *_ = env.step(np.array([k, 4, 3, 4]))
            assert gained[0] == pytest.approx(expected, abs=0.01)
            assert not over[0]
            assert shown["position"][0] == pytest.approx(observation["position"], abs=0.03)
            assert shown["cost"][0] == pytest.approx(observation["cost"], abs=0.03)
            assert shown["budget"][0] == pytest.approx(observation["budget"], abs=0.05)
    assert found


def test_leaving_ends_the_episode_with_what_the_rule_says():
    surrogate, _, env, _ = both("slot")
    shown, reward, over, infos = step(surrogate, 10, 0, 0)
    *_, info = env.step(np.array([10, 0, 0]))
    assert (over[0], reward[0], info["wrong_labels"]) == (True, 0.0, 0)
    assert infos[0]["episode"] == {"r": 0.0, "l": 1, "t": 0.0}
    assert not np.array_equal(infos[0]["terminal_observation"]["position"], shown["position"][0])


def test_an_episode_has_as_many_moves_as_it_says():
    surrogate = SurrogateEnv(3, 0, action="slot", moves=2)
    surrogate.reset()
    over = []
    for _ in range(4):
        surrogate.step_async(np.zeros((3, 3), dtype=np.int64))
        over.append(surrogate.step_wait()[2].tolist())
    assert over == [[False] * 3, [True] * 3, [False] * 3, [True] * 3]


def table(*places, fixed=0):
    """Objects of 10 cm, the last `fixed` of them fixed, for the kernels."""
    n = len(places)
    return {
        "position": np.array([places], dtype=np.float64),
        "yaw": np.zeros((1, n)),
        "bodies": Bodies(
            np.full(n, 0.05), np.arange(n) >= n - fixed, np.full((n, 2), 0.05), np.array([1.2, 0.8])
        ),
    }


@pytest.mark.parametrize("kernel", [carry_all, carry_all.py_func], ids=["compiled", "plain"])
def test_what_is_in_the_way_is_pushed_and_the_shed_is_not(kernel):
    on = table((0.3, 0.4), (0.45, 0.4), (0.9, 0.4), fixed=1)
    moved = np.empty((1, 2))
    kernel(np.array([0]), np.array([[0.3, 0.0]]), np.array([0.5]), *on.values(), moved)
    x = on["position"][0, :, 0]
    assert x == pytest.approx([0.6, 0.7, 0.9], abs=1e-6)
    assert moved[0] == pytest.approx([0.3 + 0.25, 0.5])
    kernel(np.array([0]), np.array([[0.3, 0.0]]), np.array([0.0]), *on.values(), moved)
    x = on["position"][0, :, 0]
    assert x[2] == 0.9
    assert x[1] <= 0.8 + 1e-6
    assert x[0] < 0.9


@pytest.mark.parametrize("kernel", [carry_all, carry_all.py_func], ids=["compiled", "plain"])
def test_nothing_leaves_the_table(kernel):
    on = table((0.3, 0.4), (1.1, 0.4))
    moved = np.empty((1, 2))
    kernel(np.array([1]), np.array([[0.3, -0.6]]), np.array([0.0]), *on.values(), moved)
    assert on["position"][0, 1] == pytest.approx([1.15, 0.05])
    kernel(np.array([-1]), np.array([[0.3, 0.0]]), np.array([0.0]), *on.values(), moved)
    assert moved.tolist() == [[0.0, 0.0]]


def test_two_that_changed_places_are_both_wrong_and_by_how_much():
    home = np.array([[[0.2, 0.2], [0.4, 0.2], [0.9, 0.9]]])
    place = home[:, [1, 0, 2]]
    cost, none, rule = np.full((1, 3, 2), 2.0), np.zeros((1, 3)), Rule(1.0, 1.0)
    seen = np.array([[True, True, False]])
    margin, wrong = assess_all(place, none, home, none, seen, np.array([0, 2, 3]), rule, cost)
    assert wrong.tolist() == [2]
    assert cost[0] == pytest.approx(np.array([[0.2, 0.0], [0.0, 0.2], [0.0, 2.0]]))
    assert margin[0] == pytest.approx([0.4, 0.4, np.inf])
    _, wrong = assess_all(place, none, home, none, seen & False, np.array([0, 2, 3]), rule, cost)
    assert wrong.tolist() == [0]


def test_a_learner_learns_in_it():
    surrogate = SurrogateEnv(4, 0, action="slot")
    model = MaskablePPO(ObjectPolicy, surrogate, n_steps=8, batch_size=32, n_epochs=1, seed=0, device="cpu")
    model.learn(32)
    assert model.num_timesteps == 32
    assert len(model.ep_info_buffer) > 0


@pytest.mark.parametrize("arguments", [{"visits": 2}, {"reward": "miscount"}, {"action": "continuous"}])
def test_what_it_cannot_stand_for_is_named(arguments):
    (name,) = arguments
    with pytest.raises(OptionError, match=f"{name}: must be .* in the surrogate environment"):
        SurrogateEnv(1, 0, **arguments)


def test_sizes_that_the_rule_would_tell_apart_are_refused():
    farm = builtin_scene("farm")
    size = farm.layout.size.copy()
    size[0] *= 1.1
    scene = replace(farm, layout=replace(farm.layout, size=size))
    with pytest.raises(OptionError, match="scene: must hold objects of one size in each category"):
        SurrogateEnv(1, 0, scene=scene)
