"""What estimates poses from an image: the contract, and what it answers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from farm_ar.arrays import FloatArray, Record
from farm_ar.errors import SnapshotError
from farm_ar.rendering import Mesh, MeshError, View
from farm_ar.rendering.mesh import LARGEST_M, SMALLEST_M
from farm_ar.scenes import Detections, Uncertainty

Image = npt.NDArray[np.uint8]
"""(H, W, 3) red, green, blue."""


@dataclass(frozen=True, eq=False)
class PoseEstimates(Record):
    """N objects that were found in an image, and how far each pose can be trusted.

    Args:
        detections: their poses on the plane y = 0; the confidence is the score, the probability that there is
            such a thing.
        covariance: (N, 3, 3) of the errors of x, z and yaw, metres and radians.
        visible: (N,) share of what would be seen of each, were it alone, that is seen in the image.
        runner_up_yaw: (N,) the second most probable heading, radians; NaN where there is none.
        runner_up_weight: (N,) its probability, 0 to 0.5; NaN where there is none.

    Raises:
        SnapshotError: a value is out of its limits, or the shapes do not agree.
    """

    detections: Detections
    covariance: FloatArray
    visible: FloatArray
    runner_up_yaw: FloatArray
    runner_up_weight: FloatArray

    def __post_init__(self) -> None:
        names = ("covariance", "visible", "runner_up_yaw", "runner_up_weight")
        try:
            checked = Uncertainty(*(getattr(self, name) for name in names))
        except SnapshotError as problem:
            field = problem.field.replace("uncertainty.", "estimates.")
            raise SnapshotError(field, problem.expected, problem.got) from None
        if len(checked) != len(self.detections):
            expected = f"must have shape {(len(self.detections),)}"
            raise SnapshotError("estimates.visible", expected, checked.visible.shape)
        for name in names:
            object.__setattr__(self, name, getattr(checked, name))

    def __len__(self) -> int:
        return len(self.detections)

    @property
    def score(self) -> FloatArray:
        """(N,) the probability that there is such a thing."""
        return self.detections.confidence

    @property
    def uncertain(self) -> Detections:
        """The detections, with how far each can be trusted: what a snapshot of the image holds."""
        uncertainty = Uncertainty.trusted(
            covariance=self.covariance,
            visible=self.visible,
            runner_up_yaw=self.runner_up_yaw,
            runner_up_weight=self.runner_up_weight,
        )
        return Detections.trusted(**vars(self.detections) | {"uncertainty": uncertainty})


class PoseEstimator(ABC):
    """Finds objects that stand on a plane in an image, and their poses."""

    @abstractmethod
    def estimate(self, image: Image, camera: View, meshes: Mapping[str, Mesh]) -> PoseEstimates:
        """The poses of all objects of some categories that an image shows.

        They stand upright on the plane y = 0. An estimator may be asked for any categories; of those that it
        does not know it finds none. Equal questions get equal answers.

        Args:
            image: (H, W, 3) red, green, blue.
            camera: in its place, with the intrinsics of the image.
            meshes: of each category, to the right, up and ahead of the middle of its foot, metres.

        Raises:
            SnapshotError: the image cannot be the camera's, or the camera is not above the plane.
            MeshError: there is no mesh, or one is not in metres.
        """


def check_question(image: Image, camera: View, meshes: Mapping[str, Mesh]) -> None:
    """Refuse what no estimator can answer.

    Raises:
        SnapshotError: the image cannot be the camera's, or the camera is not above the plane.
        MeshError: there is no mesh, or one is not in metres.
    """
    pixels, lens = np.asarray(image), camera.intrinsics
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3:
        expected = "must be (height, width, 3) of uint8, red, green, blue"
        raise SnapshotError("image", expected, f"{pixels.shape} of {pixels.dtype}")
    if pixels.shape[:2] != (lens.height, lens.width):
        expected = f"must be {lens.width} x {lens.height} pixels as the camera's intrinsics say"
        raise SnapshotError("image", expected, f"{pixels.shape[1]} x {pixels.shape[0]}")
    if camera.eye[1] <= 0:
        expected = "must be above the plane on which things stand, at 0"
        raise SnapshotError("camera.height", expected, float(camera.eye[1]))
    if not meshes:
        raise MeshError("meshes", "must be at least one", 0)
    for name, mesh in meshes.items():
        extent = float(np.ptp(mesh.bounds, axis=0).max())
        if not SMALLEST_M <= extent <= LARGEST_M:
            expected = f"must be from {SMALLEST_M:g} to {LARGEST_M:g} m large (in millimetres?)"
            raise MeshError(f"meshes[{name!r}]", expected, f"{extent:.6g} m")


def size_of(mesh: Mesh) -> FloatArray:
    """(3,) width, height and depth of a mesh, metres."""
    extent: FloatArray = np.ptp(mesh.bounds, axis=0)
    return extent
