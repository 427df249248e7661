"""`farm-ar identify --image`: the snapshot that an image shows, and the image with the answer drawn on it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from farm_ar.cli.inputs import need
from farm_ar.cli.options import writing
from farm_ar.cli.output import saying
from farm_ar.drawing.game.colours import label_colours
from farm_ar.drawing.photos import draw_on_image
from farm_ar.errors import OptionError
from farm_ar.reid import Identification
from farm_ar.rendering import Mesh
from farm_ar.scenes import NO_CATEGORY, Scene, Snapshot
from farm_ar.vision import PoseEstimates
from farm_ar.vision.base import Image
from farm_ar.vision.photos import (
    ImageCamera,
    check_sizes,
    read_image,
    read_image_camera,
    read_meshes,
)
from farm_ar.vision.registry import load_estimator

_UNKNOWN = (170, 170, 176)
"""The colour of what has no label."""


class Photo(NamedTuple):
    """An image and what was found in it.

    Attributes:
        image: (H, W, 3), without the lens' distortion.
        camera: of the image.
        meshes: of the scene's categories.
        estimates: what was found.
        snapshot: the same without what a snapshot has no place for.
    """

    image: Image
    camera: ImageCamera
    meshes: dict[str, Mesh]
    estimates: PoseEstimates
    snapshot: Snapshot


def read_photo(
    scene: Scene, image: Path, camera: str | None, meshes: Path | None, estimator: str = "network"
) -> Photo:
    """Find the scene's categories in an image.

    Raises:
        OptionError: an option is missing, or there is no such estimator.
        SnapshotError: image or camera cannot be used.
        MeshError: a mesh is missing or cannot be used.
    """
    form = "with --image: a .json file with camera and intrinsics"
    file = need("--camera", camera, form)
    if Path(file).suffix.lower() != ".json":
        raise OptionError("--camera", f"must be given {form}", file)
    folder = need("--meshes", None if meshes is None else str(meshes), "with --image: a folder of meshes")
    layout = scene.layout
    if not layout.names_categories:
        raise OptionError("scene", "must give every object a category with --image", NO_CATEGORY)
    found = read_image_camera(file)
    seen = found.straightened(read_image(image))
    solid = read_meshes(folder, layout.category)
    check_sizes(solid, scene)
    judge = load_estimator(estimator, "--estimator")
    with saying("Looking at the image"):
        estimates = judge.estimate(seen, found.view, solid)
    snapshot = Snapshot(found.camera, estimates.uncertain, assumed=found.assumed)
    return Photo(seen, found, solid, estimates, snapshot)


def draw_photo(scene: Scene, photo: Photo, found: Identification, path: Path) -> None:
    """Write the image with outlines, labels and confidences.

    Raises:
        OptionError: the file cannot be written, or is no .png or .jpg.
    """
    from PIL import Image as Pillow

    if path.suffix.lower() not in (".png", ".jpg", ".jpeg"):
        raise OptionError("--plot", "must end in .png or .jpg with --image", str(path))
    seen, layout = photo.estimates.detections, scene.layout
    colour_of = dict(zip(layout.labels, label_colours(layout.labels), strict=True))
    sure = found.confidence
    texts, colours, things = [], [], []
    for k, label in enumerate(found.labels):
        category = seen.category[k] or ""
        words = label or f"{category}, no label"
        texts.append(words if sure is None else f"{words} {100 * sure[k]:.0f}%")
        colours.append(_UNKNOWN if label is None else colour_of[label])
        things.append((photo.meshes[category], seen.position[k], float(seen.yaw[k])))
    picture = draw_on_image(photo.image, photo.camera.view, things, texts, colours)
    with writing("--plot", path):
        Pillow.fromarray(picture).save(path)
