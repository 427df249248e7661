import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from farm_ar.arrays import FloatArray
from farm_ar.drawing import place_labels

PAGE = np.array([0.0, 0.0, 400.0, 300.0])


def place(anchor: FloatArray, size: FloatArray, half: float = 5.0, on_object: bool = False) -> FloatArray:
    """Centres of labels whose objects are squares and the only obstacles."""
    anchor, size = np.asarray(anchor, dtype=float), np.asarray(size, dtype=float)
    return place_labels(
        anchor,
        size,
        np.full_like(anchor, half),
        anchor if on_object else np.full_like(anchor, np.nan),
        PAGE,
        np.concatenate([anchor - half, anchor + half], axis=1),
        np.zeros(len(anchor)),
    )


def overlap(centre: FloatArray, size: FloatArray, other: FloatArray, other_size: FloatArray) -> FloatArray:
    """Area that boxes share, broadcasting."""
    depth = (np.asarray(size) + other_size) / 2 - np.abs(np.asarray(centre) - other)
    return np.prod(np.maximum(depth, 0.0), axis=-1)


def shared_by_pairs(centre: FloatArray, size: FloatArray) -> FloatArray:
    area = overlap(centre[:, None], size[:, None], centre, size)
    return area[np.triu_indices(len(centre), 1)]


@given(
    anchor=arrays(np.float64, (10, 2), elements=st.floats(20, 280)),
    size=arrays(np.float64, (10, 2), elements=st.floats(6, 40)),
)
def test_labels_overlap_neither_each_other_nor_the_edge_of_the_page(
    anchor: FloatArray, size: FloatArray
) -> None:
    centre = place(anchor, size)
    assert shared_by_pairs(centre, size).max() < 1e-6
    assert np.all(centre - size / 2 >= PAGE[:2] - 1e-9)
    assert np.all(centre + size / 2 <= PAGE[2:] + 1e-9)


def test_forty_labels_of_one_place_are_pulled_apart() -> None:
    size = np.tile([24.0, 9.0], (40, 1))
    centre = place(np.tile([200.0, 150.0], (40, 1)), size)
    assert shared_by_pairs(centre, size).max() == 0.0


def test_a_label_alone_stands_right_beside_what_it_names() -> None:
    (centre,) = place([[200.0, 150.0]], [[30.0, 10.0]])
    np.testing.assert_allclose(centre, [220.0, 150.0])


def test_a_label_that_may_stands_on_what_it_names() -> None:
    np.testing.assert_allclose(place([[200.0, 150.0]], [[30.0, 10.0]], on_object=True), [[200.0, 150.0]])


def test_a_label_leaves_its_object_when_something_lies_on_it() -> None:
    anchor, size = np.array([[200.0, 150.0]]), np.array([[12.0, 10.0]])
    lid = np.array([[190.0, 140.0, 210.0, 160.0]])
    obstacles = np.vstack([lid, lid])
    half = np.full((1, 2), 10.0)
    under = place_labels(anchor, size, half, anchor, PAGE, obstacles, np.array([0.0, 1.0]))
    above = place_labels(anchor, size, half, anchor, PAGE, obstacles, np.array([0.0, -1.0]))
    assert overlap(under, size, anchor, 2 * half).max() < 1e-6
    np.testing.assert_array_equal(above, anchor)


def test_a_label_moves_within_a_large_object_to_clear_a_mark_on_it() -> None:
    anchor, size, half = np.array([[200.0, 150.0]]), np.array([[12.0, 10.0]]), np.full((1, 2), 50.0)
    obstacles = np.array([[150.0, 100.0, 250.0, 200.0], [198.0, 148.0, 202.0, 152.0]])
    centre = place_labels(anchor, size, half, anchor, PAGE, obstacles, np.array([0.0, 1.0]))
    assert overlap(centre, size, [200.0, 150.0], [4.0, 4.0]).max() == 0.0
    assert np.all(np.abs(centre - anchor) + size / 2 <= half)


def test_a_label_avoids_other_objects_when_there_is_room_elsewhere() -> None:
    anchor = np.array([[200.0, 150.0], [212.0, 150.0]])
    size = np.full((2, 2), 8.0)
    centre = place(anchor, size)
    assert overlap(centre[:, None], size[:, None], anchor, np.full(2, 10.0)).max() < 1e-6


def test_there_may_be_no_labels() -> None:
    assert place(np.empty((0, 2)), np.empty((0, 2))).shape == (0, 2)
