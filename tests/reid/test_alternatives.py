from __future__ import annotations

import itertools

import numpy as np
import pytest

from farm_ar.reid import LikelihoodReid, SpatialOptions, SpatialReid, alternatives


@pytest.mark.parametrize(
    "options",
    [SpatialOptions(), SpatialOptions(gate_categories=False), SpatialOptions(threshold=0.5)],
    ids=str,
)
def test_the_first_alternative_is_the_answer_and_the_others_cost_more(options, make_scene, make_batch):
    rng = np.random.default_rng(1)
    scene = make_scene(rng)
    reid, batch = SpatialReid(scene, options), make_batch(rng, scene)
    for b in range(len(batch)):
        snapshot = batch.snapshot(b)
        found, answer = alternatives(reid, snapshot, 5), reid.identify(snapshot)
        assert found[0].labels == answer.labels
        np.testing.assert_allclose(found[0].cost, answer.cost)
        assert found[0].candidates == answer.candidates
        assert len({one.labels for one in found}) == len(found)
        totals = [one.total for one in found]
        assert totals == sorted(totals)
        if len(answer.labels) and np.isfinite(answer.margin).any():
            assert totals[1] - totals[0] == pytest.approx(np.nanmin(answer.margin))


def test_alternatives_by_likelihood_rise_in_expected_errors(make_scene, make_batch):
    rng = np.random.default_rng(2)
    scene = make_scene(rng)
    reid, snapshot = LikelihoodReid(scene), make_batch(rng, scene).snapshot(1)
    found, answer = alternatives(reid, snapshot, 6), reid.identify(snapshot)
    assert found[0].labels == answer.labels
    assert answer.probability is not None
    index = {name: j for j, name in enumerate(answer.candidates)} | {None: len(answer.candidates)}
    right = [sum(answer.probability[i, index[x]] for i, x in enumerate(one.labels)) for one in found]
    assert all(a >= b - 1e-9 for a, b in itertools.pairwise(right))
    assert len(found) == 6
