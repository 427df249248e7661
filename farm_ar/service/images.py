"""Snapshots out of images: with a pose estimator, and meshes of what it is to look for."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from farm_ar.arrays import TIME
from farm_ar.errors import OptionError, SnapshotError
from farm_ar.rendering import Mesh
from farm_ar.scenes import Scene, Snapshot
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.refusals import TOO_LARGE, RefusedError
from farm_ar.service.wire import SnapshotBody, frame_of
from farm_ar.vision import PoseEstimator
from farm_ar.vision.photos import categories_in, check_sizes, decoded_image, image_camera_from_dict
from farm_ar.vision.registry import load_estimator


@dataclass(frozen=True)
class Eye:
    """Finds a session's things in images.

    Args:
        estimator: of poses.
        meshes: by category.
    """

    estimator: PoseEstimator
    meshes: Mapping[str, Mesh]

    @classmethod
    def of(cls, meshes: str | os.PathLike[str], estimator: str = "network") -> Eye:
        """An eye with a folder of meshes that are named after their categories.

        Raises:
            MeshError: there are none, or one cannot be used.
            OptionError: there is no such estimator.
        """
        return cls(load_estimator(estimator), categories_in(meshes))

    def look(
        self, camera: Mapping[str, Any], image: bytes, scene: Scene, limits: ServiceLimits
    ) -> SnapshotBody:
        """The snapshot that an image shows.

        Args:
            camera: the contents of a camera file, and `timestamp`.
            image: PNG or JPEG.
            scene: of the session.
            limits: of pixels.

        Raises:
            InputError: the camera or the image cannot be used, or a category has no mesh.
        """
        frame = frame_of(camera)
        values = dict(camera)
        stamp = values.pop("timestamp", None)
        if stamp is not None and (isinstance(stamp, bool) or not isinstance(stamp, int | float)):
            raise SnapshotError("timestamp", TIME.expected, stamp)
        taken = image_camera_from_dict(values)
        lens = taken.view.intrinsics
        if lens.width * lens.height > limits.most_pixels:
            expected = f"must have at most {limits.most_pixels} pixels"
            raise RefusedError(TOO_LARGE, "intrinsics", expected, f"{lens.width} x {lens.height}")
        layout = scene.layout
        lacking = sorted(set(layout.categories) - set(self.meshes))
        if lacking or not layout.names_categories:
            expected = (
                f"must be of categories with a mesh, {', '.join(sorted(self.meshes))}, to look at images"
            )
            raise OptionError("layout", expected, lacking or None)
        meshes = {name: self.meshes[name] for name in layout.categories}
        check_sizes(meshes, scene)
        straight = taken.straightened(decoded_image(image, most_pixels=limits.most_pixels))
        found = self.estimator.estimate(straight, taken.view, meshes)
        return SnapshotBody(
            (Snapshot(taken.camera, found.uncertain, stamp, assumed=taken.assumed),), frame, ()
        )
