"""The check names the cause, not what only follows from it; and it knows where pictures cut things off."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.geometry import footprint_corners
from farm_ar.reid.plausibility import check
from farm_ar.scenes import (
    BUILTIN,
    Bounds,
    Camera,
    Detections,
    FieldOfView,
    Layout,
    LayoutNoise,
    Scene,
    Snapshot,
    builtin_scene,
    observe_many,
)
from farm_ar.vision.photos import image_camera_from_dict

MISLEADING = {"camera", "view", "bounds"}


def kinds(scene, snapshot):
    return [one.kind for one in check(scene, snapshot)]


def looks(scene, count, rng, metres=0.1, degrees=15.0):
    """Snapshots of a built-in scene under the paper's noise, of at least three detections."""
    cameras = scene.camera_path.cameras(60, scene.fov)
    which = rng.integers(60, size=count)
    moved = LayoutNoise.of(metres, degrees).disturb(scene.layout, scene.room, rng, (count,))
    batch = observe_many(moved, Camera(cameras.position[which], cameras.yaw[which], scene.fov))
    every = (batch.snapshot(b) for b in range(count))
    return [one for one in every if len(one.detections) >= 3]


def openxr(position, room):
    return position * [1.0, -1.0]


def about_the_middle(position, room):
    return position * [-1.0, 1.0] + [room[0], 0.0]


@pytest.mark.parametrize("camera_too", [False, True])
@pytest.mark.parametrize(
    ("mirror", "metres", "degrees"), [(openxr, 0.1, 15.0), (about_the_middle, 0.02, 3.0)]
)
def test_a_mirrored_snapshot_is_called_mirrored_and_nothing_that_follows_from_it(
    mirror, metres, degrees, camera_too
):
    rng = np.random.default_rng(11)
    for name in [name for name in BUILTIN if builtin_scene(name).camera_path is not None]:
        scene = builtin_scene(name)
        for one in looks(scene, 4, rng, metres, degrees):
            seen, camera = one.detections, one.camera
            there = replace(
                one, detections=replace(seen, position=mirror(seen.position, scene.room), yaw=-seen.yaw)
            )
            if camera_too:
                there = replace(
                    there,
                    camera=replace(camera, position=mirror(camera.position, scene.room), yaw=-camera.yaw),
                )
            found = set(kinds(scene, there))
            assert "mirrored" in found, name
            assert not found & MISLEADING, name


@pytest.mark.parametrize("axis", [0, 1])
def test_a_map_and_a_snapshot_both_mirrored_are_called_so_where_there_are_bounds(axis):
    """As written by a right-handed engine that does not declare its frame (siemens/ros-sharp #126)."""
    rng, sign = np.random.default_rng(12), np.array([[-1.0, 1.0], [1.0, -1.0]])[axis]
    for name in [name for name in BUILTIN if builtin_scene(name).camera_path is not None]:
        scene = builtin_scene(name)
        layout = scene.layout
        other = Scene("other", scene.room, layout.placed(layout.position * sign, -layout.yaw), fov=scene.fov)
        for one in looks(scene, 3, rng):
            seen, camera = one.detections, one.camera
            there = Snapshot(
                replace(camera, position=camera.position * sign, yaw=-camera.yaw),
                replace(seen, position=seen.position * sign, yaw=-seen.yaw),
            )
            (found,) = [one for one in check(other, there) if one.kind in {"mirrored", *MISLEADING}]
            assert found.kind == "mirrored"
            assert f"{'xz'[axis]} the other way" in found.said


def test_a_map_that_no_mirror_brings_inside_its_bounds_is_not_called_mirrored():
    layout = builtin_scene("lab").layout
    away = layout.placed(layout.position + 50.0, layout.yaw)
    scene = Scene("away", (7.0, 5.0), away)
    seen = Detections(away.category[:5], away.position[:5], away.yaw[:5], away.size[:5])
    camera = Camera(away.position.mean(axis=0), np.asarray(0.0), FieldOfView(np.pi, np.pi, 30.0))
    assert kinds(scene, Snapshot(camera, seen)) == ["bounds"]


def a_thing(rng):
    """One box near a camera that looks down: its pose and size."""
    return rng.uniform(-1.5, 1.5, 2), rng.uniform(-np.pi, np.pi), rng.uniform(0.05, 0.4, 3)


@pytest.mark.parametrize("portrait", [False, True])
def test_what_an_image_shows_a_part_of_is_not_outside_its_view(portrait):
    rng = np.random.default_rng(13 + portrait)
    scene = Scene("one", None, Layout(("a",), ("box",), np.zeros((1, 2)), np.zeros(1), np.full((1, 3), 0.2)))
    width, height, shown, hidden = 640, 360, 0, 0
    for _ in range(400):
        f, pitch, yaw = rng.uniform(250, 900), rng.uniform(-1.4, -0.05), rng.uniform(-3, 3)
        lens = {"fx": f, "fy": f, "cx": 319.5, "cy": 179.5, "width": width, "height": height}
        matrix = pose(rng.uniform(0.3, 1.5), yaw, pitch, np.pi / 2 if portrait else 0.0)
        taken = image_camera_from_dict({"camera": {"matrix": matrix, "range_m": 50.0}, "intrinsics": lens})
        place, turn, size = a_thing(rng)
        corner = footprint_corners(place, turn, size)
        box = np.concatenate([np.insert(corner, 1, level, axis=-1) for level in (0.0, size[1])])
        ahead = taken.view.axes(box)[:, 2] > 0.01
        pixel = taken.view.pixels(box)
        inside = ahead & (pixel >= -0.5).all(axis=1) & (pixel <= [width - 0.5, height - 0.5]).all(axis=1)
        seen = Detections(("box",), place[None], np.array([turn]), size[None])
        warned = bool(set(kinds(scene, Snapshot(taken.camera, seen))) & {"view", "camera"})
        if inside.any():
            shown += 1
            assert not warned
        elif not ahead.any() and np.linalg.norm(place) > 0.7:
            hidden += 1
            assert warned
    assert min(shown, hidden) > 10


def pose(height, yaw, pitch, roll):
    """A camera above the origin as a matrix in Unity's axes: rolled, then pitched up, then turned right."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    about_y = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    cosine, sine = np.cos(-pitch), np.sin(-pitch)
    about_x = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    cosine, sine = np.cos(roll), np.sin(roll)
    about_z = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    full = np.eye(4)
    full[:3, :3] = about_y @ about_x @ about_z
    full[1, 3] = height
    return full.tolist()


def test_a_range_that_an_images_file_does_not_give_is_said_to_be_assumed():
    lens = {"fx": 500.0, "fy": 500.0, "cx": 319.5, "cy": 179.5, "width": 640, "height": 360}
    view = {"x": 0.0, "y": 1.5, "z": 0.0, "yaw_deg": 0.0, "pitch_deg": -10.0}
    taken = image_camera_from_dict({"camera": view, "intrinsics": lens})
    layout = Layout(("a",), ("box",), np.array([(0.0, 9.0)]), np.zeros(1), np.full((1, 3), 0.5))
    scene = Scene("far", None, layout, bounds=Bounds.rectangle(20.0, 20.0, (-10.0, -10.0)))
    seen = Detections(("box",), np.array([(0.0, 9.0)]), np.zeros(1), np.full((1, 3), 0.5))
    (found,) = check(scene, Snapshot(taken.camera, seen, assumed=taken.assumed))
    assert "3 m far as the file does not say" in found.said
    assert image_camera_from_dict({"camera": view | {"range_m": 9.0}, "intrinsics": lens}).assumed == ()
