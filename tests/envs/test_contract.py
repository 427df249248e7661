"""Every registered environment, and every option at least once, keeps the whole contract."""

import pickle
import re

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.perception import OraclePerception
from farm_ar.reid import SpatialOptions, SpatialReid
from farm_ar.scenes import Detector, builtin_scene, save_scene
from farm_ar.testing import check_environment

MOVE, HAND, LAYOUT, SCENE = "FarmToTable-v0", "FarmToTableHand-v0", "FarmToTableLayout-v0", "SceneLayout-v0"
LIFT, DELIVER = "FarmToTableHandLift-v0", "DeliverToChair-v0"
FIVE = (MOVE, HAND, LIFT, LAYOUT, SCENE)
VARIANTS_OF_FIVE = ("Discrete", "BlackBox", "Shaped")

NOISY = OraclePerception(
    Detector(position_sd=0.01, yaw_sd=0.1, miss_rate=0.1, false_rate=0.5, unknown_rate=0.1)
)


def all_sites(scene):
    return SpatialReid(scene, SpatialOptions(threshold=1.0))


VARIANTS = [
    (MOVE, {}),
    (HAND, {}),
    (LIFT, {}),
    (LAYOUT, {}),
    (SCENE, {}),
    *((name.replace("-", f"{variant}-"), {}) for variant in VARIANTS_OF_FIVE for name in FIVE),
    (MOVE, {"action": "slot"}),
    (MOVE, {"action": "continuous"}),
    (MOVE, {"jitter": "none"}),
    (MOVE, {"jitter": "easy"}),
    (MOVE, {"jitter": "hard"}),
    (MOVE, {"reward": "margin"}),
    (MOVE, {"reward": "miscount"}),
    (MOVE, {"reward": "endpoint"}),
    (HAND, {"reward": "margin"}),
    (LAYOUT, {"reward": "margin"}),
    (MOVE, {"reid": "nearest"}),
    (MOVE, {"reid": "distance"}),
    (MOVE, {"reid": "last-known"}),
    (MOVE, {"reid": all_sites}),
    (MOVE, {"reid": "adaptive", "session": "learn", "visits": 2, "moves": 2}),
    (SCENE, {"scene": "farm", "reid": "adaptive", "session": "learn"}),
    (MOVE, {"perception": NOISY}),
    (MOVE, {"budget_m": 0.1, "budget_rad": 0.2}),
    (MOVE, {"budget": 0.2}),
    (HAND, {"budget": 0.2}),
    (MOVE, {"visits": 2, "moves": 2}),
    (HAND, {"visits": 2, "hand_seconds": 0.5}),
    (LAYOUT, {"visits": 2}),
    (MOVE, {"sign": -1}),
    (MOVE, {"effort_weight": 0.0}),
    (MOVE, {"head_noise_deg": 5.0}),
    (MOVE, {"animals_a_second": 60.0}),
    (MOVE, {"animals_a_second": 0.0}),
    (HAND, {"head_noise_deg": 5.0, "hand_seconds": 1.0}),
    (MOVE, {"fov": "display"}),
    (MOVE, {"play_seconds": 0.0}),
    (MOVE, {"observation": "pixels"}),
    (MOVE, {"observation": "pixels", "knowledge": "black-box"}),
    (SCENE, {"observation": "pixels"}),
    (MOVE, {"observation": "headset"}),
    (SCENE, {"observation": "headset", "knowledge": "black-box"}),
    (MOVE, {"update": "live", "moves": 2}),
    (HAND, {"update": "live", "hand_seconds": 2.0}),
    (MOVE, {"render_mode": "rgb_array"}),
    (SCENE, {"scene": "H1"}),
    (SCENE, {"scene": "M2", "jitter": "hard"}),
    (SCENE, {"reward": "margin", "reid": "distance"}),
    (SCENE, {"scene": "farm", "head_noise_deg": 5.0}),
    (SCENE, {"scene": builtin_scene("L2")}),
    (DELIVER, {}),
    (DELIVER, {"chairs": None, "target": "2", "reid": "likelihood", "seconds": 4.0}),
    (DELIVER, {"scene": "pantry", "chairs": None, "shift_sd": 0.3, "render_mode": "rgb_array"}),
]
STEPS = {MOVE: 16, HAND: 16, LIFT: 16, LAYOUT: 6, SCENE: 10, DELIVER: 24}


def name_of(variant):
    name, arguments = variant
    return " ".join([name, *(f"{key}={value}" for key, value in arguments.items() if np.isscalar(value))])


@pytest.mark.parametrize("variant", VARIANTS, ids=name_of)
def test_an_environment_keeps_its_contract(variant):
    name, arguments = variant
    # The first picture of a scene takes a second, so that not all of them are looked at.
    render = (not arguments and name in STEPS) or "render_mode" in arguments
    steps = STEPS[re.sub("|".join(VARIANTS_OF_FIVE), "", name)]
    check_environment(lambda: gym.make(name, **arguments), seed=1, steps=steps, render=render)


def test_a_scene_from_a_file_keeps_the_contract_and_is_the_scene(tmp_path):
    path = tmp_path / "room.json"
    save_scene(builtin_scene("L2"), path)
    check_environment(lambda: gym.make(SCENE, scene=str(path)), steps=8, render=False)


@pytest.mark.parametrize("name", [MOVE, HAND, LAYOUT])
def test_a_game_on_a_table_of_ones_own_keeps_the_contract(name, pair):
    check_environment(lambda: gym.make(name, scene=pair), steps=8, render=False)


def test_every_registered_environment_is_among_them():
    registered = {name for name, spec in gym.registry.items() if "farm_ar" in str(spec.entry_point)}
    assert registered == {name for name, arguments in VARIANTS if not arguments}


def test_the_module_before_the_id_registers_it():
    assert gym.make("farm_ar:FarmToTable-v0").spec.id == MOVE


class Remembering(FarmToTableEnv):
    """Has attributes of its own."""

    def __init__(self, note: str) -> None:
        super().__init__(play_seconds=0.0)
        self.note, self.calls = note, 0

    def reset(self, **arguments):
        self.calls += 1
        return super().reset(**arguments)


def test_a_pickled_subclass_keeps_its_own_attributes():
    env = Remembering("mine")
    env.reset(seed=0)
    copy = pickle.loads(pickle.dumps(env))
    assert copy.note == "mine"
    assert copy.calls >= 1
    assert copy.state_hash() == env.state_hash()
