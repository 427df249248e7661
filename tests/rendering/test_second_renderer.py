"""The frames that judge perception: what draws them and our own renderer see the same from a camera."""

import sys
from pathlib import Path

import numpy as np
import pytest

from farm_ar.rendering import HOLOLENS_2, Instance, Intrinsics, Renderer, View, model

pytest.importorskip("mitsuba", reason="needs the extra judge")
sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

from judging_frames import shares_seen, trace, truth_of
from judging_props import Paint, standing
from judging_worlds import World, draw_world


@pytest.mark.parametrize(("cx", "cy"), [(79.5, 44.5), (60.0, 55.0)])
def test_both_renderers_see_a_thing_at_the_same_pixels(cx, cy):
    lens = Intrinsics(150.0, 150.0, cx, cy, 160, 90)
    view = View(lens, np.array([0.3, 0.35, -0.2]), 0.15, -0.6)
    dark = standing(model("coop"), (0.33, 0.0, 0.25), 0.7, 1, Paint((20.0, 20.0, 20.0)))
    light = trace(World(view, None, [dark], [], []), 64, 0, 3).mean(axis=-1)
    covered = 1 - light / light.max()  # the sky is even, the thing nearly black
    ids = Renderer([Instance(dark.mesh, np.zeros(3), number=1)]).ids(view)[1] == 1
    rows, columns = np.mgrid[:90, :160]
    assert covered.sum() == pytest.approx(ids.sum(), rel=0.03)
    for axis in (rows, columns):
        expected = (axis * ids).sum() / ids.sum()
        assert (axis * covered).sum() / covered.sum() == pytest.approx(expected, abs=0.1)
    assert ((covered > 0.5) & ids).sum() > 0.97 * ids.sum()


def test_the_share_that_is_seen_counts_what_is_hidden_and_what_is_cut_off():
    lens = Intrinsics(150.0, 150.0, 79.5, 44.5, 160, 90)
    view = View(lens, np.array([0.3, 0.035, -0.3]))  # lower than their roofs
    near = standing(model("hutch"), (0.3, 0.0, 0.0), 0.0, 1, Paint((9.0, 9.0, 9.0)))
    far = standing(model("hutch"), (0.3, 0.0, 0.3), 0.0, 2, Paint((9.0, 9.0, 9.0)))
    edge = lens.cx / lens.fx * 0.3  # where the picture's left edge is
    cut = standing(model("hutch"), (0.3 - edge, 0.0, 0.0), 0.0, 3, Paint((9.0, 9.0, 9.0)))
    seen = shares_seen([near, far, cut], view)
    assert seen[1][0] == 1.0
    assert seen[2][0] < 0.02
    assert 0.3 < seen[3][0] < 0.7


def test_the_same_seed_draws_the_same_world_and_its_truth():
    lens = HOLOLENS_2.resized(160, 90)
    first, again = (
        [truth_of(draw_world(lens, np.random.default_rng(k), True), "0.png") for k in range(4)]
        for _ in range(2)
    )
    assert first == again
    assert sum(truth["hand_pixels"] > 50 for truth in first) >= 2
    for truth in first:
        assert {thing["category"] for thing in truth["objects"]} == {"shed", "coop", "hutch"}
