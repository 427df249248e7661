"""Images, cameras and meshes from files, and what is said of those that are no good."""

import json
import struct
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image as Pillow

from farm_ar.errors import SnapshotError
from farm_ar.geometry import convert_pose, pose_matrix
from farm_ar.rendering import MeshError, View, model
from farm_ar.rendering.modelling import write
from farm_ar.scenes.builtin import builtin_scene
from farm_ar.vision.photos import (
    check_sizes,
    decoded_image,
    image_camera_from_dict,
    read_image,
    read_image_camera,
    read_meshes,
)

LENS = {"fx": 500.0, "fy": 510.0, "cx": 319.5, "cy": 179.5, "width": 640, "height": 360}
EYE = {"x": 0.6, "y": 0.45, "z": -0.3, "yaw_deg": 10.0, "pitch_deg": -25.0}


def camera(**changes):
    return {"camera": EYE | changes.get("camera", {}), "intrinsics": LENS | changes.get("intrinsics", {})}


def test_a_camera_is_read_with_its_view_and_what_it_sees():
    read = image_camera_from_dict(camera())
    assert read.view.eye.tolist() == [0.6, 0.45, -0.3]
    assert read.view.pitch == pytest.approx(np.deg2rad(-25))
    assert read.camera.fov.left == pytest.approx(np.arctan(320 / 500))
    assert read.camera.fov.up == pytest.approx(np.arctan(180 / 510))
    # The ends of the view are the picture's edges, half a pixel beyond the outer pixels' middles.
    point = read.view.eye + read.view.rotation[2] + np.tan(read.camera.fov.right) * read.view.rotation[0]
    assert read.view.pixels(point)[0] == pytest.approx(639.5)


@pytest.mark.parametrize("roll", [0.0, 0.4, -1.2])
@pytest.mark.parametrize("frame", ["unity", "openxr", "ros"])
def test_a_camera_in_space_keeps_its_roll_in_any_frame(frame, roll):
    pose = pose_matrix(np.array([0.6, -0.3]), 0.3, 0.45, -0.5)
    view = View(image_camera_from_dict(camera()).view.intrinsics, pose[:3, 3], 0.3, -0.5, roll)
    pose[:3, :3] = (view.rotation * [[1], [-1], [1]]).T  # right, up, forward in its columns
    given = {"matrix": convert_pose(pose, "unity", frame).tolist()}
    read = image_camera_from_dict({"frame": frame, "camera": given, "intrinsics": LENS})
    np.testing.assert_allclose(read.view.rotation, view.rotation, atol=1e-9)
    np.testing.assert_allclose(read.view.eye, view.eye, atol=1e-9)


def test_a_turned_origin_turns_the_camera_with_its_roll():
    pose = pose_matrix(np.array([0.6, -0.3]), 0.3, 0.45, -0.5)
    view = View(image_camera_from_dict(camera()).view.intrinsics, pose[:3, 3], 0.3, -0.5, 0.4)
    pose[:3, :3] = (view.rotation * [[1], [-1], [1]]).T
    data = {"camera": {"matrix": pose.tolist()}, "intrinsics": LENS, "origin": {"yaw_deg": 70.0}}
    read = image_camera_from_dict(data)
    assert read.view.roll == pytest.approx(0.4)
    assert read.view.yaw == pytest.approx(0.3 + np.deg2rad(70.0))


def test_distortion_is_taken_out_of_the_image():
    read = image_camera_from_dict(camera(intrinsics={"distortion": [-0.25, 0.05, 0.001, -0.001]}))
    grid = np.array([[x, y] for x in (100.0, 320.0, 550.0) for y in (60.0, 180.0, 300.0)])
    lens = read.view.intrinsics.matrix
    rays = np.column_stack([(grid - [319.5, 179.5]) / [500.0, 510.0], np.ones(len(grid))])
    none, bent = np.zeros(3), np.array(read.distortion)
    seen = cv2.projectPoints(rays, none, none, lens, bent)[0].reshape(-1, 2)
    image = np.zeros((360, 640, 3), np.uint8)
    rows, columns = np.mgrid[:360, :640]
    for x, y in seen:
        image[np.hypot(columns - x, rows - y) < 5] = 255
    straight = read.straightened(image)
    for x, y in grid:
        near = np.hypot(columns - x, rows - y) < 9
        spot = near * straight[..., 0].astype(float)
        assert (columns * spot).sum() / spot.sum() == pytest.approx(x, abs=0.5)
        assert (rows * spot).sum() / spot.sum() == pytest.approx(y, abs=0.5)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"intrinsics": {"fx": 0}}, r"cam\.json: intrinsics\.fx: must be a positive number"),
        ({"intrinsics": {"fy": float("nan")}}, r"intrinsics\.fy"),
        ({"intrinsics": {"cx": "left"}}, r"intrinsics\.cx"),
        ({"intrinsics": {"width": 0}}, r"intrinsics\.width"),
        ({"intrinsics": {"width": 16384, "height": 16384}}, r"intrinsics\.width.*at most"),
        ({"intrinsics": {"distortion": [1, 2]}}, r"intrinsics\.distortion: must be a list of 4, 5 or 8"),
        ({"camera": {"y": -0.1}}, r"cam\.json: camera\.y: must be above the plane"),
        ({"camera": {"y": None}}, r"camera\.y"),
        ({"camera": {"x": 1e9}}, r"cam\.json: camera\.position"),
    ],
)
def test_a_camera_that_cannot_be_is_refused_in_one_line(tmp_path, changes, said):
    file = tmp_path / "cam.json"
    file.write_text(json.dumps(camera(**changes)))
    with pytest.raises(SnapshotError, match=said):
        read_image_camera(file)


def test_a_camera_without_height_is_refused():
    data = camera()
    del data["camera"]["y"]
    with pytest.raises(SnapshotError, match="height of the eye above the plane, got nothing"):
        image_camera_from_dict(data)


def test_images_are_read_as_they_are_and_turned_as_they_say(tmp_path):
    image = np.random.default_rng(0).integers(0, 255, (8, 12, 3), dtype=np.uint8)
    Pillow.fromarray(image).save(tmp_path / "a.png")
    assert (read_image(tmp_path / "a.png") == image).all()
    exif = Pillow.Exif()
    exif[0x0112] = 6  # the camera was held upright
    Pillow.fromarray(image).save(tmp_path / "b.jpg", exif=exif, quality=100)
    assert read_image(tmp_path / "b.jpg").shape == (12, 8, 3)
    Pillow.fromarray(image[..., 0]).save(tmp_path / "grey.png")
    assert read_image(tmp_path / "grey.png").shape == (8, 12, 3)


def png_of(width, height):
    """The beginning of a PNG of so many pixels, a few bytes."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "must be a PNG or JPEG"),
        (b"nonsense", "must be a PNG or JPEG"),
        (png_of(30_000, 30_000), "must have at most"),
        (png_of(12_000, 12_000), "must have at most"),
        (png_of(64, 64), "must be a PNG or JPEG"),
        (b"GIF89a" + bytes(50), "must be a PNG or JPEG"),
    ],
)
def test_what_is_no_image_is_refused_in_one_line(tmp_path, data, said):
    file = tmp_path / "snap.png"
    file.write_bytes(data)
    with pytest.raises(SnapshotError, match=said) as caught:
        read_image(file)
    assert "\n" not in str(caught.value)
    assert "snap.png" in str(caught.value)
    with pytest.raises(SnapshotError, match="readable"):
        read_image(tmp_path / "none.png")


def test_an_image_of_another_size_is_refused():
    with pytest.raises(SnapshotError, match=r"640 x 360 .*10 x 20"):
        image_camera_from_dict(camera()).straightened(np.zeros((20, 10, 3), np.uint8))


def test_meshes_are_read_by_category_with_their_foot_at_the_origin(tmp_path):
    for name in ("coop", "hutch"):
        write(model(name), tmp_path / f"{name}.glb")
    meshes = read_meshes(tmp_path, ["hutch", "coop", "coop"])
    assert list(meshes) == ["coop", "hutch"]
    np.testing.assert_allclose(meshes["coop"].bounds[0, 1], 0.0)
    np.testing.assert_allclose(meshes["coop"].bounds.mean(axis=0)[[0, 2]], 0.0, atol=1e-9)
    check_sizes(meshes, builtin_scene("farm"))
    with pytest.raises(MeshError, match="must have one mesh of category 'shed'"):
        read_meshes(tmp_path, ["coop", "shed"])
    (tmp_path / "coop.obj").write_text("v 0 0 0\n")
    with pytest.raises(MeshError, match=r"one mesh of category 'coop'.*coop\.glb.*coop\.obj"):
        read_meshes(tmp_path, ["coop"])
    with pytest.raises(MeshError, match="folder"):
        read_meshes(tmp_path / "nowhere", ["coop"])


def test_meshes_that_are_empty_or_in_other_units_are_refused(tmp_path):
    (tmp_path / "coop.obj").write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(MeshError, match=r"coop\.obj"):
        read_meshes(tmp_path, ["coop"])
    big = model("coop").fitted(100.0, 80.0, 90.0)
    write(big, tmp_path / "hutch.glb")
    with pytest.raises(MeshError, match="millimetres"):
        read_meshes(tmp_path, ["hutch"])
    write(model("coop").fitted(10.0, 8.0, 9.0), tmp_path / "shed.glb")
    with pytest.raises(MeshError, match="about as large as in the scene"):
        check_sizes({"coop": read_meshes(tmp_path, ["shed"])["shed"]}, builtin_scene("farm"))


def test_an_unreadable_image_is_refused_in_the_same_words_each_time():
    said = []
    for _ in range(2):
        with pytest.raises(SnapshotError) as caught:
            decoded_image(b"no picture")
        said.append(str(caught.value))
    assert said[0] == said[1]
    assert " at 0x" not in said[0]
