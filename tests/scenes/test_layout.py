"""Layouts: what stood where."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import SceneError
from farm_ar.scenes import Layout

PARTS = ("position", "yaw", "size", "elevation", "fixed")


def values(n: int = 3, batch: tuple[int, ...] = ()) -> dict[str, Any]:
    rng = np.random.default_rng(n)
    return {
        "labels": tuple(f"label {i}" for i in range(n)),
        "category": tuple("cab"[i % 3] for i in range(n)),
        "position": rng.random((*batch, n, 2)),
        "yaw": rng.random((*batch, n)),
        "size": 0.1 + rng.random((n, 3)),
        "elevation": rng.random(n),
        "fixed": np.arange(n) % 2 == 1,
    }


def test_a_layout_keeps_what_it_was_made_of():
    given_values = values()
    layout = Layout(**given_values)
    assert len(layout) == 3
    assert layout.labels == given_values["labels"]
    assert layout.category == given_values["category"]
    for name in PARTS:
        np.testing.assert_array_equal(getattr(layout, name), given_values[name])


def test_objects_stand_on_the_floor_and_can_be_moved_unless_said_otherwise():
    given_values = values()
    del given_values["elevation"], given_values["fixed"]
    layout = Layout(**given_values)
    np.testing.assert_array_equal(layout.elevation, np.zeros(3))
    assert layout.movable.all()
    assert not layout.fixed.any()


def test_no_array_of_a_layout_can_be_written_to():
    layout = Layout(**values())
    for name in (*PARTS, "category_code", "movable"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(layout, name)[...] = 0


def test_a_layout_does_not_follow_later_changes_of_what_it_was_made_of():
    given_values = values()
    layout = Layout(**given_values)
    before = layout.position.copy()
    given_values["position"][:] = 7.0
    np.testing.assert_array_equal(layout.position, before)


def test_category_codes_index_the_sorted_categories():
    layout = Layout(**values(5))
    assert layout.categories == ("a", "b", "c")
    assert tuple(layout.categories[code] for code in layout.category_code) == layout.category


def test_movable_is_what_is_not_fixed():
    np.testing.assert_array_equal(Layout(**values()).movable, [True, False, True])


def test_only_the_poses_carry_the_batch_dimensions():
    layout = Layout(**values(3, batch=(4, 2)))
    assert layout.batch_shape == (4, 2)
    assert len(layout) == 3
    assert layout.size.shape == (3, 3)
    assert Layout(**values()).batch_shape == ()


def test_other_poses_may_be_a_batch_and_leave_everything_else():
    layout = Layout(**values())
    moved = layout.with_poses(np.ones((6, 3, 2)), np.zeros((6, 3)).tolist())
    assert moved.batch_shape == (6,)
    np.testing.assert_array_equal(moved.position, np.ones((6, 3, 2)))
    assert (moved.labels, moved.category) == (layout.labels, layout.category)
    for name in ("size", "elevation", "fixed"):
        np.testing.assert_array_equal(getattr(moved, name), getattr(layout, name))


def test_poses_for_another_number_of_objects_are_refused():
    with pytest.raises(SceneError, match="position, yaw"):
        Layout(**values()).with_poses(np.zeros((4, 2)), np.zeros(4))


@given(st.permutations(range(5)), st.integers(0, 5), st.sampled_from([(), (4,), (2, 3)]))
def test_a_subset_has_the_chosen_objects_in_the_order_asked_for(order, count, batch):
    layout = Layout(**values(5, batch))
    chosen = list(order)[:count]
    part = layout.subset(chosen)
    assert part.labels == tuple(layout.labels[i] for i in chosen)
    assert part.category == tuple(layout.category[i] for i in chosen)
    assert part.batch_shape == batch
    for new, old in enumerate(chosen):
        np.testing.assert_array_equal(part.position[..., new, :], layout.position[..., old, :])
        np.testing.assert_array_equal(part.yaw[..., new], layout.yaw[..., old])
        for name in ("size", "elevation", "fixed"):
            np.testing.assert_array_equal(getattr(part, name)[new], getattr(layout, name)[old])


def test_a_subset_may_be_chosen_by_a_mask():
    layout = Layout(**values())
    assert layout.subset(np.array([False, True, True])).labels == ("label 1", "label 2")
    assert layout.subset(np.zeros(3, dtype=bool)).labels == ()


def test_a_subset_beyond_the_objects_is_an_index_error():
    with pytest.raises(IndexError):
        Layout(**values()).subset([3])


def test_a_layout_may_have_no_objects():
    layout = Layout((), (), [], [], [])
    assert len(layout) == 0
    assert layout.position.shape == (0, 2)
    assert layout.size.shape == (0, 3)
    assert layout.categories == ()
    assert layout.category_code.shape == (0,)
    assert layout.batch_shape == ()
    assert len(layout.subset([])) == 0
    assert layout.with_poses(np.zeros((5, 0, 2)), np.zeros((5, 0))).batch_shape == (5,)


def test_a_label_is_found_by_its_name():
    assert Layout(**values()).index("label 2") == 2


def test_an_unknown_label_is_refused_with_the_known_ones():
    with pytest.raises(SceneError, match=r"label: must be one of label 0, label 1, label 2, got 'chair'"):
        Layout(**values()).index("chair")


@pytest.mark.parametrize(
    "again", [copy.copy, copy.deepcopy, lambda layout: pickle.loads(pickle.dumps(layout))]
)
def test_a_copied_or_pickled_layout_is_the_same_and_still_read_only(again):
    layout = Layout(**values(3, batch=(2,)))
    other = again(layout)
    assert (other.labels, other.category) == (layout.labels, layout.category)
    for name in PARTS:
        np.testing.assert_array_equal(getattr(other, name), getattr(layout, name))
        assert not getattr(other, name).flags.writeable


def changed(name: str, index: Any, value: Any) -> Any:
    array = values()[name].copy()
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("labels", ("a", "b", "a"), r"labels\[2\]: must not repeat an earlier label, got 'a'"),
        ("labels", ("a", "", "b"), r"labels\[1\]: must be a non-empty string of Unicode, got ''"),
        ("labels", ("a", 7, "b"), r"labels\[1\]: must be a non-empty string of Unicode, got 7"),
        ("category", ("a", "b"), r"category: must have one entry per label \(3\), got 2"),
        ("category", ("a", "", "b"), r"category\[1\]: must be a non-empty string of Unicode, got ''"),
        ("category", ("a", None, "b"), r"category\[1\]: must be a non-empty string of Unicode, got None"),
        ("position", np.zeros((3, 3)), r"position, yaw: must have shapes \(..., 3, 2\) and \(..., 3\)"),
        ("position", np.zeros((2, 3, 2)), "position, yaw: must have shapes"),
        ("yaw", np.zeros(4), "position, yaw: must have shapes"),
        ("yaw", 0.0, "position, yaw: must have shapes"),
        (
            "position",
            changed("position", (1, 0), np.nan),
            r"position\[1, 0\]: must be finite, from -1e6 to 1e6 metres, got nan",
        ),
        ("yaw", changed("yaw", 2, np.inf), r"yaw\[2\]: must be finite, at most 1e6 turns, got inf"),
        (
            "elevation",
            changed("elevation", 0, -np.inf),
            r"elevation\[0\]: must be finite, from -1e6 to 1e6 metres, got -inf",
        ),
        ("elevation", np.zeros(2), r"elevation: must have shape \(3,\), got \(2,\)"),
        ("fixed", np.zeros(2, dtype=bool), r"fixed: must have shape \(3,\), got \(2,\)"),
        (
            "size",
            changed("size", (0, 2), 0.0),
            r"size\[0, 2\]: must be positive metres, from 1e-6 to 1e6, got 0.0",
        ),
        (
            "size",
            changed("size", (2, 1), -1.0),
            r"size\[2, 1\]: must be positive metres, from 1e-6 to 1e6, got -1.0",
        ),
        (
            "size",
            changed("size", (1, 1), np.nan),
            r"size\[1, 1\]: must be positive metres, from 1e-6 to 1e6, got nan",
        ),
        (
            "size",
            changed("size", (1, 1), np.inf),
            r"size\[1, 1\]: must be positive metres, from 1e-6 to 1e6, got inf",
        ),
        ("size", np.ones((3, 2)), r"size: must have shape \(3, 3\), got \(3, 2\)"),
        ("size", np.ones((5, 3, 3)), r"size: must have shape \(3, 3\), got \(5, 3, 3\)"),
    ],
)
def test_a_layout_that_cannot_be_is_refused_by_the_name_of_its_field(name, value, message):
    with pytest.raises(SceneError, match=message):
        Layout(**values() | {name: value})


def test_placed_elsewhere_it_is_what_other_poses_make_of_it_and_read_only():
    layout = Layout(**values())
    assert layout.categories  # worked out, and taken along
    position, yaw = np.random.default_rng(9).random((3, 2)), np.zeros(3)
    placed, checked = layout.placed(position, yaw), layout.with_poses(position, yaw)
    for part in (*PARTS, "category_code", "movable"):
        np.testing.assert_array_equal(getattr(placed, part), getattr(checked, part))
    assert (placed.labels, placed.category) == (checked.labels, checked.category)
    assert not placed.position.flags.writeable
    assert not placed.yaw.flags.writeable
    np.testing.assert_array_equal(layout.position, values()["position"])
    assert pickle.loads(pickle.dumps(placed)).labels == layout.labels
