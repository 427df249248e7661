"""The shelf of two levels."""

import numpy as np

from farm_ar.experiments.setting import Setting
from farm_ar.experiments.shelves import CAMERA, METHODS, answers, rearranged, shelf, shelf_experiment
from farm_ar.reid import accuracy
from farm_ar.scenes import observe


def test_boxes_stand_in_pairs_above_one_another_and_look_the_same():
    layout = shelf().layout
    assert set(layout.category) == {"box"}
    low, high = layout.elevation == 0.4, layout.elevation == 1.0
    np.testing.assert_allclose(layout.position[low], layout.position[high])
    assert ((layout.tilt[low] == 0).all(axis=1) != (layout.tilt[high] == 0).all(axis=1)).all()


def test_what_has_not_moved_is_known_in_space_and_not_on_the_plane():
    scene = shelf()
    snapshot, truth = observe(scene.layout, CAMERA)
    found = answers(scene, snapshot)
    assert accuracy(found["space"], truth) == accuracy(found["heights"], truth) == 1.0
    cost = found["plane"].cost
    assert cost.max() < 1e-9, "on the plane both boxes of a pair fit as well"


def test_some_boxes_change_their_level_and_the_others_stay_on_it(rng):
    scene = shelf()
    for share in (0.0, 0.3):
        moved = np.mean(
            [rearranged(scene, share, rng).elevation != scene.layout.elevation for _ in range(50)]
        )
        assert abs(moved - share) < 0.05


def test_heights_and_tilts_resolve_what_the_plane_cannot():
    """The claim of the page, by paired intervals over rearrangements."""
    report = shelf_experiment(Setting(layouts=6))
    assert [row["method"] for row in report.rows] == [*METHODS] * 3
    rows = {(row["lifted"], row["method"]): row for row in report.rows}
    for share in (0.0, 0.15, 0.3):
        assert rows[share, "space"]["gain_low"] > 0.15
        assert rows[share, "space"]["accuracy"] > rows[share, "plane"]["accuracy"] + 0.15
        assert rows[share, "plane"]["gain"] == 0.0
    assert rows[0.0, "heights"]["gain_low"] > 0.15
    assert rows[0.3, "space"]["accuracy"] > rows[0.3, "heights"]["accuracy"], "tilts tell of what was lifted"
