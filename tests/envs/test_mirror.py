"""A table and its mirror image: what is observed of the one and done to it, mirrored, is the other's."""

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import MOVE_ACTIONS, Move, OffsetsAction, VelocityAction
from farm_ar.envs.observations import mirror
from farm_ar.envs.table import TableView
from farm_ar.geometry import wrap
from farm_ar.scenes import builtin_scene

FARM = builtin_scene("farm")
WIDTH = FARM.size[0]
PLACING = {**MOVE_ACTIONS, "offsets": OffsetsAction}


def pose(position, yaw, mirrored):
    position, yaw = np.array(position), np.array(yaw)
    if mirrored:
        position[..., 0], yaw = WIDTH - position[..., 0], -yaw
    return {"position": position, "yaw": yaw}


def moved(mirrored):
    """The plain farm, or its mirror image, after all objects have been moved unseen."""
    env = FarmToTableEnv(scene="farm", control="layout", game=False, budget=9.0)
    layout, rng = FARM.layout, np.random.default_rng(3)
    # A farm of its own, with no two objects as far to the right as each other.
    places = layout.position + rng.uniform(-0.02, 0.02, layout.position.shape)
    begun = pose(places, layout.yaw + rng.uniform(-0.3, 0.3, len(layout)), mirrored)
    env.reset(seed=0, options={"layout": begun, "camera": pose([0.4, -0.2], 0.4, mirrored)})
    for index in np.flatnonzero(layout.movable):
        shift, turn = rng.uniform(-0.05, 0.05, 2), float(rng.uniform(-0.4, 0.4))
        env.world.move(int(index), shift * ([-1, 1] if mirrored else [1, 1]), -turn if mirrored else turn)
    return env


@pytest.fixture(scope="module")
def pair():
    return moved(False), moved(True)


def by_object(env, observation):
    """The observation by objects in the order of the layout; costs with a column for each label."""
    order, m = env.view.order, len(FARM.layout)
    rows = {}
    for name, values in observation.items():
        if name in ("camera", "budget"):
            rows[name] = values
        elif name == "cost":
            rows[name] = np.full((m, m), np.nan)
            for i, costs in zip(order, values.reshape(m, -1), strict=True):
                rivals = [j for j in order if FARM.layout.category[j] == FARM.layout.category[i]]
                rows[name][i, rivals] = costs[: len(rivals)]
        else:
            rows[name] = np.empty((m, values.size // m))
            rows[name][order] = values.reshape(m, -1)
    return rows


def test_an_observation_in_the_mirror_is_that_of_the_mirrored_table(pair):
    here, there = pair
    seen = here.observe()
    for name in ("difference", "believed_position", "believed_heading", "heading", "camera"):
        assert np.abs(seen[name]).max() > 0.05
    assert 0 < seen["in_view"].sum() < 11
    found, wanted = by_object(here, mirror(seen)), by_object(there, there.observe())
    for name in wanted:
        np.testing.assert_allclose(found[name], wanted[name], atol=2e-6, err_msg=name)


def test_it_works_on_batches_too(pair):
    seen = pair[0].observe()
    many = mirror({name: np.stack([values, values]) for name, values in seen.items()})
    for name, values in mirror(seen).items():
        np.testing.assert_array_equal(many[name], [values, values])
        assert values.dtype == np.float32


def test_the_mirror_of_a_mirror_is_the_first():
    env = FarmToTableEnv(control="hand")
    env.reset(seed=0)
    seen, *_ = env.step(np.array([0.5, 0.7, 0.3, 1.0], dtype=np.float32))
    assert np.abs(seen["hand"][[0, 2, 4]]).min() > 0.01
    turned = mirror(seen)
    np.testing.assert_array_equal(turned["hand"], seen["hand"] * [-1, 1, -1, 1, -1, 1, 1, 1])
    for name, values in mirror(turned).items():
        np.testing.assert_array_equal(values, seen[name])


@pytest.mark.parametrize("name", PLACING)
def test_an_action_in_the_mirror_does_the_mirrored_thing(name, pair):
    here, there = pair
    view, other = here.view, there.view
    # Objects keep their numbers in the mirror; from left to right they would have others.
    other = TableView(other.scene, other.truth, other.believed, other.camera, view.order, view.movable)
    action = PLACING[name](10, 5, 1.0)
    action.space.seed(0)
    found = 0
    for _ in range(60):
        asked = action.space.sample()
        if name == "continuous":  # picks what is there
            asked[:2] = 2 * view.truth.position[view.movable[asked.tobytes()[0] % 10]] / view.size - 1
        moves, turned = action.decode(asked, view), action.decode(action.mirror(asked), other)
        assert (moves is None) == (turned is None)
        for move, theirs in zip(moves or [], turned or [], strict=True):
            assert move.index == theirs.index
            np.testing.assert_allclose(theirs.displacement, move.displacement * [-1, 1], atol=1e-6)
            assert wrap(np.array(theirs.turn + move.turn)) == pytest.approx(0, abs=1e-6)
            turns = abs(move.turn) > 0.01 or not action.reach_rad
            found += bool(abs(move.displacement[0]) > 0.01 and turns)
        np.testing.assert_array_equal(action.mirror(action.mirror(asked)), asked)
        np.testing.assert_array_equal(action.mirror(np.stack([asked, asked])), [action.mirror(asked)] * 2)
    assert found > 20


@pytest.mark.parametrize("name", ["displacement", "slot"])
def test_the_end_of_a_turn_is_its_own_mirror_image(name, pair):
    action = PLACING[name](10, 5, 1.0)
    ended = action.encode([], pair[0].view)
    np.testing.assert_array_equal(action.mirror(ended), ended)
    np.testing.assert_array_equal(action.mirror(np.stack([ended, ended])), [ended, ended])


def test_a_steered_hand_goes_the_other_way_in_the_mirror():
    action = VelocityAction()
    asked = np.array([0.5, -0.25, 1.0, 1.0], dtype=np.float32)
    vx, vz, twist, closed = action.decode(asked.tolist())
    assert action.decode(action.mirror(asked).tolist()) == (-vx, vz, -twist, closed)
    assert (vx, vz) == (0.75, -0.375)
    assert twist == pytest.approx(np.pi)


@pytest.mark.parametrize("name", PLACING)
def test_what_is_encoded_is_decoded_to_the_move_that_was_possible(name, pair):
    view = pair[0].view
    action = PLACING[name](10, 5, 1.0)
    action.space.seed(1)
    seen = [int(i) for i in view.movable if view.in_view[i]]
    rng = np.random.default_rng(0)
    assert not action.decode(action.encode([], view), view)
    for index in seen:
        move = Move(index, rng.uniform(-0.4, 0.4, 2), float(rng.uniform(-2, 2)))
        possible = action.possible(move, view)
        (found,) = action.decode(action.encode([move], view), view)
        assert found.index == possible.index == index
        np.testing.assert_allclose(found.displacement, possible.displacement, atol=1e-6)
        assert found.turn == pytest.approx(possible.turn, abs=1e-6)
        again = action.possible(possible, view)
        np.testing.assert_allclose(again.displacement, possible.displacement, atol=1e-9)
