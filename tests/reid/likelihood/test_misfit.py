"""Where no motion explains what is seen, `LikelihoodReid` is less confident, and says so."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from farm_ar.reid import LikelihoodOptions, LikelihoodReid, Motion, Rates
from farm_ar.reid.likelihood.kernels import chance_of_more, predictive_p_value
from farm_ar.reid.likelihood.method import _one
from farm_ar.reid.likelihood.motions import DetectionNoise
from farm_ar.scenes import Camera, Detections, FieldOfView, Layout, Scene, Snapshot

PLACE = np.array([(x, z) for x in range(3) for z in range(2)], dtype=float) * 3.0
YAW = np.linspace(-2, 2, 6)
OPTIONS = LikelihoodOptions(
    noise=(Motion(1.0, 0.3, 0.2),), rates=(Rates(1.0, 0.01, 0.01),), detection=DetectionNoise(0.01, 0.01)
)


def scene(fixed=None):
    layout = Layout(tuple("abcdef"), ("chair",) * 6, PLACE, YAW, np.full((6, 3), 0.5), fixed=fixed)
    return Scene("grid", None, layout, symmetry={"lamp": np.pi})


def seen(shift, turn):
    camera = Camera(np.array([3.0, -4.0]), 0.0, FieldOfView(np.pi, np.pi, 100.0))
    return Snapshot(camera, Detections(("chair",) * 6, PLACE + shift, YAW + turn, np.full((6, 3), 0.5)))


def p_value_of(reid, snapshot):
    found, p_value = reid._found_in(snapshot), np.ones(1)
    answer = reid._answer(_one(snapshot.camera), found, details=True, p_value=p_value)
    known = reid._known(_one(snapshot.camera))
    assert predictive_p_value.py_func(known, found, 0, answer, 0) == pytest.approx(p_value[0])
    return float(p_value[0]), [scene().layout.labels[j] for j in answer.label[0]]


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_products_of_even_numbers_are_as_small_as_fisher_says(count):
    for log_product in (-0.1, -3.0, -40.0):
        assert chance_of_more(log_product, count) == pytest.approx(chi2.sf(-2 * log_product, 2 * count))


def test_the_p_value_is_that_of_the_shifts_and_turns_of_the_answer():
    rng = np.random.default_rng(4)
    for size in (0.1, 0.3, 0.6):
        shift, turn = rng.normal(0, size, (6, 2)), rng.normal(0, size / 2, 6)
        value, labels = p_value_of(LikelihoodReid(scene(), OPTIONS), seen(shift, turn))
        assert labels == list("abcdef")
        far = chi2.sf((shift**2).sum() / (0.3**2 + 0.01**2), 12)
        tails = 2 * norm.sf(np.abs(turn) / np.hypot(0.2, 0.01))
        wide = chi2.sf(-2 * np.log(tails).sum(), 12)
        assert value == pytest.approx(min(1.0, 2 * min(far, wide)), rel=0.05)


def test_headings_that_are_not_known_and_what_never_moves_tell_nothing():
    shift = np.full((6, 2), 0.2)
    reid = LikelihoodReid(scene(), OPTIONS)
    value, _ = p_value_of(reid, seen(shift, np.full(6, np.nan)))
    assert value == pytest.approx(chi2.sf((shift**2).sum() / (0.3**2 + 0.01**2), 12), rel=1e-6)
    still = LikelihoodReid(scene(fixed=np.ones(6, dtype=bool)), OPTIONS)
    assert p_value_of(still, seen(0.0, 0.0))[0] == 1.0


def test_what_a_motion_does_not_explain_is_answered_less_confidently_and_said():
    narrow = LikelihoodOptions(noise=(Motion(1.0, 0.05, 0.1),), rates=(Rates(1.0, 0.01, 1e-9),))
    reid = LikelihoodReid(scene(), narrow)
    fits, odd = (reid.identify(seen(shift, 0.05)) for shift in (0.03, 0.2))
    assert fits.labels == odd.labels == tuple("abcdef")
    assert fits.warnings == ()
    assert "no motion that is thought possible explains these poses" in odd.warnings[0]
    assert odd.confidence.max() < fits.confidence.min()
    np.testing.assert_allclose(odd.probability.sum(axis=1), 1.0)


def test_in_a_large_place_of_many_things_close_together_small_motions_are_thought_of():
    """A warehouse: what moves by a third of the spacing is told apart, however long the aisles are."""
    rng = np.random.default_rng(0)
    place = np.array([(4.0 * i, 1.5 * k) for i in range(4) for k in range(120)])
    n, unknown = len(place), np.full((len(place), 3), np.nan)
    layout = Layout(tuple(f"r{k}" for k in range(n)), ("rack",) * n, place, unknown[:, 0], unknown)
    near = np.flatnonzero((place[:, 0] <= 4) & (np.abs(place[:, 1] - 90) < 4))
    moved = place[near] + rng.normal(0, 0.5, (len(near), 2))
    camera = Camera(np.array([4.0, 90.0]), 0.0, FieldOfView(np.pi, np.pi, 6.0))
    nothing = unknown[: len(near)]
    snapshot = Snapshot(camera, Detections((None,) * len(near), moved, nothing[:, 0], nothing))
    found = LikelihoodReid(Scene("aisles", None, layout)).identify(snapshot)
    assert found.labels == tuple(f"r{k}" for k in near)
    assert found.confidence.mean() > 0.6  # a third, if nothing moved less than a hundredth of the extent
