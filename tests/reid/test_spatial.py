from dataclasses import FrozenInstanceError, replace
from itertools import permutations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farm_ar.errors import OptionError, SceneError, SnapshotError
from farm_ar.reid import TERMS, SpatialOptions, SpatialReid, accuracy, solve_assignment
from farm_ar.reid.assignment import labels_of_one
from farm_ar.scenes import (
    BUILTIN,
    Camera,
    Detections,
    Layout,
    LayoutNoise,
    Scene,
    Site,
    Snapshot,
    Template,
    Weights,
    builtin_scene,
    observe_many,
)

SIDE = 5 / np.sqrt(2)
"""Of a square room whose diagonal is 5 m."""
CHAIR, TABLE = (0.4, 0.8, 0.5), (1.0, 0.8, 0.5)


def room(**changes: Any) -> Scene:
    """Two chairs by site A, a chair and a table by site B, 0.3 m between the sites' borders and them."""
    layout = Layout(
        labels=("a1", "a2", "b1", "b2"),
        category=("chair", "chair", "chair", "table"),
        position=[[0.5, 0.5], [0.5, 1.5], [3.0, 0.5], [3.0, 1.5]],
        yaw=[0.0, 0.0, 0.0, 0.0],
        size=[CHAIR, CHAIR, CHAIR, TABLE],
    )
    scene = Scene(
        "room",
        (SIDE, SIDE),
        layout,
        sites=(Site("A", 0.5, 1.0), Site("B", 3.0, 1.0)),
        weights=Weights(1.0, 1.0),
    )
    return replace(scene, **changes)


def seen(
    *detections: tuple[str | None, float, float, float],
    size: tuple[float, float, float] = CHAIR,
    camera: tuple[float, float] = (0.6, 1.0),
) -> Snapshot:
    """Detections as (category, x, z, yaw)."""
    return Snapshot(
        Camera(np.array(camera), 0.0),
        Detections(
            category=tuple(d[0] for d in detections),
            position=np.array([d[1:3] for d in detections]),
            yaw=np.array([d[3] for d in detections]),
            size=np.array([size] * len(detections)),
        ),
    )


def test_identification_by_hand() -> None:
    # Moved 0.5 m (0.5 / 5 = 0.1) and turned 60 degrees (sin 30 = 0.5): a2 costs 0.6; a1 would cost 0.8.
    found = SpatialReid(room()).identify(seen(("chair", 0.5, 2.0, np.pi / 3)))
    assert found.labels == ("a2",)
    np.testing.assert_allclose(found.cost, [0.6])
    assert found.total == pytest.approx(0.6)
    assert found.candidates == ("a1", "a2", "b1", "b2")
    assert (found.sites, found.widened) == ((), False)
    assert found.solve_time > 0


def test_the_cost_matrix_is_eq_7() -> None:
    snapshot = seen(("chair", 0.5, 0.5, np.pi / 3), size=(0.8, 0.5, 0.4))
    cost = SpatialReid(room(weights=Weights(2.0, 0.5))).cost_matrix(snapshot.detections)
    # 2 x distance / 5 + 0.5 x 0.5; the chair's axes are only swapped, a table is 0.5 x 0.8 x 1.0.
    table = 1.0 / 0.4
    far = np.hypot(2.5, 1.0)
    np.testing.assert_allclose(cost, [[0.25, 0.65, 1.25, table * (0.4 * far + 0.25)]])


def test_chosen_candidates_have_the_columns_of_the_whole_cost_matrix(rng: np.random.Generator) -> None:
    reid = SpatialReid(builtin_scene("H1"))
    layout = builtin_scene("H1").layout
    detections = Detections(layout.category[:9], layout.position[:9] + 0.2, layout.yaw[:9], layout.size[9:18])
    chosen = rng.permutation(len(layout))[:20]
    np.testing.assert_allclose(
        reid.costs.matrix(detections, chosen), reid.costs.matrix(detections)[:, chosen], rtol=1e-13
    )


def test_a_label_is_used_once_even_where_two_detections_want_it() -> None:
    # Both nearest to a1: 0.1 m and 0.2 m away; a2 is then left for the second.
    found = SpatialReid(room()).identify(seen(("chair", 0.5, 0.4, 0.0), ("chair", 0.5, 0.7, 0.0)))
    assert found.labels == ("a1", "a2")
    np.testing.assert_allclose(found.cost, [0.02, 0.16])


def test_the_sum_is_made_least_and_not_each_cost() -> None:
    # The first is 0.3 m from a1 and 0.7 from a2, the second 0.4 from a2 and 1.4 from a1.
    found = SpatialReid(room()).identify(seen(("chair", 0.5, 0.8, 0.0), ("chair", 0.5, 1.9, 0.0)))
    assert found.labels == ("a1", "a2")
    assert found.total == pytest.approx((0.3 + 0.4) / 5)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_identification_costs_least_of_all_that_use_each_label_once(make_scene: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = make_scene(rng, objects=5)
    like = rng.permutation(5)[:3]
    layout = scene.layout
    detections = Detections(
        tuple(layout.category[j] for j in like),
        layout.position[like] + 1.0,
        rng.uniform(-3, 3, 3),
        layout.size[like],
    )
    reid = SpatialReid(scene, SpatialOptions(gate_categories=False))
    found = reid.identify(Snapshot(Camera([1.0, 1.0], 0.0), detections))
    cost = reid.cost_matrix(detections)
    best = min(permutations(range(5), 3), key=lambda columns: cost[range(3), columns].sum())
    assert found.labels == tuple(layout.labels[j] for j in best)
    np.testing.assert_allclose(found.cost, cost[range(3), best])


@pytest.mark.parametrize("name", BUILTIN)
def test_without_noise_every_detection_is_identified(name: str, rng: np.random.Generator) -> None:
    scene = builtin_scene(name)
    if scene.camera_path is not None:
        cameras = scene.camera_path.cameras(60, scene.fov)
    else:
        cameras = Camera(rng.uniform(0, scene.size, (60, 2)), rng.uniform(-3, 3, 60), scene.fov)
    batch = observe_many(scene.layout, cameras)
    reid = SpatialReid(scene)
    for b in np.flatnonzero(batch.count):
        found = reid.identify(batch.snapshot(b))
        assert accuracy(found, batch.true_labels(b, scene.layout.labels)) == 1
        np.testing.assert_allclose(found.cost, 0, atol=1e-12)


def test_accuracy_falls_as_the_noise_grows(rng: np.random.Generator) -> None:
    scene = builtin_scene("H1")
    cameras = scene.camera_path.cameras(40, scene.fov)
    reid = SpatialReid(scene)
    means = []
    for translation, rotation in ((0.05, 5), (0.3, 30), (1.0, 120)):
        noisy = LayoutNoise.of(translation, rotation).disturb(scene.layout, scene.size, rng, (10, 1))
        batch = observe_many(noisy, cameras)
        found = [
            accuracy(reid.identify(batch.snapshot(b)), batch.true_labels(b, scene.layout.labels))
            for b in np.flatnonzero(batch.count)
        ]
        means.append(np.mean(found))
    assert means[0] > means[1] + 0.05 > means[2] + 0.1


@pytest.mark.parametrize("left_out", TERMS)
def test_a_term_left_out_does_not_count(left_out: str) -> None:
    detections = seen(("chair", 0.5, 2.0, np.pi / 3), size=(0.8, 0.8, 0.5)).detections
    options = SpatialOptions(terms=tuple(term for term in TERMS if term != left_out))
    # To a2: moved 0.1, turned 0.5, sizes 2.
    expected = {"translation": 2 * 0.5, "rotation": 2 * 0.1, "dimension": 0.1 + 0.5}[left_out]
    assert SpatialReid(room(), options).cost_matrix(detections)[0, 1] == pytest.approx(expected)


def test_weights_are_the_scenes_own_or_the_papers_or_those_given() -> None:
    own, formula = Weights(1.0, 1.0), Weights.of_area(SIDE * SIDE)
    assert formula.translation == pytest.approx(0.36 * SIDE)
    assert SpatialReid(room()).costs.weights == own
    assert SpatialReid(room(weights=None)).costs.weights == formula
    assert SpatialReid(room(), SpatialOptions(weights="paper")).costs.weights == formula
    assert SpatialReid(room(), SpatialOptions(weights=Weights(3.0, 0.0))).costs.weights == Weights(3.0, 0.0)


def test_threshold_0_considers_the_cameras_own_site_only() -> None:
    reid = SpatialReid(room(), SpatialOptions(threshold=0.0))
    # Stands where b1 does, but B is not considered.
    found = reid.identify(seen(("chair", 3.0, 0.5, 0.0)))
    assert found.labels == ("a1",)
    assert (found.candidates, found.sites, found.widened) == (("a1", "a2"), ("A",), False)


def test_a_camera_outside_the_room_is_in_its_nearest_site() -> None:
    reid = SpatialReid(room(), SpatialOptions(threshold=0.0))
    found = reid.identify(seen(("chair", 0.5, 0.5, 0.0), camera=(50.0, -3.0)))
    assert (found.labels, found.sites) == (("b1",), ("B",))


def test_a_camera_exactly_on_a_site_is_in_it() -> None:
    reid = SpatialReid(room(), SpatialOptions(threshold=0.0))
    assert reid.identify(seen(("chair", 0.5, 0.5, 0.0), camera=(3.0, 1.0))).sites == ("B",)


def test_sites_are_added_where_there_are_fewer_candidates_than_detections() -> None:
    reid = SpatialReid(room(), SpatialOptions(threshold=0.0))
    found = reid.identify(seen(*[("chair", 0.5, z, 0.0) for z in (0.5, 1.5, 2.5)]))
    assert (found.candidates, found.sites, found.widened) == (("a1", "a2", "b1", "b2"), ("A", "B"), True)
    assert None not in found.labels


def test_sites_are_added_where_a_category_lacks_candidates() -> None:
    snapshot = seen(("table", 0.5, 0.5, 0.0))
    ungated = SpatialReid(room(), SpatialOptions(threshold=0.0, gate_categories=False)).identify(snapshot)
    assert (ungated.labels, ungated.widened) == (("a1",), False)
    gated = SpatialReid(room(), SpatialOptions(threshold=0.0)).identify(snapshot)
    assert (gated.labels, gated.sites, gated.widened) == (("b2",), ("A", "B"), True)


def test_no_more_sites_are_added_than_are_needed() -> None:
    three = room(sites=(Site("A", 0.5, 1.0), Site("B1", 3.0, 0.5), Site("B2", 3.0, 1.6)))
    reid = SpatialReid(three, SpatialOptions(threshold=0.0))
    found = reid.identify(seen(*[("chair", 0.5, z, 0.0) for z in (0.5, 1.5, 2.5)]))
    assert (found.candidates, found.sites, found.widened) == (("a1", "a2", "b1"), ("A", "B1"), True)


def test_more_detections_than_labels_leave_the_costliest_unidentified() -> None:
    snapshot = seen(*[("chair", 0.5, z, 0.0) for z in (0.5, 1.5, 2.5, 0.6, 9.0, -9.0)])
    for chosen in ({}, {"threshold": 0.0}, {"solver": "mip"}):
        options = SpatialOptions(gate_categories=False, **chosen)
        found = SpatialReid(room(), options).identify(snapshot)
        assert found.labels.count(None) == 2
        assert set(found.labels) == {"a1", "a2", "b1", "b2", None}
        assert found.labels[4:] == (None, None)
        assert np.isnan(found.cost).tolist() == [False] * 4 + [True] * 2
        assert found.widened == (options.threshold == 0)


def test_gating_lets_a_detection_be_of_its_own_category_only() -> None:
    snapshot = seen(("table", 0.5, 0.5, 0.0), ("chair", 3.0, 1.5, 0.0))
    ungated = SpatialReid(room(), SpatialOptions(gate_categories=False)).identify(snapshot)
    assert ungated.labels == ("a1", "b2")
    assert SpatialReid(room()).identify(snapshot).labels == ("b2", "b1")


def test_gating_leaves_a_category_in_excess_unidentified() -> None:
    snapshot = seen(("table", 3.0, 1.5, 0.0), ("table", 3.0, 1.6, 0.0), ("chair", 9.0, 9.0, 0.0))
    found = SpatialReid(room()).identify(snapshot)
    assert found.labels == ("b2", None, "b1")


def test_an_unknown_category_may_be_any_label_even_when_gated() -> None:
    reid = SpatialReid(room())
    assert reid.identify(seen((None, 3.0, 1.5, 0.0))).labels == ("b2",)
    assert reid.identify(seen((None, 0.5, 0.5, 0.0), ("chair", 0.5, 0.6, 0.0))).labels == ("a1", "a2")


def test_an_unknown_category_has_a_cost_for_every_label_when_gated() -> None:
    reid = SpatialReid(room())
    cost, names = reid.problem(seen((None, 3.0, 1.5, 0.0), ("chair", 0.5, 0.6, 0.0)))
    own = [reid.scene.layout.category[reid.scene.layout.index(name)] == "chair" for name in names]
    assert 0 < sum(own) < len(own)
    assert np.isfinite(cost).tolist() == [[True] * len(own), own]


def test_boxes_along_the_worlds_axes_change_as_an_object_turns() -> None:
    # Turned by 90 degrees, the chair's world box is 0.5 x 0.8 x 0.4: no cost, axes are paired. At 45 degrees
    # it is 0.9 / sqrt(2) = 0.6364 wide and deep: (0.6364 / 0.4) (0.6364 / 0.5) = 2.025.
    world, local = SpatialOptions(box="world"), SpatialOptions(box="local")
    for options, factor in ((local, 1.0), (world, 2.025)):
        reid = SpatialReid(room(), options)
        quarter = reid.cost_matrix(seen(("chair", 0.5, 1.5, np.pi / 2)).detections)[0, 1]
        eighth = reid.cost_matrix(seen(("chair", 0.5, 1.5, np.pi / 4)).detections)[0, 1]
        assert quarter == pytest.approx(np.sin(np.pi / 4))
        assert eighth == pytest.approx(factor * np.sin(np.pi / 8))


def test_boxes_along_the_worlds_axes_are_compared_with_the_categorys_template() -> None:
    templates = (Template("chair", np.pi / 4, (1.0, 1.0, 1.0)), Template("stool", 0.0, (0.1, 0.1, 0.1)))
    detections = seen(("chair", 0.5, 1.5, np.pi / 2)).detections
    cost = SpatialReid(room(templates=templates), SpatialOptions(box="world")).cost_matrix(detections)[0]
    turn = np.sin(np.pi / 4)
    # The chairs' template is sqrt(2) x 1 x sqrt(2) and what is seen 0.5 x 0.8 x 0.4, paired in order of size.
    assert cost[1] == pytest.approx(turn * (1 / 0.4) * (np.sqrt(2) / 0.5) * (np.sqrt(2) / 0.8))
    # The table has no template: its first object, 1.0 x 0.8 x 0.5, stands for it.
    table = (1.0 / 0.8) * (0.8 / 0.5) * (0.5 / 0.4)
    assert cost[3] == pytest.approx(table * (0.5 + turn))


def test_boxes_along_the_worlds_axes_do_not_count_where_all_are_of_one_category() -> None:
    chairs = room(layout=room().layout.subset([0, 1, 2]))
    detections = seen(("chair", 0.5, 1.5, np.pi / 2), size=(3.0, 3.0, 3.0)).detections
    turn = np.sin(np.pi / 4)
    assert SpatialReid(chairs, SpatialOptions(box="world")).cost_matrix(detections)[0, 1] == pytest.approx(
        turn
    )
    assert SpatialReid(chairs).cost_matrix(detections)[0, 1] > 2 * turn


@pytest.mark.parametrize("solver", ["lsap", "mip"])
def test_ties_are_broken_at_random_on_request(solver: str) -> None:
    # In the middle between a1 and a2.
    snapshot = seen(("chair", 0.5, 1.0, 0.0))
    options = SpatialOptions(solver=solver)
    reid = SpatialReid(room(), options, np.random.default_rng(5))
    draws = [reid.identify(snapshot).labels[0] for _ in range(40)]
    again = SpatialReid(room(), options, np.random.default_rng(5))
    assert set(draws) == {"a1", "a2"}
    assert [again.identify(snapshot).labels[0] for _ in range(40)] == draws
    assert len({SpatialReid(room(), options).identify(snapshot).labels for _ in range(10)}) == 1


@pytest.mark.parametrize("threshold", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("gate", [False, True])
def test_an_empty_snapshot_has_an_empty_identification(threshold: float, gate: bool) -> None:
    reid = SpatialReid(room(), SpatialOptions(threshold=threshold, gate_categories=gate))
    for rng in (None, np.random.default_rng(0)):
        found = SpatialReid(room(), reid.options, rng).identify(
            Snapshot(Camera([0.0, 0.0], 0.0), Detections((), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3))))
        )
        assert (found.labels, found.cost.shape, found.total, found.widened) == ((), (0,), 0.0, False)


@pytest.mark.parametrize(("x", "label", "widened"), [(0.6, "a1", False), (3.0, "b1", True)])
def test_a_proof_that_takes_labels_of_other_sites_says_so(x: float, label: str, widened: bool) -> None:
    found = SpatialReid(room(), SpatialOptions(threshold=0, certify=True)).identify(
        seen(("chair", x, 0.5, 0.0))
    )
    assert (found.labels, found.widened) == ((label,), widened)
    assert (label in ("a1", "a2")) == (set(found.candidates) == {"a1", "a2"})


def test_an_empty_cell_of_the_camera_is_widened_from() -> None:
    empty_cell = room(sites=(Site("A", 0.5, 1.0), Site("behind", 0.5, 9.0)))
    reid = SpatialReid(empty_cell, SpatialOptions(threshold=0.0))
    found = reid.identify(seen(("chair", 0.5, 1.4, 0.0), camera=(0.5, 8.0)))
    assert (found.labels, found.sites, found.widened) == (("a2",), ("behind", "A"), True)


@pytest.mark.parametrize("sites", [(), (Site("only", 9.0, 9.0),)])
def test_without_two_sites_nothing_is_pruned(sites: tuple[Site, ...]) -> None:
    reid = SpatialReid(room(sites=sites), SpatialOptions(threshold=0.0))
    found = reid.identify(seen(("chair", 3.0, 0.5, 0.0)))
    assert (found.labels, found.sites, len(found.candidates)) == (("b1",), (), 4)


def test_an_undeclared_category_is_named() -> None:
    snapshot = seen(("chair", 0.5, 0.5, 0.0), ("sofa", 0.5, 1.5, 0.0))
    message = r"^detections\[1\]\.category: must be null or one of chair, table, got 'sofa'$"
    with pytest.raises(SnapshotError, match=message):
        SpatialReid(room()).identify(snapshot)


def test_a_scene_without_labels_is_refused() -> None:
    empty = room(layout=Layout((), (), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3))))
    with pytest.raises(SceneError, match=r"^objects: must be at least one, got 0$"):
        SpatialReid(empty)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"threshold": -0.1}, r"threshold: must be from 0 to 1, got -0\.1"),
        ({"threshold": 1.1}, r"threshold: must be from 0 to 1, got 1\.1"),
        ({"threshold": float("nan")}, r"threshold: must be from 0 to 1, got nan"),
        ({"weights": "mine"}, r"weights: must be one of paper, scale-free, scene, got 'mine'"),
        ({"terms": ("rotation", "colour")}, r"terms: must be one of .*, got 'colour'"),
        ({"box": "round"}, r"box: must be one of local, world, got 'round'"),
        ({"solver": "simplex"}, r"solver: must be one of lsap, mip, got 'simplex'"),
    ],
)
def test_options_outside_their_limits_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(OptionError, match=f"^{message}$"):
        SpatialOptions(**options)


def test_options_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        SpatialOptions().threshold = 0.5  # type: ignore[misc]


def test_the_solver_named_is_the_one_used(monkeypatch: pytest.MonkeyPatch) -> None:
    used = []

    def spy(cost: np.ndarray, solver: str, rng: np.random.Generator | None) -> np.ndarray:
        used.append(solver)
        return solve_assignment(cost, solver, rng)

    def compiled(*problem: Any) -> Any:
        used.append("lsap")
        return labels_of_one(*problem)

    monkeypatch.setattr("farm_ar.reid.spatial.solve_assignment", spy)
    monkeypatch.setattr("farm_ar.reid.spatial.labels_of_one", compiled)
    for solver in ("lsap", "mip"):
        SpatialReid(room(), SpatialOptions(solver=solver)).identify(seen(("chair", 0.5, 0.5, 0.0)))
    assert used == ["lsap", "mip"]
