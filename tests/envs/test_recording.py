"""Gymnasium's recorders: a video of the table, the statistics of an episode; and the pictures themselves."""

import cv2
import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics, RecordVideo

from farm_ar.errors import OptionError


@pytest.mark.parametrize(("name", "rate"), [("FarmToTable-v0", 4), ("FarmToTableHand-v0", 10)])
def test_a_recorded_video_has_a_frame_for_every_step_at_the_games_speed(name, rate, tmp_path):
    env = RecordVideo(gym.make(name, render_mode="rgb_array"), str(tmp_path / "videos"), disable_logger=True)
    env.reset(seed=0)
    env.action_space.seed(0)
    shape = env.render().shape
    for _ in range(5):
        *_, over, _, _ = env.step(env.action_space.sample())
        if over:
            break
    env.close()
    (path,) = tmp_path.glob("videos/*.mp4")
    video = cv2.VideoCapture(str(path))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(rate)
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) >= 5
    assert abs(video.get(cv2.CAP_PROP_FRAME_HEIGHT) - shape[0]) <= 1


def test_the_statistics_of_an_episode_are_its_return_and_length():
    env = RecordEpisodeStatistics(gym.make("FarmToTable-v0", visits=2))
    env.reset(seed=0)
    env.action_space.seed(0)
    rewards, over = [], False
    while not over and len(rewards) < 50:
        _, reward, over, _, info = env.step(env.action_space.sample())
        rewards.append(reward)
    assert info["episode"]["r"] == pytest.approx(sum(rewards))
    assert info["episode"]["l"] == len(rewards)


@pytest.mark.parametrize("name", ["FarmToTable-v0", "SceneLayout-v0"])
def test_pictures_are_bytes_that_follow_what_happens_and_equal_moments_look_equal(name):
    first, second = (gym.make(name, render_mode="rgb_array") for _ in range(2))
    for env in (first, second):
        env.reset(seed=0)
    before = first.render()
    assert before.dtype == np.uint8
    assert before.ndim == 3
    assert before.shape[2] == 3
    assert before.std() > 10
    np.testing.assert_array_equal(before, second.render())
    action = [int(np.flatnonzero(first.unwrapped.action_masks()[:10])[0]), 0, 0, 3] if "Farm" in name else 0.5
    action = np.full(first.action_space.shape, action)
    for env in (first, second):
        env.step(action)
    after = first.render()
    assert (after != before).any()
    np.testing.assert_array_equal(after, second.render())


def test_without_a_render_mode_there_is_no_picture():
    env = gym.make("FarmToTable-v0").unwrapped
    env.reset(seed=0)
    assert env.render() is None


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
def test_asked_for_a_window_gymnasium_lets_the_environment_say_that_there_is_none(make, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(
        OptionError, match=r"render_mode: must be rgb_array.* there is no window .*, got 'human'"
    ):
        make("FarmToTable-v0", render_mode="human")


def test_gymnasiums_list_of_pictures_still_works():
    env = gym.make("FarmToTable-v0", render_mode="rgb_array_list", moves=2)
    env.reset(seed=0)
    env.step(np.array([10, 0, 0, 0]))
    assert [picture.shape for picture in env.render()] == 2 * [env.unwrapped.render().shape]
