"""The authors' program: borders of cells, which sites are kept, sizes, heights, too few labels."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.errors import OptionError
from farm_ar.geometry import nearest_site, world_box
from farm_ar.reid.spatial_unity import BorderDistances, SpatialUnityReid, border_probability, sites_kept
from farm_ar.scenes import Camera, Detections, Gaussian, Layout, LayoutNoise, Scene, Site, Snapshot, observe
from farm_ar.scenes.builtin import builtin_scene
from farm_ar.testing import check_reidentifier

SIZE = (4.0, 3.0)


def points_on_borders(sites, count=700):
    """Points of a fine grid whose two nearest sites are nearly equally near, with the two sites."""
    x, z = np.meshgrid(np.linspace(0, SIZE[0], count), np.linspace(0, SIZE[1], count))
    points = np.stack([x.ravel(), z.ravel()], axis=1)
    away = np.linalg.norm(points[:, None] - sites, axis=-1)
    first, second = np.sort(np.argsort(away, axis=1)[:, :2], axis=1).T
    ordered = np.sort(away, axis=1)
    near = ordered[:, 1] - ordered[:, 0] < 0.012
    return points[near], first[near], second[near]


@given(st.integers(0, 100_000), st.integers(2, 6))
@settings(max_examples=20, deadline=None)
def test_distances_to_borders_are_those_of_a_fine_grid(seed, count):
    rng = np.random.default_rng(seed)
    sites = rng.uniform(-0.5, 1.0, (count, 2)) * SIZE + [0.5, 0.5]
    camera = rng.uniform(0, 1, 2) * SIZE
    found = BorderDistances(sites, np.zeros(2), np.array(SIZE))(camera)
    points, first, second = points_on_borders(sites)
    own = int(nearest_site(camera[None], sites)[0])
    away = np.linalg.norm(points - camera, axis=1)

    def least(of):
        return away[of].min(initial=np.inf)

    between = {
        s: least(((first == own) & (second == s)) | ((first == s) & (second == own))) for s in range(count)
    }
    for s in range(count):
        if s != own:
            expected = between[s] if np.isfinite(between[s]) else least((first == s) | (second == s))
            # Short borders may have no grid point near them.
            if np.isfinite(expected) and np.isfinite(found[s]) and np.isfinite(between[s]):
                assert found[s] == pytest.approx(expected, abs=0.06)
    nearest = min(between, key=between.get)
    if np.isfinite(between[nearest]):
        centre = np.linalg.norm(sites - camera, axis=1)
        assert found[own] <= centre[own] / centre[nearest] * between[nearest] + 0.06


def test_two_sites_have_one_border_in_the_middle():
    distances = BorderDistances(np.array([(1.0, 1.0), (3.0, 1.0)]), np.zeros(2), np.array(SIZE))
    np.testing.assert_allclose(sorted(distances.borders[0, 1].tolist()), [[2.0, 0.0], [2.0, 3.0]])
    np.testing.assert_allclose(
        distances(np.array([1.5, 2.0])), [np.hypot(0.5, 1) / np.hypot(1.5, 1) * 0.5, 0.5]
    )


def test_a_threshold_keeps_sites_in_falling_probability_until_it_is_reached():
    distance = np.array([0.5, 2.0, 1.0])
    share = np.exp(1 / distance) / np.exp(1 / distance).sum()
    found = border_probability(distance)
    np.testing.assert_allclose(found, share, rtol=1e-6)
    assert sites_kept(found, 0.0).tolist() == []
    assert sites_kept(found, 1e-6).tolist() == [0]
    assert sites_kept(found, float(share[0]) + 1e-3).tolist() == [0, 2]
    assert sites_kept(found, float(share[0] + share[2]) + 1e-3).tolist() == [0, 2, 1]
    # So near that nothing is left for the others in single precision.
    assert sites_kept(border_probability(np.array([1e-3, 2.0, 1.0])), 1.0).tolist() == [0]
    assert sites_kept(border_probability(np.array([0.0, 2.0, np.inf])), 1.0).tolist() == [0]


def test_the_cost_is_that_of_the_formula_entry_by_entry():
    scene, rng = builtin_scene("H1"), np.random.default_rng(4)
    layout, n = scene.layout, 6
    seen = Detections(
        layout.category[:n],
        rng.uniform(0, 1, (n, 2)) * scene.size,
        rng.uniform(-4, 4, n),
        rng.uniform(0.2, 1.5, (n, 3)),
        elevation=rng.uniform(0, 1, n),
    )
    reid = SpatialUnityReid(scene)
    cost, weights = reid.cost_matrix(seen), scene.cost_weights
    templates = {t.category: (np.array(t.size), t.yaw) for t in scene.templates}
    for i in range(n):
        for j in range(len(layout)):
            size, yaw = templates.get(layout.category[j], (None, None))
            if size is None:
                first = layout.category.index(layout.category[j])
                size, yaw = layout.size[first], layout.yaw[first]
            ours, theirs = world_box(seen.size[i], seen.yaw[i]), world_box(size, yaw)
            ratios = [
                np.maximum(ours / theirs[list(p)], theirs[list(p)] / ours) for p in permutations(range(3))
            ]
            best = min(ratios, key=np.sum)
            apart = np.append(seen.position[i] - layout.position[j], seen.elevation[i] - layout.elevation[j])
            expected = weights.translation * np.linalg.norm(apart) / scene.diagonal
            expected += weights.rotation * abs(np.sin((seen.yaw[i] - layout.yaw[j]) / 2))
            assert cost[i, j] == pytest.approx(expected * best.prod(), rel=1e-12)


def test_too_few_labels_leave_all_without_one():
    layout = Layout(
        ("a", "b"), ("chair",) * 2, np.array([(1.0, 1.0), (3.0, 1.0)]), np.zeros(2), np.ones((2, 3))
    )
    scene = Scene("two", SIZE, layout, (Site("S1", 1.0, 1.0), Site("S2", 3.0, 1.0)))
    seen = Detections(("chair",) * 2, np.array([(1.1, 1.0), (2.8, 1.0)]), np.zeros(2), np.ones((2, 3)))
    snapshot = Snapshot(Camera(np.array([1.0, 0.5]), 0.0), seen)
    assert SpatialUnityReid(scene).identify(snapshot).labels == ("a", "b")
    answer = SpatialUnityReid(scene, 0.1).identify(snapshot)
    assert answer.labels == (None, None)
    assert answer.candidates == ("a",)
    assert answer.sites == ("S1",)
    none = SpatialUnityReid(scene, 0.0).identify(snapshot)
    assert none.labels == (None, None)
    assert none.candidates == ()
    with pytest.raises(OptionError, match="threshold"):
        SpatialUnityReid(scene, 1.5)


def test_undisturbed_scenes_are_identified():
    for name in ("M1", "H1", "H2"):
        scene = builtin_scene(name)
        camera = scene.camera_path.cameras(12).at(5)
        snapshot, truth = observe(scene.layout, camera)
        assert SpatialUnityReid(scene).identify(snapshot).labels == truth


def test_it_keeps_the_contract():
    check_reidentifier(SpatialUnityReid)


def test_it_is_about_as_good_as_the_text_in_a_little_noise():
    scene, rng = builtin_scene("H1"), np.random.default_rng(0)
    right = count = 0
    for _ in range(30):
        moved = LayoutNoise(Gaussian(0.0, 0.1), Gaussian(0.0, np.deg2rad(10))).disturb(
            scene.layout, scene.size, rng
        )
        snapshot, truth = observe(moved, scene.camera_path.cameras(12).at(5))
        right += sum(
            a == b for a, b in zip(SpatialUnityReid(scene).identify(snapshot).labels, truth, strict=True)
        )
        count += len(truth)
    assert right / count > 0.85
