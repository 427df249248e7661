"""`render_mode="human"`: a page on this machine shows every step."""

import json
import pickle

import gymnasium as gym
import numpy as np
import pytest
import websockets.sync.client

from farm_ar.envs import replay


@pytest.fixture
def opened(monkeypatch):
    """Links that a browser was to open."""
    links = []
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr("webbrowser.open", links.append)
    return links


@pytest.mark.parametrize("name", ["FarmToTableHand-v0", "FarmToTable-v0", "SceneLayout-v0"])
def test_every_step_is_shown_to_who_looks(opened, name) -> None:
    env = gym.make(f"farm_ar:{name}", render_mode="human")
    env.unwrapped.metadata = {**env.unwrapped.metadata, "render_fps": 1000}
    env.reset(seed=1)
    (link,) = opened
    with websockets.sync.client.connect(link.replace("http", "ws") + "games/new") as page:
        hello, first = json.loads(page.recv(10)), json.loads(page.recv(10))
        assert hello["role"] == "watcher"
        assert first["kind"] == "state"
        env.step(env.action_space.sample())
        second = json.loads(page.recv(10))
    assert second["step"] == first["step"] + 1
    truth = env.unwrapped.world.truth
    np.testing.assert_allclose(np.array(second["objects"])[:, :2], truth.position, atol=1e-4)
    assert env.render() is None
    env.close()


def test_copies_and_replays_open_no_window_of_their_own(opened) -> None:
    env = gym.make("farm_ar:FarmToTable-v0", render_mode="human").unwrapped
    env.metadata = {**env.metadata, "render_fps": 1000}
    env.reset(seed=2)
    env.step(env.action_space.sample())
    assert replay(env.trace()) == env.state_hash()
    assert pickle.loads(pickle.dumps(env)).state_hash() == env.state_hash()
    assert len(opened) == 1
    env.close()
