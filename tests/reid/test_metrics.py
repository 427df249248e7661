import numpy as np
import pytest

from farm_ar.errors import SnapshotError
from farm_ar.reid import Identification, accuracy, batch_accuracy
from farm_ar.scenes import UNKNOWN


def test_accuracy_is_the_share_of_correct_labels() -> None:
    found = Identification(("a", "b", "c", "d"))
    assert accuracy(found, ("a", "c", "c", "d")) == 0.75


def test_a_detection_left_unidentified_is_wrong_unless_it_was_false() -> None:
    found = Identification(("a", None, None, "d"))
    assert accuracy(found, ("a", "b", None, None)) == 0.5


def test_accuracy_of_nothing_is_not_a_number() -> None:
    assert np.isnan(accuracy(Identification(()), ()))


def test_accuracy_wants_one_true_label_for_each_detection() -> None:
    with pytest.raises(SnapshotError, match=r"^truth: must have 2 labels, got 1$"):
        accuracy(Identification(("a", "b")), ("a",))


def test_batch_accuracy_ignores_what_stands_beyond_the_count() -> None:
    label = np.array([[3, 1, 2], [0, 1, 2], [5, 5, 5]])
    truth = np.array([[3, 2, 2], [0, 1, 7], [5, 5, 5]])
    found = batch_accuracy(label, truth, np.array([3, 2, 0]))
    np.testing.assert_array_equal(found, [2 / 3, 1.0, np.nan])


def test_batch_accuracy_counts_false_detections_as_accuracy_does() -> None:
    label, truth = np.array([[4, UNKNOWN, UNKNOWN]]), np.array([[4, UNKNOWN, 1]])
    assert batch_accuracy(label, truth, np.array([3]))[0] == pytest.approx(2 / 3)


def test_batch_accuracy_keeps_all_batch_dimensions(rng: np.random.Generator) -> None:
    label, truth = rng.integers(0, 3, (2, 2, 4, 5))
    count = rng.integers(1, 6, (2, 4))
    found = batch_accuracy(label, truth, count)
    for b in np.ndindex(2, 4):
        n = count[b]
        assert found[b] == np.mean(label[b][:n] == truth[b][:n])
