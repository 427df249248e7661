"""What `info` holds: numbers and arrays, under names of their own."""

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.farm_game import Phase

MOVE, HAND, LAYOUT, SCENE = "FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0"

ENVIRONMENTS = [
    (MOVE, {"moves": 2}),
    (MOVE, {"action": "slot", "visits": 2, "moves": 2}),
    (MOVE, {"action": "continuous", "moves": 2}),
    (MOVE, {"reward": "margin", "moves": 3}),
    (MOVE, {"reward": "clutter", "sign": -1, "moves": 3}),
    (MOVE, {"reward": "miscount", "moves": 2}),
    (MOVE, {"reward": "endpoint", "sign": -1, "moves": 2}),
    (HAND, {"reward": "margin", "hand_seconds": 0.5}),
    (HAND, {"observation": "pixels", "hand_seconds": 0.5}),
    (HAND, {"observation": "headset", "hand_seconds": 0.5}),
    (LAYOUT, {"visits": 2}),
    (SCENE, {"reward": "clutter"}),
]


def name_of(value):
    return "-".join(map(str, value.values())) if isinstance(value, dict) else value


@pytest.fixture(params=ENVIRONMENTS, ids=lambda case: f"{case[0]} {name_of(case[1])}")
def played(request):
    """An environment, and what its reset and its steps gave: observation, reward, info."""
    name, arguments = request.param
    env = gym.make(name, **arguments)
    env.action_space.seed(0)
    observation, info = env.reset(seed=0)
    given, over = [(observation, 0.0, info)], False
    while not over:
        observation, reward, over, _, info = env.step(env.action_space.sample())
        given.append((observation, reward, info))
    return env.unwrapped, given


def test_info_and_observation_can_be_laid_side_by_side_as_arrays(played):
    """TorchRL's `GymEnv` with several environments does that; a str, or a name twice, broke it."""
    _, given = played
    for observation, _, info in given:
        seen = observation if isinstance(observation, dict) else {"pixels": observation}
        assert not set(info) & set(seen)
        for value in info.values():
            assert isinstance(value, int | float | np.ndarray)
            assert not isinstance(value, np.generic)
            assert np.asarray(value).dtype.kind in "biuf"
            assert np.isfinite(value).all()
    shapes = [{name: np.shape(value) for name, value in info.items()} for *_, info in given]
    assert all(shape == shapes[0] for shape in shapes)


def test_a_reward_is_the_sum_of_its_terms(played):
    env, given = played
    names = {"margin": {"identity", "margin"}, "clutter": {"identity", "clutter"}}
    wanted = names.get(env.config.reward, {env.config.reward}) | {"effort"}
    for _, reward, info in given:
        paid = {name: value for name, value in info.items() if name.startswith("reward/")}
        assert set(paid) == {f"reward/{name}" for name in wanted}
        assert reward == pytest.approx(sum(paid.values()), abs=1e-12)
        assert paid["reward/effort"] == pytest.approx(-0.25 * info["effort"], abs=1e-12)


def test_the_mask_is_that_of_the_method_where_there_is_one(played):
    env, given = played
    if env.config.action not in ("displacement", "slot"):
        assert all("action_mask" not in info for *_, info in given)
        return
    np.testing.assert_array_equal(given[-1][2]["action_mask"], env.action_masks())
    assert {info["action_mask"].dtype for *_, info in given} == {np.dtype(bool)}
    first = env.reset(seed=3)[1]["action_mask"]
    np.testing.assert_array_equal(first[:10], env.view.in_view[env.view.movable])


def test_the_phase_is_a_number():
    assert (int(Phase.PLAY), int(Phase.HAND)) == (0, 1)
    env = FarmToTableEnv(moves=2)
    assert env.reset(seed=0)[1]["phase"] == Phase.HAND
    assert env.step(np.array([0, 3, 3, 3]))[4]["phase"] == Phase.HAND
    assert env.step(np.array([10, 3, 3, 3]))[4]["phase"] == Phase.PLAY


def test_of_several_environments_every_number_becomes_an_array():
    envs = gym.make_vec(MOVE, num_envs=2, vectorization_mode="sync")
    _, info = envs.reset(seed=0)
    mask = info.pop("action_mask")
    assert np.stack(mask).shape == (2, 32)
    assert all(info[name].dtype.kind in "biuf" for name in info if not name.startswith("_"))


@pytest.mark.parametrize("reid", ["spatial", "nearest", "last-known"])
def test_margins_and_costs_are_the_papers_whatever_the_headset_uses(reid):
    given = []
    for used in ("spatial", reid):
        env = FarmToTableEnv(reid=used, reward="margin", jitter="easy")
        observation, info = env.reset(seed=4)
        _, reward, *_, later = env.step(np.array([int(np.flatnonzero(env.action_masks()[:10])[0]), 4, 3, 3]))
        given.append(
            (observation["cost"], observation["margin"], info["paper_margin"], reward, later["paper_margin"])
        )
    for first, second in zip(*given, strict=True):
        np.testing.assert_array_equal(first, second)


def test_the_margin_term_is_not_paid_for_the_snapshot_that_the_game_takes_itself(pair, drive):
    """After it all is believed as it stands; what was ambiguous before it was paid for when it became so."""
    env = FarmToTableEnv(
        scene=pair,
        control="hand",
        reward="margin",
        jitter="none",
        budget=9.0,
        play_seconds=0.0,
        hand_seconds=9.0,
    )
    env.reset(seed=0, options={"camera": {"position": [0.3, -0.6], "yaw": 0.0}})
    begun = env.ambiguity
    infos = drive(env, (0.25, 0.3), grip=False)
    infos += drive(env, (0.29, 0.3), grip=True, speed=0.3)
    infos += drive(env, (0.29, 0.3), grip=False, most=3)
    over, before = False, env.ambiguity
    while not over:
        before = env.ambiguity
        *_, over, _, info = env.step(np.array([0.0, -1.0, 0.0, -1.0], dtype=np.float32))
        infos.append(info)
    assert infos[-1]["wrong_labels"] == 0
    assert before - begun > 0.1
    assert abs(env.ambiguity - before) > 0.01
    assert infos[-1]["reward/margin"] == 0
    assert sum(info["reward/margin"] for info in infos) == pytest.approx(0.5 * (before - begun), abs=1e-9)
