"""The renderer against a plain z-buffer in NumPy, and against geometry worked out by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.errors import SceneError, SnapshotError
from farm_ar.rendering import HOLOLENS_2, Instance, Intrinsics, Light, Mesh, Renderer, View
from farm_ar.rendering.shapes import box, ellipsoid, mesh_of, pane
from farm_ar.scenes import Camera, FieldOfView

LENS = Intrinsics.of_view(64, 48, 1.1)


def reference(instances, view):
    """(H, W) depth and ids: every triangle at every pixel's ray, by solving for where the ray meets it."""
    lens = view.intrinsics
    column, row = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
    rays = np.stack([(column - lens.cx) / lens.fx, (row - lens.cy) / lens.fy, np.ones(column.shape)], axis=-1)
    rays = rays @ view.rotation
    depth, ids = np.full(column.shape, np.inf), np.full(column.shape, -1)
    for one in instances:
        for a, b, c in one.corners:
            matrix = np.stack([a - b, a - c], axis=1)
            with np.errstate(all="ignore"):
                full = np.concatenate(
                    [np.broadcast_to(matrix, (*column.shape, 3, 2)), rays[..., None]], axis=-1
                )
                good = np.abs(np.linalg.det(full)) > 1e-14
                solved = np.linalg.solve(
                    np.where(good[..., None, None], full, np.eye(3)), (a - view.eye)[:, None]
                )
            s, t, away = np.moveaxis(solved[..., 0], -1, 0)
            hit = good & (s >= 0) & (t >= 0) & (s + t <= 1) & (away > 0.01) & (away < depth)
            depth[hit], ids[hit] = away[hit], one.number
    return depth, ids


def soup(seed, count=12):
    rng = np.random.default_rng(seed)
    made = []
    for k in range(count):
        shape = (
            box((-0.1, 0, -0.1), (0.1, 0.2, 0.1), (200, 100, 50))
            if k % 2
            else ellipsoid((0, 0.1, 0), (0.1, 0.1, 0.15), (10, 200, 90), 6, 4)
        )
        place = [rng.uniform(-0.8, 0.8), rng.uniform(-0.1, 0.3), rng.uniform(-0.3, 1.5)]
        made.append(Instance(mesh_of(shape), np.array(place), rng.uniform(-4, 4), k))
    return made


@given(st.integers(0, 10_000), st.floats(-0.6, 0.6), st.floats(-0.8, 0.4), st.floats(-1, 1))
@settings(max_examples=settings().max_examples // 10, deadline=None)
def test_depth_and_ids_are_those_of_rays_that_meet_triangles(seed, yaw, pitch, roll):
    instances = soup(seed)
    view = View(LENS, np.array([0.0, 0.4, -0.9]), yaw, pitch, roll)
    depth, ids = Renderer(instances).ids(view)
    expected, numbers = reference(instances, view)
    # Along edges a pixel's middle may fall to either side by rounding.
    same = ids == numbers
    assert same.mean() > 0.998
    both = same & (ids >= 0)
    assert np.abs(depth[both] - expected[both]).max(initial=0.0) < 2e-5 * max(
        expected[both].max(initial=1), 1
    )


def test_what_reaches_behind_the_eye_is_cut_off_and_not_mirrored():
    floor = mesh_of(pane([(-5, 0, -5), (5, 0, -5), (5, 0, 5), (-5, 0, 5)], (0, 1, 0), (90, 90, 90)))
    view = View(LENS, np.array([0.0, 1.0, 0.0]))
    depth, ids = Renderer([Instance(floor, np.zeros(3), number=7)]).ids(view)
    row = np.arange(LENS.height)[:, None]
    below = (row - LENS.cy) / LENS.fy
    with np.errstate(divide="ignore"):
        away = np.broadcast_to(np.where(below > 0, 1 / below, np.inf), depth.shape)
    inside = (away < 4.99) & (away < 5 / 1.0)
    assert (ids[inside] == 7).all()
    np.testing.assert_allclose(depth[inside], away[inside], rtol=1e-5)
    assert (ids[away == np.inf] == -1).all()


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0, 2.5])
def test_triangles_with_common_edges_leave_no_gap_and_cover_no_pixel_twice(turn):
    rng = np.random.default_rng(3)
    place = rng.uniform(-1, 1, (40, 2))
    from scipy.spatial import Delaunay

    faces = Delaunay(place).simplices
    points = np.column_stack([place, np.full(40, 2.0)])
    cosine, sine = np.cos(turn), np.sin(turn)
    points[:, :2] = points[:, :2] @ np.array([[cosine, sine], [-sine, cosine]])
    seen = np.zeros((LENS.height, LENS.width), int)
    hull = np.zeros_like(seen)
    for k, face in enumerate(faces):
        mesh = Mesh(points[face][None], np.full((1, 3), 100.0), np.zeros(1, int))
        seen += Renderer([Instance(mesh, np.zeros(3), number=k)]).ids(View(LENS, np.zeros(3)))[1] >= 0
    together = Mesh(points[faces], np.full((len(faces), 3), 100.0), np.zeros(len(faces), int))
    hull = Renderer([Instance(together, np.zeros(3))]).ids(View(LENS, np.zeros(3)))[1] >= 0
    assert (seen == hull).all()
    assert hull.sum() > 500


def test_a_shadow_falls_where_the_sun_is_hidden():
    ground = mesh_of(pane([(-2, 0, -2), (2, 0, -2), (2, 0, 2), (-2, 0, 2)], (0, 1, 0), (100, 100, 100)))
    block = mesh_of(box((-0.2, 0, -0.2), (0.2, 0.5, 0.2), (200, 0, 0)))
    things = [Instance(ground, np.zeros(3), casts_shadow=False), Instance(block, np.zeros(3), number=1)]
    toward = np.array([-1.0, 1.0, 0.0])
    view = View(HOLOLENS_2, np.array([0.0, 4.0, -0.01]), 0.0, -np.pi / 2)
    picture = Renderer(things, Light(toward)).draw(view)
    bare = Renderer(things, Light(toward, shadows=0)).draw(view)
    points = np.array([(0.4, 0, 0), (0.6, 0, 0.1), (0.9, 0, 0), (-0.4, 0, 0), (0.4, 0, 0.4)])
    column, row = np.rint(view.pixels(points)).astype(int).T
    dark = picture.rgb[row, column, 0] < 0.8 * bare.rgb[row, column, 0]
    assert dark.tolist() == [True, True, False, False, False]  # it is as long as the block is high


def test_light_is_that_of_the_formula():
    light = Light(np.array([0.3, 1.0, -0.2]), sun=0.5, sky=0.4, ground=0.2, shadows=0)
    wall = mesh_of(pane([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], (0, 0, -1), (200, 100, 50)))
    rgb = Renderer([Instance(wall, np.zeros(3))], light).draw(View(LENS, np.zeros(3))).rgb[24, 32]
    toward = light.toward / np.linalg.norm(light.toward)
    strength = 0.2 + 0.2 * 0.5 + 0.5 * -toward[2] * -1 * -1
    np.testing.assert_allclose(rgb, np.array([200, 100, 50]) * strength, atol=1)


def test_a_texture_lies_where_its_corners_say():
    texture = np.zeros((8, 8, 3), np.uint8)
    texture[:4, :4], texture[:4, 4:], texture[4:, :4], texture[4:, 4:] = (
        (250, 0, 0),
        (0, 250, 0),
        (0, 0, 250),
        90,
    )
    points = np.array([(-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2)], dtype=float)
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], dtype=float)
    faces = [[0, 1, 2], [0, 2, 3]]
    mesh = Mesh(points[faces], np.zeros((2, 3)), np.zeros(2, int), ("all",), texture, uv[faces])
    flat = Light(sun=0.0, sky=1.0, ground=1.0, shadows=0)
    plain = mesh_of(box((3, 0, 0), (4, 1, 1), (9, 9, 9)))
    for static, moving in (
        ([mesh], []),
        ([], [mesh]),
        ([plain], [mesh]),
        ([mesh], [mesh]),
        ([mesh, plain], [plain]),
    ):
        picture = Renderer([Instance(m, np.zeros(3)) for m in static], flat).draw(
            View(LENS, np.zeros(3)), [Instance(m, np.zeros(3)) for m in moving]
        )
        spots = [
            picture.rgb[row, column].tolist() for row, column in ((14, 22), (14, 42), (34, 22), (34, 42))
        ]
        assert spots == [[250, 0, 0], [0, 250, 0], [0, 0, 250], [90, 90, 90]]


def test_what_moves_is_drawn_like_what_stands():
    instances = soup(5)
    view = View(LENS, np.array([0.0, 0.4, -0.9]), 0.1, -0.3)
    space = ((-1.5, -0.5, -1.0), (1.5, 1.0, 2.0))
    whole = Renderer(instances, shaded=space).draw(view)
    parts = Renderer(instances[:5], shaded=space)
    for _ in range(2):  # the second time from what was kept
        split = parts.draw(view, instances[5:])
        assert (split.rgb == whole.rgb).all()
        assert (split.ids == whole.ids).all()
        assert (split.depth == whole.depth).all()
    elsewhere = View(LENS, np.array([0.1, 0.5, -0.9]), 0.2, -0.3)
    assert (
        parts.draw(elsewhere, instances[5:]).rgb == Renderer(instances, shaded=space).draw(elsewhere).rgb
    ).all()


def test_pixels_agree_with_the_scene_s_camera():
    camera = Camera(np.array([0.5, -0.2]), 0.3, FieldOfView(0.5, 0.5, 3.0), height=0.45, pitch=-0.4)
    view = View.of(camera, HOLOLENS_2)
    point = np.array([0.55, 0.05, 0.6])
    mesh = mesh_of(box((-0.004, -0.004, -0.004), (0.004, 0.004, 0.004), (1, 2, 3)))
    ids = Renderer([Instance(mesh, point, number=4)]).ids(view)[1]
    row, column = np.argwhere(ids == 4).mean(axis=0)
    np.testing.assert_allclose((column, row), view.pixels(point), atol=0.7)


def test_nothing_at_all_is_the_background():
    picture = Renderer([], background=(1, 2, 3)).draw(View(LENS, np.zeros(3)))
    assert (picture.rgb == [1, 2, 3]).all()
    assert (picture.ids == -1).all()
    assert np.isinf(picture.depth).all()


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Intrinsics(0.0, 100, 1, 1, 4, 4), "intrinsics.fx"),
        (lambda: Intrinsics(100, float("nan"), 1, 1, 4, 4), "intrinsics.fy"),
        (lambda: Intrinsics(100, 100, float("inf"), 1, 4, 4), "intrinsics.cx"),
        (lambda: Intrinsics(100, 100, 1, 1, 0, 4), "intrinsics.width, intrinsics.height"),
        (lambda: Intrinsics(100, 100, 1, 1, 100_000, 100_000), "intrinsics.width, intrinsics.height"),
        (lambda: View(LENS, np.array([0, np.nan, 0])), "view.eye"),
        (lambda: View(LENS, np.zeros(3), float("inf")), "view.yaw"),
        (lambda: View.of(Camera(np.zeros(2), 0.0), LENS), "camera.height"),
    ],
)
def test_a_wrong_camera_is_refused_by_name(make, field):
    with pytest.raises(SnapshotError) as caught:
        make()
    assert caught.value.field == field


def test_a_wrong_place_is_refused_by_name():
    mesh = mesh_of(box((0, 0, 0), (1, 1, 1), (1, 1, 1)))
    with pytest.raises(SceneError, match="position"):
        Instance(mesh, np.array([np.nan, 0, 0]))
    with pytest.raises(SceneError, match="yaw"):
        Instance(mesh, np.zeros(3), 1e300)
    with pytest.raises(SceneError, match="number"):
        Instance(mesh, np.zeros(3), number=-1)
