from collections.abc import Callable

import gymnasium as gym
import numpy as np
import pytest

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.envs import FarmToTableEnv
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.scenes import Camera, CameraPath, FieldOfView, Layout, Scene, Weights

Drive = Callable[..., list[dict]]


@pytest.fixture
def pair() -> Scene:
    """Two coops 10 cm apart and a shed, on a table whose diagonal is 1 m: a metre costs 1.

    Without the game, its camera always sees all of it.
    """
    layout = Layout(
        labels=("left-coop", "right-coop", "shed"),
        category=("coop", "coop", "shed"),
        position=np.array([[0.25, 0.3], [0.35, 0.3], [0.3, 0.5]]),
        yaw=np.array([0.0, 0.0, np.pi]),
        size=np.array([[0.05, 0.05, 0.05], [0.05, 0.05, 0.05], [0.1, 0.1, 0.1]]),
        fixed=np.array([False, False, True]),
    )
    path = CameraPath(np.linspace([0.3, -2.0], [0.3, -1.9], 4))
    everything = FieldOfView(np.pi / 2, np.pi / 2, 9.0)
    return Scene("pair", (0.6, 0.8), layout, camera_path=path, fov=everything, weights=Weights(1.0, 1.0))


@pytest.fixture
def left_only() -> Camera:
    """Sees the left coop of the pair only."""
    return Camera(np.array([0.0, 0.3]), np.array(np.pi / 2), FieldOfView(0.3, 0.3, 0.3))


@pytest.fixture
def plain(pair: Scene) -> Callable[..., FarmToTableEnv]:
    """Makes the pair without game and jitter, a step a visit, with as good as no budget."""

    def make(**arguments: object) -> FarmToTableEnv:
        given = {"control": "layout", "game": False, "jitter": "none", "budget": 9.0} | arguments
        return FarmToTableEnv(scene=pair, **given)

    return make


@pytest.fixture
def offsets() -> Callable[..., np.ndarray]:
    """Makes an action of metres for the left and the right coop of the pair."""

    def make(left: tuple[float, float] = (0, 0), right: tuple[float, float] = (0, 0)) -> np.ndarray:
        # 1 means 0.15 m on the farm's table, and as much less as the diagonal is shorter.
        reach = 0.15 / float(np.hypot(1.2, 0.8))
        return np.array([*left, 0, *right, 0], dtype=np.float32) / np.float32(reach)

    return make


@pytest.fixture
def straight_on() -> Camera:
    """Looks from behind the near edge at the middle of the farm's table."""
    return look_at(np.array([0.6, -0.3]), np.array([0.6, 0.4]), field_of_view("photo"))


@pytest.fixture
def drive() -> Drive:
    """Steers the hand to a point of the table, open or closed; gives the infos of the steps it took."""

    def steer(
        env: gym.Env, goal: tuple[float, float], grip: bool, speed: float = 1.5, most: int = 60
    ) -> list[dict]:
        infos: list[dict] = []
        tabletop = env.unwrapped.world.tabletop
        while len(infos) < most:
            hand = tabletop.hand
            if hand is None:
                break
            way = np.asarray(goal) - hand.position
            if np.linalg.norm(way) < 0.005:
                break
            velocity = way * min(speed / np.linalg.norm(way), 1 / 0.1)
            action = [*(velocity / 1.5), 0.0, 1.0 if grip else -1.0]
            *_, over, _, info = env.step(np.array(action, dtype=np.float32))
            infos.append(info)
            if over:
                break
        return infos

    return steer
