"""Deliveries: what the robot is told, when it changes its goal, and to whom it delivers."""

import gymnasium as gym
import numpy as np
import pytest

from farm_ar.envs.delivery import Courier, DeliverToChairEnv
from farm_ar.envs.delivery.robot import MOST_M_S, MOST_RAD_S
from farm_ar.errors import OptionError
from farm_ar.scenes import builtin_scene

LAB = builtin_scene("lab").layout.subset([3, 4, 5, 6])
SWAPPED = {"position": LAB.position[[1, 0, 2, 3]], "yaw": LAB.yaw[[1, 0, 2, 3]]}
"""Chairs 4 and 5 have changed places; nothing tells it."""

TURNED = {"position": LAB.position - np.array([0.0, 0.25]), "yaw": LAB.yaw + np.array([0.4, -0.5, 0.3, 0.6])}
"""All four were moved a little: any method finds them."""


def played(courier, options, **arguments):
    env = DeliverToChairEnv(**arguments)
    env.reset(seed=0, options=options)
    while True:
        twist, hand_over = courier.act(env.delivery.knowledge())
        action = np.array([twist.ahead / MOST_M_S, twist.left / MOST_RAD_S, 1.0 if hand_over else -1.0])
        _, reward, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            return env, reward, info


@pytest.mark.parametrize("reid", ["spatial", "likelihood"])
def test_the_right_chair_gets_it_and_nothing_is_touched(reid):
    env, reward, info = played(Courier(), {"layout": TURNED, "robot": (5.2, 0.8, -0.9)}, reid=reid)
    assert (info["right"], info["wrong"], info["touches"]) == (1, 0, 0)
    assert reward == pytest.approx(1 - 0.01 * 0.2)
    assert env.delivery.shortest() * 0.9 < info["path_m"] < env.delivery.shortest() * 1.6


def test_when_the_target_is_identified_elsewhere_the_goal_is_cancelled_for_a_new_one():
    courier = Courier()
    env, _, info = played(courier, {"layout": TURNED, "robot": (0.6, 4.4, 0.0)})
    first, *_, last = courier.goals
    assert (first.kind, last.kind) == ("last known", "target")
    assert np.allclose(first.place, LAB.position[0])
    assert np.linalg.norm(last.place - env.delivery.layout.position[0]) < 0.15
    assert last.seconds > first.seconds
    assert info["right"] == 1


def test_two_chairs_that_changed_places_fool_every_method():
    _, reward, info = played(Courier(), {"layout": SWAPPED, "robot": (3.0, 0.5, 0.0)})
    assert info["wrong"] == 1
    assert reward < -0.9


def test_the_naive_robot_delivers_to_what_stands_where_the_target_was():
    moved = {"position": LAB.position.copy(), "yaw": LAB.yaw}
    moved["position"][0] = (1.0, 1.0)  # chair 4 has gone far away, chair 5 stands in its place
    moved["position"][1] = LAB.position[0] + [0.1, 0.0]
    env, _, info = played(Courier(naive=True), {"layout": moved, "robot": (3.0, 0.4, 0.0)}, reid="last-known")
    assert info["wrong"] == 1
    assert env.delivery.delivered == 1


def test_it_looks_once_a_second_and_fuses_what_it_sees():
    env = DeliverToChairEnv()
    env.reset(seed=0, options={"layout": TURNED, "robot": (3.0, 0.4, 0.0)})
    for _ in range(25):
        env.step(np.array([0.0, 1.0, -1.0]))
    assert env.delivery.looks == 1 + 5
    assert len(env.delivery.tracking.objects) <= 4  # each chair once, however often it was seen
    assert len(env.delivery.snapshots) > 1


def test_a_delivery_goes_to_the_chair_ahead_and_only_within_reach():
    env = DeliverToChairEnv()
    env.reset(seed=0, options={"layout": LAB, "robot": (3.0, 0.4, np.pi)})
    *_, terminated, _, info = env.step(np.array([0.0, 0.0, 1.0]))
    assert not terminated  # the chair stands 0.89 m away
    assert (info["right"], info["wrong"]) == (0, 0)
    env.reset(seed=0, options={"layout": LAB, "robot": (3.0, 0.7, 0.0)})
    *_, terminated, _, info = env.step(np.array([0.0, 0.0, 1.0]))
    assert terminated
    assert info["right"] == 1


def test_time_runs_out():
    env = DeliverToChairEnv(seconds=1.0)
    env.reset(seed=0)
    ends = [env.step(np.array([0.0, 0.1, -1.0]))[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(3))


def test_what_the_robot_knows_does_not_hang_on_what_it_cannot_see():
    far = {"position": LAB.position.copy(), "yaw": LAB.yaw}
    far["position"][2] = (0.6, 4.5)
    observations = []
    for layout in (LAB, far):  # the robot looks at the wall on the other side
        env = DeliverToChairEnv()
        observations.append(env.reset(seed=0, options={"layout": layout, "robot": (5.0, 1.0, np.pi / 2)})[0])
    assert all(np.array_equal(observations[0][name], observations[1][name]) for name in observations[0])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"target": "1"}, "target"),
        ({"chairs": ["4", "x"]}, "chairs"),
        ({"chairs": "4"}, "chairs"),
        ({"reid": "none"}, "reid"),
        ({"shift_sd": -1.0}, "shift_sd"),
        ({"shift_sd": float("nan")}, "shift_sd"),
        ({"turn_sd_deg": True}, "turn_sd_deg"),
        ({"fov_deg": (87.0,)}, "fov_deg"),
        ({"fov_deg": (87.0, 180.0)}, "fov_deg"),
        ({"seconds": 0.0}, "seconds"),
        ({"render_mode": "human"}, "render_mode"),
    ],
)
def test_a_wrong_argument_is_named(arguments, said):
    with pytest.raises(OptionError, match=said):
        DeliverToChairEnv(**arguments)


@pytest.mark.parametrize(
    "options",
    [{"camera": 1}, {"robot": (9.0, 1.0, 0.0)}, {"robot": "here"}, {"layout": {"position": [[0, 0]]}}, [1]],
)
def test_a_wrong_option_is_refused(options):
    with pytest.raises(OptionError):
        DeliverToChairEnv().reset(options=options)
