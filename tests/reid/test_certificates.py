from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.reid import SpatialOptions, SpatialReid, solve_assignment, solve_certified
from farm_ar.reid.certificates import nearest_labels
from farm_ar.scenes import Weights


@settings(max_examples=60 * settings().max_examples // 50, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 6),
    m=st.integers(1, 12),
    loose=st.sampled_from([0.0, 0.5, 1.0]),
    banned=st.sampled_from([0.0, 0.3]),
)
def test_the_pruned_optimum_is_the_optimum_over_all_labels(seed, n, m, loose, banned):
    rng = np.random.default_rng(seed)
    cost = rng.uniform(0, 3, (n, m))
    cost[rng.random((n, m)) < banned] = np.inf
    bound = np.minimum(loose * cost, 3.0) if loose else np.zeros((n, m))
    label, considered, chosen = solve_certified(lambda j: cost[:, j], bound, nearest_labels(bound, 2))
    whole = solve_assignment(cost)
    assert (label != -1).sum() == (whole != -1).sum()
    given_out = [(i, j) for i, j in enumerate(label) if j != -1]
    assert sum(cost[pair] for pair in given_out) == pytest.approx(
        sum(cost[i, j] for i, j in enumerate(whole) if j != -1)
    )
    assert set(label[label != -1]) <= set(chosen)
    np.testing.assert_array_equal(considered, cost[:, chosen])


@settings(max_examples=30 * settings().max_examples // 50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), threshold=st.sampled_from([0.0, 0.5, 1.0]), gate=st.booleans())
def test_certified_pruning_of_the_papers_rule_changes_no_answer_at_any_weights(
    seed, threshold, gate, make_scene, make_batch
):
    rng = np.random.default_rng(seed)
    scene = make_scene(rng)
    weights = Weights(rng.uniform(0, 2), rng.uniform(0, 4))
    pruned = SpatialReid(scene, SpatialOptions(threshold, weights, gate_categories=gate, certify=True))
    whole = SpatialReid(scene, SpatialOptions(1.0, weights, gate_categories=gate))
    batch = make_batch(rng, scene, snapshots=4)
    many = pruned.identify_many(batch)
    for b in range(len(batch)):
        snapshot = batch.snapshot(b)
        found, expected = pruned.identify(snapshot), whole.identify(snapshot)
        assert found.labels == expected.labels
        np.testing.assert_allclose(found.cost, expected.cost)
        np.testing.assert_allclose(found.margin, expected.margin, atol=1e-9)
        assert found.runner_up == expected.runner_up or np.isinf(found.margin).any()
        assert many.names(b, int(batch.count[b])) == expected.labels


def test_few_labels_are_considered_where_things_stand_apart(make_scene, make_batch):
    rng = np.random.default_rng(1)
    scene = make_scene(rng, objects=40)
    reid = SpatialReid(scene, SpatialOptions(certify=True, weights=Weights(3.0, 0.3)))
    snapshot = make_batch(rng, scene, most=4).snapshot(1)
    found = reid.identify(snapshot)
    assert len(found.candidates) < 40
    assert not found.widened
