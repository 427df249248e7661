"""The belief: what a snapshot changes of it, and what makes a label wrong."""

import numpy as np
import pytest

from farm_ar.game_logic.belief import NOBODY, Belief
from farm_ar.scenes import Detections, builtin_scene


@pytest.fixture
def layout():
    return builtin_scene("farm").layout


def seen(layout, indices, shift=0.0):
    """Detections of the objects at `indices`, moved in x."""
    part = layout.subset(indices)
    return Detections(part.category, part.position + np.array([shift, 0.0]), part.yaw, part.size)


def test_at_the_start_each_label_is_held_by_its_own_object(layout):
    belief = Belief(layout)
    assert belief.holder.tolist() == list(range(len(layout)))
    assert belief.wrong_labels == 0


def test_a_label_takes_over_the_pose_and_the_holder_of_its_detection(layout):
    belief = Belief(layout)
    changed = belief.read(["blue-coop"], seen(layout, [0], 0.1), [0])
    blue = layout.index("blue-coop")
    assert np.flatnonzero(changed).tolist() == [blue]
    np.testing.assert_array_equal(belief.layout.position[blue], layout.position[0] + [0.1, 0.0])
    assert belief.holder[blue] == 0


def test_two_labels_on_each_others_objects_are_two_wrong_labels(layout):
    belief = Belief(layout)
    belief.read(["blue-coop", "yellow-coop"], seen(layout, [0, 1]), [0, 1])
    assert belief.wrong_labels == 2
    assert layout.labels[0] == "yellow-coop"


def test_a_label_that_is_not_in_the_snapshot_keeps_its_holder_and_its_place(layout):
    belief = Belief(layout)
    belief.read(["blue-coop"], seen(layout, [0]), [0])
    belief.read(["red-coop"], seen(layout, [2], 0.05), [2])
    blue = layout.index("blue-coop")
    assert belief.wrong[blue]
    np.testing.assert_array_equal(belief.layout.position[blue], layout.position[0])


def test_a_wrong_label_is_right_again_when_it_is_read_from_its_own_object(layout):
    belief = Belief(layout)
    belief.read(["blue-coop"], seen(layout, [0]), [0])
    blue = layout.index("blue-coop")
    belief.read(["blue-coop"], seen(layout, [blue]), [blue])
    assert belief.wrong_labels == 0


def test_a_label_read_from_a_false_detection_is_wrong_and_held_by_nobody(layout):
    belief = Belief(layout)
    belief.read(["blue-coop"], seen(layout, [0], 0.3), [NOBODY])
    assert belief.holder[layout.index("blue-coop")] == NOBODY
    assert belief.wrong_labels == 1


def test_a_detection_without_a_label_changes_nothing(layout):
    belief = Belief(layout)
    assert not belief.read([None], seen(layout, [0], 0.2), [0]).any()
    assert belief.wrong_labels == 0


def test_what_never_moves_keeps_its_place(layout):
    belief = Belief(layout)
    shed = layout.index("shed")
    assert not belief.read(["shed"], seen(layout, [shed], 0.02), [shed]).any()


def test_errors_are_counted_against_each_labels_own_object(layout):
    belief = Belief(layout)
    moved = layout.position.copy()
    moved[3] += [0.03, 0.04]
    turned = layout.yaw.copy()
    turned[4] += 2 * np.pi - 0.1
    truth = layout.with_poses(moved, turned)
    assert belief.endpoint_error(truth)[3] == pytest.approx(0.05)
    assert belief.heading_error(truth)[4] == pytest.approx(0.1)
    assert belief.endpoint_error(truth).sum() == pytest.approx(0.05)
