"""The parts of a state observation."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.features import Features, part_shapes, parts_of
from farm_ar.reid import dimension_cost, rotation_cost, total_cost, translation_cost
from farm_ar.reid.assignment import margins, solve_assignment
from farm_ar.scenes import builtin_scene


@pytest.mark.parametrize("name", ["farm", "L1"])
@pytest.mark.parametrize("tell_apart", [parts_of, parts_of.py_func], ids=["compiled", "plain"])
def test_the_parts_lie_one_after_the_other_in_the_order_of_their_shapes(name, tell_apart):
    layout = builtin_scene(name).layout
    shapes = part_shapes(layout)
    numbers = np.arange(sum(int(np.prod(shape)) for shape in shapes.values()), dtype=np.float32)
    parts = tell_apart(numbers, *shapes["category"], shapes["cost"][1])
    assert {field: part.shape for field, part in parts._asdict().items()} == shapes
    np.testing.assert_array_equal(np.concatenate([part.reshape(-1) for part in parts]), numbers)
    assert all(np.shares_memory(part, numbers) for part in parts)


def test_parts_are_views_of_all_numbers():
    features = Features(builtin_scene("farm"))
    features.parts.budget[:] = 0.25, 0.5, 0.75, 1.0
    assert features.numbers.sum() == 2.5


def test_costs_and_margins_of_objects_of_several_sizes_are_the_papers_at_every_step():
    farm = builtin_scene("farm")
    size = farm.layout.size * np.linspace(1.0, 1.4, len(farm.layout))[:, None]
    scene = replace(farm, layout=replace(farm.layout, size=size))
    env = FarmToTableEnv(scene=scene, moves=4, visits=2)
    env.action_space.seed(3)
    observation, _ = env.reset(seed=3)
    order, code, over = env._order, scene.layout.category_code, False
    while not over:
        truth, believed, weights = env.world.truth, env.world.tracker.belief.layout, scene.cost_weights
        cost = total_cost(
            translation_cost(truth.position, believed.position, scene.diagonal),
            rotation_cost(truth.yaw, believed.yaw),
            dimension_cost(size, size),
            weights.translation,
            weights.rotation,
        )
        seen = np.flatnonzero(env.view.in_view)
        gated = np.where(code[seen, None] == code, cost[seen], np.inf)
        margin = dict(zip(seen.tolist(), margins(gated, solve_assignment(gated)), strict=True))
        for row, i in enumerate(order.tolist()):
            rivals = [j for j in order if code[j] == code[i]]
            observed = observation["cost"].reshape(len(order), -1)[row, : len(rivals)]
            np.testing.assert_allclose(observed, np.minimum(cost[i, rivals], 2), atol=1e-6)
            expected = min(margin.get(i, 1.0) / 0.3, 1.0)
            assert observation["margin"][row] == pytest.approx(expected, abs=1e-5)
        observation, _, over, _, _ = env.step(env.action_space.sample())
