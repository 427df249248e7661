"""Every option that cannot be used gives one error, which names it, what came, and what would be right."""

import inspect
import pickle
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import MOVE_ACTIONS
from farm_ar.envs.rewards import REWARDS
from farm_ar.errors import OptionError, SceneError
from farm_ar.game_logic.perception import OraclePerception
from farm_ar.scenes import Bounds, Layout, Scene, builtin_scene

ARGUMENTS = [
    ("scene", "barn", "cafeteria"),
    ("scene", 3, "a Scene, the name of a built-in one, or a .json file"),
    ("scene", builtin_scene("L1"), "a fixed object, the shed"),
    ("control", "feet", "hand, layout, move"),
    ("action", "offsets", ", ".join(sorted(MOVE_ACTIONS))),
    ("action", "", ", ".join(sorted(MOVE_ACTIONS))),
    ("observation", "sound", "flat, headset, pixels, state"),
    ("knowledge", "grey-box", "black-box, white-box"),
    ("reward", "fame", ", ".join(sorted(REWARDS))),
    ("reid", "magic", "distance, last-known, likelihood, nearest"),
    ("reid", 7, "a function from a Scene to a Reidentifier"),
    ("perception", "nose", "oracle"),
    ("perception", OraclePerception, "a Perception"),
    ("oracle_noise", "loud", "measured"),
    ("jitter", "huge", "default, easy, hard, none"),
    ("fov", "fisheye", "display, photo"),
    ("sign", 0, "1 (an adversary) or -1 (a helper)"),
    ("sign", 2, "1 (an adversary) or -1 (a helper)"),
    ("visits", 0, "a whole number not below 1, or None"),
    ("visits", 1.5, "a whole number not below 1, or None"),
    ("steps_per_second", 7, "one of (10, 20, 30, 60)"),
    ("moves", True, "a whole number not below 1"),
    ("budget_m", 0.0, "a positive number"),
    ("budget_m", float("nan"), "a positive number"),
    ("budget_rad", "much", "a positive number"),
    ("budget", -0.1, "a positive number, or None"),
    ("hand_seconds", float("inf"), "a positive number"),
    ("hand_seconds", 1e308, "at most 3600"),
    ("budget_m", 10**400, "at most 1e+09"),
    ("visits", 10**20, "at most 1e+06"),
    ("play_seconds", 1e20, "at most 3600"),
    ("animals_a_second", 1e308, "at most 10000"),
    ("budget_rad", 1e308, "at most 1e+09"),
    ("budget", 1e300, "at most 1e+09"),
    ("effort_weight", 1e308, "at most 1e+06"),
    ("head_noise_deg", 1e308, "at most 360"),
    ("moves", 10**9, "at most 1e+06"),
    ("play_seconds", 1j, "a number not below 0"),
    ("jitter", ["easy"], "default, easy, hard, none"),
    ("action", np.array(["slot"]), ", ".join(sorted(MOVE_ACTIONS))),
    ("control", None, "hand, layout, move"),
    ("effort_weight", -1, "a number not below 0"),
    ("play_seconds", None, "a number not below 0"),
    ("session", "on", "learn, off"),
    ("session", "learn", "off with reid spatial"),
    ("carry", "throw", "drag, lift"),
    ("gaze", "down", "random, still"),
    ("update", "later", "live, pause"),
    ("head_noise_deg", -3.0, "a number not below 0"),
    ("animals_a_second", -1.0, "a number not below 0"),
    ("game", "yes", "True or False"),
    ("render_mode", "ansi", "through gym.make also rgb_array_list, or None"),
]


@pytest.mark.parametrize(("name", "value", "right"), ARGUMENTS, ids=str)
def test_a_bad_argument_names_itself_and_what_is_right(name, value, right):
    with pytest.raises(OptionError) as caught:
        FarmToTableEnv(**{name: value})
    message = str(caught.value)
    assert message.startswith(f"{name}: must ")
    assert right in message
    assert "\n" not in message
    assert caught.value.got is value or name == "scene" or caught.value.got == repr(value)


def test_every_argument_has_a_bad_value_tried():
    names = set(inspect.signature(FarmToTableEnv).parameters)
    assert names == {name for name, *_ in ARGUMENTS}


def test_a_misspelt_argument_is_not_dropped():
    with pytest.raises(TypeError, match="jiter"):
        gym.make("FarmToTable-v0", jiter="easy")


@pytest.mark.parametrize(("name", "value"), [("control", "move"), ("reward", "miscount")])
def test_what_needs_the_game_is_refused_without_it(name, value):
    with pytest.raises(OptionError, match=f"{name}: must be .* without the game"):
        gym.make("SceneLayout-v0", **{name: value})


def test_a_scene_file_that_cannot_be_used_names_the_file(tmp_path: Path):
    path = tmp_path / "room.json"
    path.write_text('{"name": "room"}')
    with pytest.raises(SceneError, match=r"room\.json"):
        gym.make("SceneLayout-v0", scene=str(path))


def test_a_scene_in_which_nothing_moves_is_refused(pair):
    everything = np.ones(3, dtype=bool)
    layout = pair.layout
    still = Layout(layout.labels, layout.category, layout.position, layout.yaw, layout.size, fixed=everything)
    with pytest.raises(OptionError, match="scene: must hold something that can be moved"):
        FarmToTableEnv(scene=Scene("still", pair.size, still))


def test_numbers_of_numpy_are_taken_and_become_pythons():
    env = FarmToTableEnv(visits=np.int64(2), budget_m=np.float32(0.5), sign=np.int8(-1))
    env.reset(seed=0)
    arguments = env.trace()["arguments"]
    assert [type(arguments[name]) for name in ("visits", "budget_m", "sign")] == [int, float, int]


FARM = builtin_scene("farm").layout
FAR, TURNED = np.array(FARM.position), np.array(FARM.yaw)
FAR[3, 1], TURNED[2] = -1.1e6, 7e6

RESET = [
    (
        {"layout": {"position": FAR, "yaw": FARM.yaw}},
        "position[3, 1]: must be finite, from -1e6 to 1e6 metres, got -1100000.0",
    ),
    (
        {"layout": {"position": FARM.position, "yaw": TURNED}},
        "yaw[2]: must be finite, at most 1e6 turns, got 7000000.0",
    ),
    (
        {"layout": {"position": 1e308 * FARM.position, "yaw": FARM.yaw}},
        "position[0, 0]: must be finite, from -1e6 to 1e6 metres, got 1.85e+307",
    ),
    ({"layout": {"position": FARM.position + 1j, "yaw": FARM.yaw}}, "options.layout: must be"),
    ({"layout": {"position": "here", "yaw": FARM.yaw}}, "options.layout: must be"),
    ({"layout": {1: 2}}, "options.layout: must be"),
    (
        {"camera": {"position": [0, 2e6], "yaw": 0}},
        "camera.position[1]: must be finite, from -1e6 to 1e6 metres, got 2000000.0",
    ),
    (
        {"camera": {"position": [0, 0], "yaw": -1e20}},
        "camera.yaw: must be finite, at most 1e6 turns, got -1e+20",
    ),
    (
        {"camera": {"position": [0, 0], "yaw": 0, "height": 1e9}},
        "camera.height: must be finite, from -1e6 to 1e6 metres, got 1000000000.0",
    ),
    (
        {"camera": {"position": [0, 0], "yaw": 0, "pitch": 1e9}},
        "camera.pitch: must be finite, at most 1e6 turns, got 1000000000.0",
    ),
    ({"camera": {"position": [0, 0], "yaw": float("inf")}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": 1j}}, "options.camera: must be one Camera"),
    ({"camera": {"position": {}, "yaw": 0}}, "options.camera: must be one Camera"),
    ({"camera": {"position": np.array([0, 1j]), "yaw": 0}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 10**400], "yaw": 0}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": "1"}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": 0, "fov": 7}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": 0, 1: 7}}, "options.camera: must be one Camera"),
    ({"layout": {"position": [[10**400, 0]] * 11, "yaw": [0] * 11}}, "options.layout: must be"),
    ({"camera": {}}, "options.camera: must be one Camera"),
    ({1: 2}, "options: must hold layout and camera only, got 1"),
    (7, "options: must be a mapping with layout and camera, both optional, got 7"),
    ({"lay-out": None}, "options: must hold layout and camera only, got 'lay-out'"),
    ({"layout": 5}, "options.layout: must be a Layout of the scene's objects"),
    ({"layout": {"position": [[0, 0]], "yaw": [0]}}, "options.layout: must be"),
    ({"layout": {"position": np.zeros((11, 2))}}, "options.layout: must be"),
    ({"layout": {"position": np.zeros((11, 2)), "yaw": np.zeros(11), "pitch": 1}}, "options.layout: must be"),
    ({"layout": {"position": np.full((11, 2), np.nan), "yaw": np.zeros(11)}}, "options.layout: must be"),
    ({"layout": {"position": np.zeros((2, 11, 2)), "yaw": np.zeros((2, 11))}}, "options.layout: must be"),
    ({"layout": builtin_scene("L1").layout}, "labels: must be the scene's"),
    ({"camera": "there"}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0]}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": [0, 1]}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [[0, 0]], "yaw": [0]}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": 0, "zoom": 2}}, "options.camera: must be one Camera"),
    ({"camera": {"position": [0, 0], "yaw": 0, "fov": {"left": 9}}}, "options.camera: must be one Camera"),
]


@pytest.mark.parametrize(("options", "message"), RESET, ids=lambda value: str(value)[:60])
def test_a_bad_reset_option_says_what_is_right_and_no_episode_begins(options, message):
    env = FarmToTableEnv()
    env.reset(seed=0)
    with pytest.raises(OptionError) as caught:
        env.reset(options=options)
    assert message in str(caught.value)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(env.action_space.sample())


BAD_ACTIONS = [
    ({}, [11, 0, 0, 0]),
    ({}, [-1, 0, 0, 0]),
    ({}, [0, 7, 0, 0]),
    ({}, [0, 0, 0]),
    ({}, [0.5, 0, 0, 0]),
    ({}, None),
    ({}, "leave"),
    ({"action": "continuous"}, [0, 0, 0, 0, float("nan")]),
    ({"control": "hand"}, [0, 0, 0]),
    ({"control": "layout"}, [[0] * 30]),
    ({"control": "layout"}, np.zeros(30) + 1j),
    ({"control": "hand"}, [0, 0, 1j, 0]),
    ({"control": "hand"}, [0, float("inf"), 0, 0]),
    ({"control": "hand"}, np.array([0, 0, 0, 0], dtype=object)),
    ({"control": "hand"}, [10**400, 0, 0, 0]),
    ({"control": "hand"}, np.array([np.longdouble("1e4000"), 0, 0, 0])),
    ({"control": "hand"}, ["0", "0", "0", "0"]),
    ({"control": "hand"}, np.array([0, 0, 0, 0], dtype="datetime64[s]")),
    ({"control": "hand"}, [[0], [0, 0]]),
    ({"control": "hand"}, {"velocity": 0}),
    ({}, np.array([0, 3, 3, 3]) + 0j),
    ({}, [10**30, 0, 0, 0]),
    ({}, [True, True, True, True]),
]


@pytest.mark.parametrize(("arguments", "action"), BAD_ACTIONS, ids=str)
def test_an_action_that_is_none_is_refused_and_leaves_no_trace(arguments, action):
    env = FarmToTableEnv(**arguments)
    env.reset(seed=0)
    before = env.state_hash()
    with pytest.raises(gym.error.InvalidAction, match="action: must be in") as caught:
        env.step(action)
    assert "\n" not in str(caught.value)
    assert pickle.loads(pickle.dumps(env)).state_hash() == before
    assert env.trace()["actions"] == []
    assert env.state_hash() == before


def test_numbers_of_any_size_and_type_are_clipped_to_the_box():
    for big in (np.array([1e308] * 30), np.array([2**62] * 30), np.array([np.float16(6e4)] * 30)):
        env = FarmToTableEnv(control="layout", jitter="none", play_seconds=0.0)
        env.reset(seed=0)
        assert np.isfinite(env.step(big)[1])


def test_numbers_beyond_the_box_are_clipped():
    def end(action):
        env = FarmToTableEnv(control="layout", jitter="none", play_seconds=0.0)
        env.reset(seed=0)
        env.step(np.array(action))
        return env.world.truth.position

    np.testing.assert_array_equal(end([3.0, -2.0, 0.5] * 10), end([1.0, -1.0, 0.5] * 10))


@pytest.mark.parametrize(
    "ask",
    [
        lambda env: env.step(np.array([0, 0, 0, 0])),
        lambda env: env.view,
        lambda env: env.world,
        FarmToTableEnv.trace,
        FarmToTableEnv.state_hash,
        FarmToTableEnv.action_masks,
        FarmToTableEnv.render,
    ],
)
def test_nothing_can_be_asked_before_the_first_reset(ask):
    env = FarmToTableEnv(render_mode="rgb_array")
    with pytest.raises(gym.error.ResetNeeded):
        ask(env)


def test_a_step_after_the_end_asks_for_a_reset():
    env = FarmToTableEnv(control="layout", play_seconds=0.0)
    env.reset(seed=0)
    env.step(np.zeros(30))
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(30))


def test_masks_of_continuous_actions_are_refused():
    env = FarmToTableEnv(action="continuous")
    env.reset(seed=0)
    with pytest.raises(
        OptionError, match="action: must be discrete, displacement or slot for masks, got 'continuous'"
    ):
        env.action_masks()


def test_a_trace_needs_names_for_its_arguments(pair):
    env = FarmToTableEnv(scene=pair)
    env.reset(seed=0)
    with pytest.raises(OptionError, match="scene: must be a name for a trace, got 'Scene'"):
        env.trace()


def test_a_rectangle_anywhere_is_played_in_the_frame_of_its_room():
    scene = builtin_scene("L2")
    away = FarmToTableEnv(scene=scene.moved((-1000.0, 50.0), 0.7), control="layout", game=False)
    here = FarmToTableEnv(scene=scene, control="layout", game=False)
    one, other = away.reset(seed=1)[0], here.reset(seed=1)[0]
    for name, values in one.items():
        np.testing.assert_allclose(values, other[name], atol=1e-5)


@pytest.mark.parametrize("bounds", [None, Bounds([(0, 0), (8, 0), (0, 8)])])
def test_other_bounds_are_refused_in_a_line(bounds):
    scene = replace(builtin_scene("L2"), bounds=bounds)
    with pytest.raises(SceneError, match="bounds: must be a rectangle here"):
        FarmToTableEnv(scene=scene, control="layout", game=False)
