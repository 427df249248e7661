"""Films of episodes: every moment of a move is shown, and filming changes nothing."""

import numpy as np
import pytest

from farm_ar.agents.policies import RandomPolicy
from farm_ar.envs import FarmToTableEnv
from farm_ar.showcases import episode_film
from farm_ar.showcases.episode_film import film_episode


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Draws small pictures, which are as many."""
    monkeypatch.setattr(episode_film, "HEIGHT", 120)


def film(**arguments):
    env = FarmToTableEnv(**arguments)
    frames = list(film_episode(env, RandomPolicy(np.random.default_rng(0)), seed=3))
    return env, frames


def test_a_film_shows_the_hand_move_and_the_play_afterwards():
    env, frames = film(moves=1, play_seconds=0.5)
    still, played = 24, 15
    assert len(frames) > still + played + 10
    shapes = {frame.shape for frame in frames}
    assert len(shapes) == 1
    assert any(not np.array_equal(a, b) for a, b in zip(frames[still:], frames[still + 1 :], strict=False))
    assert env.world.clock == pytest.approx(0.5)


def test_a_film_ends_with_what_the_episode_came_to():
    watched, alone = (FarmToTableEnv(moves=2, play_seconds=0.0) for _ in range(2))
    told = []

    def show():
        told.append((yield from film_episode(watched, RandomPolicy(np.random.default_rng(0)), seed=3)))

    assert list(show())
    alone.reset(seed=3)
    player, over, total, info = RandomPolicy(np.random.default_rng(0)), False, 0.0, {}
    while not over:
        _, reward, over, _, info = alone.step(player.act(alone))
        total += reward
    assert told == [(total, info["wrong_labels"])]


def test_what_is_filmed_goes_as_it_does_unwatched():
    watched, _ = film(moves=2, play_seconds=0.5)
    alone = FarmToTableEnv(moves=2, play_seconds=0.5)
    alone.reset(seed=3)
    player, over = RandomPolicy(np.random.default_rng(0)), False
    while not over:
        _, _, over, _, _ = alone.step(player.act(alone))
    assert watched.world.truth.position == pytest.approx(alone.world.truth.position, abs=1e-12)
    assert watched.world.tracker.belief.wrong_labels == alone.world.tracker.belief.wrong_labels


@pytest.mark.parametrize(
    ("arguments", "held"),
    [
        ({"control": "layout", "game": False, "scene": "L1", "visits": 2}, 24),
        ({"control": "hand", "hand_seconds": 0.4}, 3),
    ],
)
def test_where_there_are_no_moves_there_is_a_picture_for_each_step(arguments, held):
    _, frames = film(play_seconds=0.0, **arguments)
    changes = [k for k in range(1, len(frames)) if not np.array_equal(frames[k - 1], frames[k])]
    assert all((k - 24) % held == 0 for k in changes)
    steps = 2 if held == 24 else (changes[-1] - 24) // 3 + 1
    assert len(frames) == 24 + held * steps + 24


def test_a_film_ends_with_a_picture_that_stays():
    _, frames = film(moves=1, play_seconds=0.5)
    assert all(np.array_equal(frame, frames[-1]) for frame in frames[-24:])
    assert not np.array_equal(frames[-26], frames[-1])
