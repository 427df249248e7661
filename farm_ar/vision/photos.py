"""Images from files, and their cameras: what may be wrong with them is said in one line."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from farm_ar.arrays import RANGE, FloatArray, Record
from farm_ar.errors import SnapshotError
from farm_ar.geometry import camera_frame, convert_pose
from farm_ar.rendering import Intrinsics, Mesh, MeshError, View, read_mesh
from farm_ar.rendering.camera import MOST_PIXELS
from farm_ar.rendering.mesh import FORMATS
from farm_ar.scenes import Camera, FieldOfView, Scene
from farm_ar.scenes.conversion import Reader, Values
from farm_ar.scenes.declarations import CAMERA
from farm_ar.scenes.files import read_bytes, read_json
from farm_ar.scenes.kinds import NEEDED
from farm_ar.scenes.worlds import rigid, rotation_of
from farm_ar.vision.base import Image, size_of

IMAGE_FORMATS = ("PNG", "JPEG")

_WIDEST = np.deg2rad(89.9)

_SIZES = (0.5, 2.0)
"""How large a mesh may be beside the scene's objects of its category."""


@dataclass(frozen=True, eq=False)
class ImageCamera(Record):
    """The camera of an image.

    Args:
        camera: as a snapshot has it; its field of view is that of the image.
        view: the same with its intrinsics.
        distortion: k1, k2, p1, p2, k3, ... of the lens, as OpenCV has them.
        assumed: fields of the view that its file does not give, as a snapshot's.
    """

    camera: Camera
    view: View
    distortion: tuple[float, ...] = ()
    assumed: tuple[str, ...] = ()

    def straightened(self, image: Image) -> Image:
        """The image (H, W, 3) as a lens without distortion would have taken it.

        Raises:
            SnapshotError: it has not the size that the intrinsics say.
        """
        lens, size = self.view.intrinsics, image.shape[1::-1]
        if size != (lens.width, lens.height):
            expected = f"must be {lens.width} x {lens.height} pixels as the camera's intrinsics say"
            raise SnapshotError("image", expected, f"{size[0]} x {size[1]}")
        if not any(self.distortion):
            return image
        straight = cv2.undistort(image, lens.matrix, np.array(self.distortion))
        return np.asarray(straight, dtype=np.uint8)


def read_image(path: str | os.PathLike[str]) -> Image:
    """An image from a PNG or JPEG file, turned as its EXIF data say.

    Raises:
        SnapshotError: it cannot be read, is neither, or has more than `MOST_PIXELS`.
    """
    return decoded_image(read_bytes(path, SnapshotError), Path(path).name)


def decoded_image(data: bytes, source: str | None = None, most_pixels: int = MOST_PIXELS) -> Image:
    """An image from the bytes of a PNG or JPEG file, turned as its EXIF data say.

    Raises:
        SnapshotError: it cannot be read, is neither, or has too many pixels.
    """
    from io import BytesIO

    from PIL import Image as Pillow
    from PIL import ImageOps, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what is looked at here
            with Pillow.open(BytesIO(data), formats=IMAGE_FORMATS) as opened:
                width, height = opened.size
                if width * height > most_pixels:
                    raise SnapshotError(
                        "image", f"must have at most {most_pixels} pixels", f"{width} x {height}", source
                    )
                pixels = ImageOps.exif_transpose(opened).convert("RGB")
    except SnapshotError:
        raise
    except Pillow.DecompressionBombError:
        raise SnapshotError("image", f"must have at most {most_pixels} pixels", "many more", source) from None
    except Exception as problem:  # Pillow's decoders raise whatever they do
        # What Pillow says of bytes names where they lie in memory.
        unknown = isinstance(problem, UnidentifiedImageError)
        reason = "neither" if unknown else " ".join(str(problem).split()) or type(problem).__name__
        raise SnapshotError("image", "must be a PNG or JPEG file that can be read", reason, source) from None
    return np.array(pixels, dtype=np.uint8)


def read_image_camera(path: str | os.PathLike[str]) -> ImageCamera:
    """A camera from its file.

    Raises:
        SnapshotError: it cannot be read, or a value in it cannot be used; names the file and the field.
    """
    return image_camera_from_dict(read_json(path, SnapshotError), Path(path).name)


def image_camera_from_dict(data: object, source: str | None = None) -> ImageCamera:
    """A camera from the contents of its file.

    Raises:
        SnapshotError: a value cannot be used; names the field.
    """
    reader = Reader(CAMERA, data, source)
    view, given = reader.values["camera"], reader.values["intrinsics"]
    eye = reader.pose(("camera",), view)
    if not reader.height_known(view):
        axis = "xyz"[reader.world.up]
        raise reader.fail(("camera", axis), "must be the height of the eye above the plane", NEEDED)
    if eye.elevation <= 0:
        expected = "must be above the plane on which things stand, at 0"
        raise reader.fail(("camera", "xyz"[reader.world.up]), expected, float(eye.elevation))
    in_space = view["quaternion"] is not None or view["matrix"] is not None
    pitch = float(eye.pitch) if in_space else float(np.deg2rad(view["pitch_deg"]))
    distortion = tuple(given["distortion"])
    try:
        lens = Intrinsics(**{name: given[name] for name in ("fx", "fy", "cx", "cy", "width", "height")})
        roll = _roll(reader, view, float(eye.yaw), pitch) if in_space else 0.0
        fov = _field_of_view(reader, view, lens, roll)
        camera = Camera(eye.position, eye.yaw, fov, eye.elevation, np.asarray(pitch))
        place = np.array([eye.position[0], eye.elevation, eye.position[1]])
        seen = View(lens, place, float(eye.yaw), pitch, roll)
        return ImageCamera(camera, seen, distortion, reader.left_out("camera", ("range_m", "range")))
    except SnapshotError as problem:  # from a constructor, which does not know the file
        raise SnapshotError(problem.field, problem.expected, problem.got, source) from None


def _field_of_view(reader: Reader, view: Values, lens: Intrinsics, roll: float) -> FieldOfView:
    """What the image shows, to an upright camera's edges; how far is the file's to say."""
    across = np.array([-(lens.cx + 0.5), lens.width - 0.5 - lens.cx]) / lens.fx
    upwards = np.array([-(lens.height - 0.5 - lens.cy), lens.cy + 0.5]) / lens.fy
    x, y = np.array([(a, b) for a in across for b in upwards]).T
    right_hand, upright = x * np.cos(roll) - y * np.sin(roll), x * np.sin(roll) + y * np.cos(roll)
    edges = (-right_hand.min(), right_hand.max(), upright.max(), -upright.min())
    left, right, up, down = (float(np.clip(np.arctan(edge), 0.0, _WIDEST)) for edge in edges)
    reach = view["range_m"]
    if view["range"] is not None:
        reach = reader.length(("camera", "range"), view["range"], RANGE)
    return FieldOfView(left, right, reach, up, down)


def _roll(reader: Reader, view: Values, yaw: float, pitch: float) -> float:
    """Of a camera that is given in space: how its right-hand side leans."""
    turn = rigid(view["matrix"])[1] if view["matrix"] is not None else rotation_of(view["quaternion"])
    full = np.eye(4)
    full[:3, :3] = turn
    right = convert_pose(full, reader.world.frame, "unity")[:3, 0]
    if reader.world.heading:
        about = float(reader.world.yaws(np.array(0.0)))
        cosine, sine = np.cos(about), np.sin(about)
        right = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]) @ right
    level, up, _ = camera_frame(np.eye(3), np.zeros(3), yaw, pitch).T
    return float(np.arctan2(right @ up, right @ level))


def read_meshes(folder: str | os.PathLike[str], categories: Iterable[str]) -> dict[str, Mesh]:
    """The mesh of each category from a folder of files that are named after them, as in `coop.glb`.

    Each is moved so that the middle of its foot is at its origin.

    Raises:
        MeshError: one is missing, there are two, or one cannot be used.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise MeshError("meshes", "must be a folder", str(folder))
    meshes = {}
    for category in sorted(set(categories)):
        files = [
            file for file in sorted(folder.iterdir()) if file.stem == category and file.suffix in FORMATS
        ]
        if len(files) != 1:
            expected = f"must have one mesh of category {category!r}: {category} with {', '.join(FORMATS)}"
            raise MeshError("meshes", expected, [file.name for file in files], folder.name)
        mesh = read_mesh(files[0])
        meshes[category] = mesh.fitted(*size_of(mesh))
    return meshes


def check_sizes(meshes: dict[str, Mesh], scene: Scene) -> None:
    """Refuse meshes that are much larger or smaller than the scene's objects of their category.

    Raises:
        MeshError: one is; in other units, it seems.
    """
    layout = scene.layout
    for category, mesh in meshes.items():
        sizes = layout.size[[one == category for one in layout.category]]
        sizes = sizes[np.isfinite(sizes).all(axis=1)]
        if not len(sizes):
            continue
        ratio = float(size_of(mesh).max() / np.median(sizes.max(axis=1)))
        if not _SIZES[0] <= ratio <= _SIZES[1]:
            size = _written(np.median(sizes, axis=0))
            expected = f"must be about as large as in the scene, {size} m (in other units?)"
            raise MeshError(f"meshes[{category!r}]", expected, f"{_written(size_of(mesh))} m")


def _written(size: FloatArray) -> str:
    return " x ".join(f"{side:.3g}" for side in size)


def categories_in(folder: str | os.PathLike[str]) -> dict[str, Mesh]:
    """All meshes of a folder, as `read_meshes` reads them.

    Raises:
        MeshError: there are none, or one cannot be used.
    """
    found = [file.stem for file in Path(folder).glob("*") if file.suffix in FORMATS]
    if not found:
        raise MeshError("meshes", f"must be a folder with files {', '.join(FORMATS)}", str(folder))
    return read_meshes(folder, found)
