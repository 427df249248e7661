"""The conformance test of pose estimators passes one that keeps the contract, and finds what is broken."""

from dataclasses import replace

import numpy as np
import pytest

from farm_ar.errors import SnapshotError
from farm_ar.rendering import model
from farm_ar.scenes import Detections
from farm_ar.testing import check_pose_estimator
from farm_ar.vision import PoseEstimates, PoseEstimator, check_question
from farm_ar.vision.base import size_of


def estimates(meshes, **changes):
    """One thing of each category at the origin."""
    n = len(meshes)
    values = {
        "category": tuple(meshes),
        "position": np.zeros((n, 2)),
        "yaw": np.zeros(n),
        "size": np.array([size_of(mesh) for mesh in meshes.values()]),
    }
    nothing = np.full(n, np.nan)
    spread = np.tile(np.diag([1e-6, 1e-6, 1e-4]), (n, 1, 1))
    return PoseEstimates(Detections(**values | changes), spread, np.ones(n), nothing, nothing)


class Constant(PoseEstimator):
    def estimate(self, image, camera, meshes):
        check_question(image, camera, meshes)
        return estimates(meshes)


def test_one_that_keeps_the_contract_passes():
    check_pose_estimator(Constant)


class Careless(Constant):
    def estimate(self, image, camera, meshes):
        return estimates(meshes)


class Restless(Constant):
    def __init__(self):
        self.rng = np.random.default_rng(0)

    def estimate(self, image, camera, meshes):
        found = super().estimate(image, camera, meshes)
        moved = replace(found.detections, position=self.rng.normal(size=(len(meshes), 2)))
        return replace(found, detections=moved)


class Inventive(Constant):
    def estimate(self, image, camera, meshes):
        super().estimate(image, camera, meshes)
        return estimates(meshes, category=("dragon",) * len(meshes))


class Giant(Constant):
    def estimate(self, image, camera, meshes):
        super().estimate(image, camera, meshes)
        return estimates(meshes, size=np.ones((len(meshes), 3)))


class Painter(Constant):
    def estimate(self, image, camera, meshes):
        found = super().estimate(image, camera, meshes)
        image[:] = 0
        return found


class Dizzy(Constant):
    def estimate(self, image, camera, meshes):
        if camera.roll:
            raise RuntimeError("a rolled camera")
        return super().estimate(image, camera, meshes)


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (Careless, "an image of other pixels than the camera's was not refused"),
        (Restless, "the second answer differs from the first in .*position"),
        (Inventive, "detection 0 is a dragon, which was not asked for"),
        (Giant, "its mesh is not"),
        (Painter, "the image was changed"),
        (Dizzy, "rolled: estimate raised RuntimeError: a rolled camera"),
    ],
)
def test_what_is_broken_is_found_and_named(broken, said):
    with pytest.raises(AssertionError, match=said):
        check_pose_estimator(broken)


def test_places_are_judged_where_that_is_asked_for():
    with pytest.raises(AssertionError, match=r"a coop alone is found 0\.11.* m from its place"):
        check_pose_estimator(Constant, nearest_m=0.05)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("covariance", -np.eye(3)[None]),
        ("covariance", np.array([[[1, 2, 0], [0, 1, 0], [0, 0, 1.0]]])),
        ("covariance", np.eye(3)),
        ("visible", [1.2]),
        ("runner_up_weight", [0.3]),
        ("runner_up_yaw", [0.1]),
    ],
)
def test_estimates_that_cannot_be_are_refused(field, value):
    right = estimates({"coop": model("coop")})
    with pytest.raises(SnapshotError, match=r"estimates\."):
        replace(right, **{field: value})
