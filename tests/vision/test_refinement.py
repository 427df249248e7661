"""Refinement finds the pose that was rendered, whatever the colours."""

import numpy as np
import pytest

from farm_ar.rendering import HOLOLENS_2, Instance, Light, Mesh, Renderer, Sensor, View, model
from farm_ar.rendering.renderer import lens_of
from farm_ar.rendering.shapes import mesh_of, pane
from farm_ar.vision.refinement import Guesses, Solid, refine
from farm_ar.vision.refinement_kernels import RING_PX, VARIANCE, background, show

CAMERA = View(HOLOLENS_2, np.array([0.0, 0.45, -0.6]), 0.0, -0.65)
MESHES = {name: model(name) for name in ("coop", "hutch")}
SOLIDS = {name: Solid.of(mesh) for name, mesh in MESHES.items()}


def refined(image, category, pose, flipped, reach=0.006):
    count = len(pose)
    start = Guesses(tuple(category), pose, flipped, np.full(count, reach), np.ones(count, bool))
    return refine(image, CAMERA, SOLIDS, start)


def repainted(mesh, rng):
    """Each part in a colour of its own."""
    colours = rng.uniform(20, 235, (len(mesh.parts), 3))
    return Mesh(mesh.corners, colours[mesh.part], mesh.part, mesh.parts)


def image_of(category, pose, seed, extra=()):
    rng = np.random.default_rng(seed)
    table = pane([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], (0, 1, 0), rng.uniform(40, 200, 3))
    things = [
        Instance(repainted(MESHES[name], rng), np.array([x, 0.0, z]), yaw)
        for name, (x, z, yaw) in zip(category, pose, strict=True)
    ]
    scene = Renderer([Instance(mesh_of(table), np.zeros(3)), *things, *extra], Light(shadows=512))
    return Sensor().expose(scene.draw(CAMERA).rgb, rng)


POSES = np.array([[0.02, 0.05, 0.4], [0.13, 0.07, -0.9], [-0.2, 0.25, 2.5], [0.0, 0.3, -2.0]])
CATEGORY = ("coop", "hutch", "coop", "hutch")


@pytest.mark.parametrize("seed", range(3))
def test_poses_that_are_millimetres_off_are_put_right(seed):
    image = image_of(CATEGORY, POSES, seed)
    rng = np.random.default_rng(seed + 10)
    start = POSES + rng.choice([-1, 1], POSES.shape) * [0.005, 0.005, 0.08]
    found = refined(image, CATEGORY, start, np.zeros(4))
    away = np.linalg.norm(found.pose[:, :2] - POSES[:, :2], axis=1)
    assert np.median(away) < 0.001
    assert np.median(np.abs(found.pose[:, 2] - POSES[:, 2])) < np.deg2rad(1.0)
    assert away.max() < 0.004
    assert (found.gain > 1).all()
    assert (found.curvature > 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_poses_that_are_centimetres_off_are_found_within_reach(seed):
    image = image_of(CATEGORY, POSES, seed)
    ray = POSES[:, :2] - CAMERA.eye[[0, 2]]
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    start = POSES + np.column_stack([0.022 * ray, np.full(4, 0.15)])
    far = refined(image, CATEGORY, start, np.zeros(4), reach=0.025)
    away = np.linalg.norm(far.pose[:, :2] - POSES[:, :2], axis=1)
    assert np.sort(away)[2] < 0.003


def test_what_another_thing_hides_is_told():
    behind = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.0]])
    image = image_of(("coop", "hutch"), behind, 0)
    found = refined(image, ("coop", "hutch"), behind, np.zeros(2))
    assert found.seen[0] > 0.97
    assert 0.1 < found.seen[1] < 0.8


def test_the_wrong_way_round_costs_more_where_it_is_tried():
    image = image_of(CATEGORY, POSES, 5)
    found = refined(image, CATEGORY, POSES, np.array([0.3, 0.0, 0.3, 0.3]))
    tried = np.array([True, False, True, True])
    assert np.isfinite(found.flip).tolist() == tried.tolist()
    assert (found.flip[tried] > 0).all()
    turned = np.cos(found.opposite[tried, 2] - POSES[tried, 2])
    assert (turned < -0.8).all()


def test_nothing_is_gained_where_nothing_stands():
    image = image_of((), (), 1)
    found = refined(image, ("hutch",), POSES[:1], np.zeros(1))
    assert found.gain[0] < 0.3


def test_what_is_out_of_the_image_or_behind_the_camera_is_left_as_it_is():
    image = image_of((), (), 1)
    pose = np.array([[5.0, 0.0, 0.1], [0.0, -2.0, 0.2]])
    found = refined(image, ("coop", "hutch"), pose, np.full(2, 0.4))
    np.testing.assert_array_equal(found.pose, pose)
    np.testing.assert_array_equal(found.seen, 0.0)


def nats_without(image, region, own, regions):
    """What pixels cost without the thing, pixel by pixel as it is defined."""
    free = (region < 0) & ~own
    whole, found = image[free], np.zeros(region.shape)
    for row, column in np.ndindex(*region.shape):
        if region[row, column] >= 0:
            some, more = image[region == region[row, column]], 0.0
        else:
            window = np.s_[
                max(row - RING_PX, 0) : row + RING_PX + 1, max(column - RING_PX, 0) : column + RING_PX + 1
            ]
            some, more = image[window][free[window]], 4.0
        weight = len(some) + more
        mean = (some.sum(axis=0) + more * whole.mean(axis=0)) / weight
        square = ((some**2).sum(axis=0) + more * (whole**2).mean(axis=0)) / weight
        variance = np.maximum(square - mean**2, 0) + VARIANCE
        found[row, column] = (np.log(variance) / 2 + (image[row, column] - mean) ** 2 / (2 * variance)).sum()
    return found


def test_the_background_is_described_by_what_is_around_and_neighbours_by_their_pieces():
    rng = np.random.default_rng(0)
    image = rng.uniform(0, 255, (24, 31, 3))
    region = np.full((24, 31), -1)
    region[3:12, 4:9], region[10:20, 20:28] = 0, 1
    own = np.zeros((24, 31), bool)
    own[8:18, 8:19] = True
    found = background(image.astype(np.float32), region, own, 2)
    np.testing.assert_allclose(found, nats_without(image, region, own, 2), rtol=2e-4)


def test_what_a_pose_shows_is_what_the_renderer_draws():
    nothing = np.zeros((360, 640), np.float32)
    eye = (CAMERA.eye, np.ascontiguousarray(CAMERA.rotation), lens_of(CAMERA))
    near_the_edge = np.array([[-0.36, 0.1, 0.3], [0.3, -0.05, 1.0], [5.0, 0.0, 0.1]])
    for name, pose in zip((*CATEGORY, "coop", "hutch", "coop"), [*POSES, *near_the_edge], strict=True):
        solid = (SOLIDS[name].corners, SOLIDS[name].piece, 1)
        face, top, left = show(pose, solid, eye, nothing)
        whole = np.full(nothing.shape, -1)
        whole[top : top + face.shape[0], left : left + face.shape[1]] = face
        thing = Instance(MESHES[name], np.array([pose[0], 0.0, pose[1]]), pose[2], 1)
        drawn = Renderer([thing]).ids(CAMERA)[1] == 1
        assert ((whole >= 0) != drawn).sum() <= 0.002 * drawn.sum()
