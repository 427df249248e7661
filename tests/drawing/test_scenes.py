from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import same_color
from matplotlib.patches import Polygon

from farm_ar.arrays import FloatArray
from farm_ar.drawing import Tags, category_fills, draw_scene, new_picture, save_picture
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.geometry import direction, footprint_corners, view_polygon, voronoi_cells
from farm_ar.scenes import BUILTIN, Camera, FieldOfView, Layout, Scene, Site, builtin_scene

LAYOUT = Layout(
    labels=("big", "small", "round"),
    category=("table", "chair", "stool"),
    position=np.array([(1.0, 1.0), (1.2, 1.1), (3.0, 2.0)]),
    yaw=np.array([0.0, 1.0, 2.0]),
    size=np.array([(1.0, 0.7, 0.8), (0.4, 0.9, 0.4), (0.3, 0.5, 0.3)]),
)
SCENE = Scene(
    "study",
    (4.0, 3.0),
    LAYOUT,
    sites=(Site("S1", 1.0, 1.0), Site("S2", 3.0, 1.0), Site("S3", 2.0, 4.5)),
    symmetry={"stool": 0.0, "table": np.pi},
)


def drawn(scene: Scene, **options: object) -> Axes:
    _, axes = new_picture(scene.size)
    draw_scene(axes, scene, **options)  # type: ignore[arg-type]
    return axes


def polygons(axes: Axes, corners: FloatArray) -> list[Polygon]:
    """The polygons on the page with exactly these corners."""
    found = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    return [p for p in found if len(p.xy) == len(corners) + 1 and np.allclose(p.xy[:-1], corners)]


def triangles(axes: Axes) -> list[FloatArray]:
    """Corners of the heading marks, tip first."""
    found = [patch.xy[:-1] for patch in axes.patches if isinstance(patch, Polygon) and len(patch.xy) == 4]
    return [np.asarray(corners) for corners in found]


def placed(axes: Axes) -> tuple[Tags, FloatArray]:
    (tags,) = (artist for artist in axes.get_children() if isinstance(artist, Tags))
    canvas = FigureCanvasAgg(axes.figure)  # type: ignore[arg-type]
    canvas.draw()
    return tags, tags.place(canvas.get_renderer())


def largest_overlap(boxes: FloatArray) -> float:
    low = np.maximum(boxes[:, None, :2], boxes[:, :2])
    high = np.minimum(boxes[:, None, 2:], boxes[:, 2:])
    area = np.prod(np.maximum(high - low, 0.0), axis=-1)
    return float(area[np.triu_indices(len(boxes), 1)].max(initial=0.0))


def test_every_object_is_one_rectangle_in_the_colour_of_its_category() -> None:
    axes = drawn(SCENE, path=False)
    fills = category_fills(LAYOUT.category)
    for name, corners in zip(
        LAYOUT.category, footprint_corners(LAYOUT.position, LAYOUT.yaw, LAYOUT.size), strict=True
    ):
        (rectangle,) = polygons(axes, corners)
        assert same_color(rectangle.get_facecolor(), fills[name].color)


def test_small_objects_lie_on_large_ones() -> None:
    axes = drawn(SCENE)
    table, chair, _ = footprint_corners(LAYOUT.position, LAYOUT.yaw, LAYOUT.size)
    assert polygons(axes, chair)[0].zorder > polygons(axes, table)[0].zorder


def test_a_triangle_points_along_the_heading_of_all_but_round_things() -> None:
    marks = triangles(drawn(SCENE, cells=False))
    assert len(marks) == 2
    for mark, yaw, position, size in zip(marks, LAYOUT.yaw, LAYOUT.position, LAYOUT.size, strict=False):
        ahead = direction(yaw)
        np.testing.assert_allclose(mark[0], position + ahead * size[2] / 2)
        pointing = mark[0] - mark[1:].mean(axis=0)
        np.testing.assert_allclose(pointing / np.hypot(*pointing), ahead)
        # Only one of its corners can be the tip.
        assert np.hypot(*pointing) > 1.5 * np.hypot(*(mark[1] - mark[2]))


def test_another_layout_of_the_objects_is_drawn_in_its_own_place() -> None:
    moved = LAYOUT.with_poses(LAYOUT.position + 0.5, LAYOUT.yaw)
    axes = drawn(SCENE, layout=moved)
    assert not polygons(axes, footprint_corners(LAYOUT.position, LAYOUT.yaw, LAYOUT.size)[0])
    assert len(polygons(axes, footprint_corners(moved.position, moved.yaw, moved.size)[0])) == 1


@pytest.mark.parametrize("with_camera", [True, False])
def test_the_field_of_view_is_there_exactly_when_there_is_a_camera(with_camera: bool) -> None:
    camera = Camera(np.array([2.0, 0.5]), np.array(0.3), FieldOfView(0.5, 0.6, 1.5))
    axes = drawn(SCENE, camera=camera if with_camera else None)
    wedge = view_polygon(camera.position, 0.3, 0.5, 0.6, 1.5, arc_points=64)
    assert len(polygons(axes, wedge)) == with_camera


def test_a_view_beyond_the_page_is_drawn_to_its_farthest_corner() -> None:
    axes = drawn(SCENE, camera=Camera(np.array([2.0, 0.5]), np.array(0.3), FieldOfView(0.5, 0.6, 900.0)))
    (wedge,) = (p for p in axes.patches if isinstance(p, Polygon) and len(p.xy) == 66)
    corners = np.array([(x, z) for x in axes.get_xlim() for z in axes.get_ylim()])
    reach = np.hypot(*(wedge.xy - [2.0, 0.5]).T).max()
    assert reach == pytest.approx(np.hypot(*(corners - [2.0, 0.5]).T).max())


def test_sites_and_cameras_outside_the_room_are_on_the_page() -> None:
    axes = drawn(SCENE, camera=Camera(np.array([-2.0, 1.0]), np.array(1.5)))
    assert axes.get_ylim()[1] > 4.5
    assert axes.get_xlim()[0] < -2.0


def test_cells_are_drawn_on_request() -> None:
    for cell in voronoi_cells(SCENE.site_positions, SCENE.size):
        assert len(polygons(drawn(SCENE), cell)) == 1
        assert not polygons(drawn(SCENE, cells=False), cell)


def test_the_path_is_drawn_on_request() -> None:
    scene = builtin_scene("L1")
    assert scene.camera_path is not None

    def curves(axes: Axes) -> int:
        walk = scene.camera_path.polyline  # type: ignore[union-attr]
        return sum(np.array_equal(line.get_xydata(), walk) for line in axes.lines)

    assert curves(drawn(scene)) == 1
    assert curves(drawn(scene, path=False)) == 0


def test_objects_sites_and_the_start_are_named() -> None:
    tags, _ = placed(drawn(builtin_scene("L1")))
    names = {tag.text for tag in tags.tags}
    assert names == {*builtin_scene("L1").layout.labels, "S1", "S2", "start"}
    tags, _ = placed(drawn(builtin_scene("L1"), labels=False, cells=False, path=False))
    assert not tags.tags


def test_a_legend_explains_the_categories_where_there_are_several() -> None:
    legend = drawn(SCENE).get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["chair", "stool", "table"]
    assert drawn(SCENE, legend=False).get_legend() is None
    assert drawn(builtin_scene("L1")).get_legend() is None


@pytest.mark.parametrize("name", BUILTIN)
def test_no_labels_overlap_in_the_built_in_scenes(name: str) -> None:
    _, boxes = placed(drawn(builtin_scene(name)))
    assert not np.isnan(boxes).any()
    assert largest_overlap(boxes) == 0.0


def test_labels_stand_on_their_objects_where_there_is_room() -> None:
    axes = drawn(replace(SCENE, sites=()))
    _, boxes = placed(axes)
    centre = axes.transData.inverted().transform((boxes[:, :2] + boxes[:, 2:]) / 2)
    assert np.all(np.abs(centre - LAYOUT.position) < 0.25)


def test_labels_outside_a_zoomed_page_are_left_out() -> None:
    axes = drawn(SCENE, cells=False)
    axes.set_xlim(2.0, 4.0)
    tags, boxes = placed(axes)
    shown = [tag.text for tag, text in zip(tags.tags, tags.texts, strict=True) if text.get_visible()]
    assert shown == ["round"]
    assert np.isnan(boxes).any(axis=1).tolist() == [True, True, False]


def test_an_empty_room_is_drawn() -> None:
    empty = Layout((), (), np.empty((0, 2)), np.empty(0), np.empty((0, 3)))
    tags, boxes = placed(drawn(Scene("empty", (2.0, 1.0), empty)))
    assert tags.tags == ()
    assert boxes.shape == (0, 4)


def test_batches_are_refused() -> None:
    with pytest.raises(SceneError, match="layout: must be a single arrangement"):
        drawn(SCENE, layout=LAYOUT.with_poses(LAYOUT.position[None], LAYOUT.yaw[None]))
    with pytest.raises(SnapshotError, match="camera: must be a single camera"):
        drawn(SCENE, camera=Camera(np.zeros((2, 2)), np.zeros(2)))


def test_signs_that_no_font_has_are_drawn_without_a_warning(tmp_path: Path) -> None:
    labels = ("\x1b[31m", "a\nb", "\U0001f411", "x" * 1000)
    layout = Layout(labels, ("chair",) * 4, [(1, 1), (2, 2), (3, 3), (1, 3)], [0] * 4, [(0.5, 1, 0.5)] * 4)
    figure, axes = new_picture((4.0, 4.0))
    draw_scene(axes, Scene("room", (4, 4), layout))
    save_picture(figure, tmp_path / "room.png")
    texts = [
        text.get_text()
        for artist in axes.artists
        for text in artist.get_children()
        if hasattr(text, "get_text")
    ]
    assert texts == ["\ufffd[31m", "a\ufffdb", "\U0001f411", "x" * 79 + "\u2026"]
