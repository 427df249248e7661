from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from farm_ar.reid import site_distance, site_probability, sites_by_probability, within_site
from farm_ar.reid.pruning import sites_kept
from farm_ar.scenes import Scene, load_scene

CAMERA = np.array([2.408, 3.759])
"""Where the paper's Table 3 and Figs. 6 and 8 were taken, in H1."""
TABLE_3 = {
    "S6": 0.214,
    "S3": 0.150,
    "S10": 0.129,
    "S9": 0.110,
    "S2": 0.109,
    "S4": 0.080,
    "S7": 0.076,
    "S1": 0.067,
    "S8": 0.065,
}
# Seen from (0, 0): 1, 2 and 4 m away, so that the probabilities are 1, 2/3 and 1/3.
SITES = np.array([[0.0, 4.0], [1.0, 0.0], [0.0, -2.0]])
ORIGIN = np.zeros(2)


@pytest.fixture(scope="module")
def h1(paper_scenes: Path) -> Scene:
    return load_scene(paper_scenes / "H1.json")


def kept_sites(scene: Scene, threshold: float) -> list[str]:
    order, kept = sites_by_probability(CAMERA, scene.site_positions, threshold)
    return [scene.sites[s].name for s in order[:kept]]


def compiled(camera: np.ndarray, sites: np.ndarray, threshold: float) -> tuple[list[int], int]:
    order = np.zeros(len(sites), dtype=np.int64)
    kept = sites_kept(camera, sites, threshold, order)
    return order.tolist(), kept


def test_site_distance_is_the_distance_to_the_centre() -> None:
    np.testing.assert_allclose(site_distance(ORIGIN, SITES), [4.0, 1.0, 2.0])
    np.testing.assert_allclose(site_distance(np.array([3.0, 0.0]), SITES), [5.0, 2.0, np.sqrt(13.0)])


def test_the_camera_is_within_the_nearest_site_only() -> None:
    assert within_site(ORIGIN, SITES).tolist() == [False, True, False]


def test_a_camera_on_a_border_is_within_one_site() -> None:
    assert within_site(ORIGIN, np.array([[2.0, 0.0], [0.0, 2.0], [3.0, 0.0]])).tolist() == [
        True,
        False,
        False,
    ]


def test_the_own_site_is_certain_and_the_others_share_by_closeness() -> None:
    # 1/4 and 1/2 of a total of 3/4; the own site's 1/1 is left out of it.
    np.testing.assert_allclose(site_probability(ORIGIN, SITES), [1 / 3, 1.0, 2 / 3])


def test_a_camera_exactly_on_a_site_is_in_it() -> None:
    sites = np.array([[0.0, 0.0], [3.0, 4.0], [0.0, 10.0]])
    np.testing.assert_allclose(site_probability(ORIGIN, sites), [1.0, 2 / 3, 1 / 3])
    assert sites_by_probability(ORIGIN, sites, 0.5)[0].tolist() == [0, 1, 2]
    assert compiled(ORIGIN, sites, 0.5) == ([0, 1, 2], 2)


def test_a_single_site_is_certain_and_kept_at_any_threshold() -> None:
    for threshold in (0.0, 0.3, 1.0):
        order, kept = sites_by_probability(ORIGIN, SITES[:1], threshold)
        assert (order.tolist(), int(kept)) == ([0], 1)
        assert compiled(ORIGIN, SITES[:1], threshold) == ([0], 1)
    assert site_probability(ORIGIN, SITES[:1]).tolist() == [1.0]


def test_cameras_in_a_batch_are_treated_one_by_one(rng: np.random.Generator) -> None:
    cameras = rng.uniform(-3, 3, (5, 4, 2))
    probability = site_probability(cameras, SITES)
    order, kept = sites_by_probability(cameras, SITES, 0.6)
    assert probability.shape == order.shape == (5, 4, 3)
    for b in np.ndindex(5, 4):
        np.testing.assert_allclose(probability[b], site_probability(cameras[b], SITES))
        np.testing.assert_array_equal(within_site(cameras, SITES)[b], within_site(cameras[b], SITES))
        alone = sites_by_probability(cameras[b], SITES, 0.6)
        assert (order[b].tolist(), kept[b]) == (alone[0].tolist(), alone[1])
    assert sites_by_probability(cameras, SITES, 1.0)[1].tolist() == [[3] * 4] * 5


def test_table_3_to_three_decimals(h1: Scene) -> None:
    probability = site_probability(CAMERA, h1.site_positions)
    found = {site.name: round(float(p), 3) for site, p in zip(h1.sites, probability, strict=True)}
    assert found == {"S5": 1.0} | TABLE_3


def test_table_3_gives_the_order_of_the_sites(h1: Scene) -> None:
    assert kept_sites(h1, 1.0) == ["S5", *TABLE_3]


def test_threshold_0_keeps_only_the_site_of_the_camera(h1: Scene) -> None:
    assert kept_sites(h1, 0.0) == ["S5"]


@pytest.mark.parametrize("threshold", [0.50, 0.55, 0.60])
def test_the_thresholds_of_fig_8_keep_five_sites(h1: Scene, threshold: float) -> None:
    assert kept_sites(h1, threshold) == ["S5", "S6", "S3", "S10", "S9"]


# The cumulative probabilities of Table 3, with the threshold just below or above them.
@pytest.mark.parametrize(
    ("threshold", "count"),
    [(0.001, 2), (0.213, 2), (0.215, 3), (0.36, 3), (0.37, 4), (0.61, 6), (0.94, 10), (1.0, 10)],
)
def test_sites_join_until_the_sum_first_reaches_the_threshold(
    h1: Scene, threshold: float, count: int
) -> None:
    assert len(kept_sites(h1, threshold)) == count


@pytest.mark.parametrize("others", [3, 6, 7, 10, 20])
def test_a_sum_that_reaches_the_threshold_exactly_is_enough_in_spite_of_rounding(others: int) -> None:
    # `others` sites on a circle: after j of them the sum is j / others, give or take rounding.
    angle = np.arange(others) * 2 * np.pi / others
    sites = np.vstack([[[0.1, 0.0]], 5 * np.stack([np.sin(angle), np.cos(angle)], axis=-1)])
    for j in range(others):
        _, kept = sites_by_probability(ORIGIN, sites, j / others)
        assert (kept, compiled(ORIGIN, sites, j / others)[1]) == (1 + j, 1 + j)


def test_equally_likely_sites_join_in_their_own_order() -> None:
    sites = np.array([[3.0, 0.0], [0.0, 3.0], [1.0, 0.0], [0.0, -3.0], [-3.0, 0.0]])
    assert sites_by_probability(ORIGIN, sites, 0.5)[0].tolist() == [2, 0, 1, 3, 4]
    assert compiled(ORIGIN, sites, 0.5)[0] == [2, 0, 1, 3, 4]


coordinate = st.integers(-4, 4).map(float)  # so that sites at equal distances and on the camera occur
places = st.tuples(coordinate, coordinate)


@given(places, st.lists(places, min_size=1, max_size=8, unique=True), st.integers(0, 12))
def test_the_compiled_order_and_number_are_those_of_numpy(
    camera: tuple[float, float], sites: list[tuple[float, float]], twelfths: int
) -> None:
    here, there, threshold = np.array(camera), np.array(sites), twelfths / 12
    order, kept = sites_by_probability(here, there, threshold)
    expected = (order.tolist(), int(kept))
    assert compiled(here, there, threshold) == expected
    in_python = np.zeros(len(there), dtype=np.int64)
    assert sites_kept.py_func(here, there, threshold, in_python) == kept
    assert in_python.tolist() == order.tolist()


@given(places, st.lists(places, min_size=2, max_size=8, unique=True), st.floats(0.001, 0.999))
def test_what_is_kept_is_the_least_that_reaches_the_threshold(
    camera: tuple[float, float], sites: list[tuple[float, float]], threshold: float
) -> None:
    here, there = np.array(camera), np.array(sites)
    probability = site_probability(here, there)
    order, kept = sites_by_probability(here, there, threshold)
    assert np.all(np.diff(probability[order[1:]]) <= 1e-12)
    total = np.cumsum(probability[order[1:]])
    assume(np.abs(total - threshold).min() > 1e-9)
    assert kept == 2 + np.count_nonzero(total < threshold)
