"""Pictures of places that are no room from [0, 0], and of things whose heading or size is not known."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.patches import Polygon

from farm_ar.drawing import draw_identification, draw_scene, new_picture, save_picture
from farm_ar.reid import SpatialReid
from farm_ar.scenes import Bounds, Camera, Detections, Layout, Scene, Site, Snapshot

NOTCHED = np.array([(0, 0), (4, 0), (4, 3), (2, 3), (2, 1), (0, 1)]) - (1000, 2000)
NAN = np.nan
LAYOUT = Layout(
    ("a", "b", "c"),
    ("chair", "chair", "table"),
    np.array([(0.5, 0.5), (3.5, 2.5), (3, 1)]) - (1000, 2000),
    [NAN, 1.0, NAN],
    [(NAN,) * 3, (0.4, 1, 0.5), (NAN,) * 3],
)
SITES = (Site("S", -999.0, -1999.0), Site("T", -997.0, -1998.0))


@pytest.mark.parametrize("bounds", [Bounds(NOTCHED), Bounds.rectangle(4, 3, (-1000, -2000), 0.3), None])
def test_a_picture_shows_the_place_wherever_it_is(tmp_path, bounds):
    scene = Scene("hall", None, LAYOUT, SITES, bounds=bounds)
    snapshot = Snapshot(
        Camera(LAYOUT.position[0] + 0.3, 0.5),
        Detections(("chair", None), LAYOUT.position[:2], [NAN, 0], [(NAN,) * 3] * 2),
    )
    for draw in (
        lambda axes: draw_scene(axes, scene, camera=snapshot.camera),
        lambda axes: draw_identification(axes, scene, snapshot, SpatialReid(scene).identify(snapshot)),
    ):
        figure, axes = new_picture(scene)
        draw(axes)
        shown = LAYOUT.position if bounds is None else np.vstack([LAYOUT.position, bounds.corners])
        low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
        assert (shown >= low).all()
        assert (shown <= high).all()
        assert (high - low < 12).all()
        for patch in axes.patches:
            if isinstance(patch, Polygon):
                assert np.isfinite(patch.get_xy()).all()
        save_picture(figure, tmp_path / "place.svg")
        assert (tmp_path / "place.svg").stat().st_size > 1000


def test_only_known_headings_are_marked():
    def triangles(scene: Scene) -> int:
        _, axes = new_picture(scene)
        draw_scene(axes, scene, cells=False)
        return sum(isinstance(patch, Polygon) and len(patch.get_xy()) == 4 for patch in axes.patches)

    scene = Scene("hall", (8, 8), LAYOUT.with_poses(np.add(LAYOUT.position, (1001, 2001)), LAYOUT.yaw))
    known = replace(scene, layout=scene.layout.with_poses(scene.layout.position, [0, 1, 2]))
    assert triangles(scene) == triangles(known) - 2
