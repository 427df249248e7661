"""The parts of a state observation."""

import numpy as np
import pytest

from farm_ar.envs.features import Features, part_shapes, parts_of
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
