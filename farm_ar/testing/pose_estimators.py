"""Whether a pose estimator keeps its contract."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from farm_ar.errors import InputError
from farm_ar.rendering import HOLOLENS_2, Instance, Mesh, Renderer, Sensor, View, model
from farm_ar.rendering.shapes import mesh_of, pane
from farm_ar.testing.comparison import attempt, difference, require
from farm_ar.vision import PoseEstimates, PoseEstimator
from farm_ar.vision.base import Image, size_of

MakeEstimator = Callable[[], PoseEstimator]


def check_pose_estimator(
    make_estimator: MakeEstimator,
    meshes: Mapping[str, Mesh] | None = None,
    *,
    nearest_m: float | None = None,
    seed: int = 0,
) -> None:
    """Run every check on a pose estimator.

    It must answer any image of its camera: of objects on a table, of an empty one, black, noise, small, tall,
    from straight above. What it finds are of the categories asked for and of their meshes' sizes; the same
    question gets the same answer, from another instance too; the question is left as it was. What cannot be
    answered is refused in one line: an image of other pixels than the camera's, a camera below the table, no
    mesh, a mesh in millimetres.

    Args:
        make_estimator: makes it.
        meshes: of the categories asked for; the farm's buildings by default.
        nearest_m: how near to its place something must be found that stands alone in the middle of the image,
            metres; None for an estimator that is not to be judged.
        seed: of all randomness.

    Raises:
        AssertionError: what broke.
    """
    known = dict(meshes or {name: model(name) for name in ("coop", "hutch")})
    with attempt("making it"):
        estimator, another = make_estimator(), make_estimator()
    require(isinstance(estimator, PoseEstimator), "it is no PoseEstimator")
    for kind, image, camera in images_of(known, np.random.default_rng(seed)):
        kept = image.copy()
        answer = _answer(estimator, image, camera, known, kind)
        require(np.array_equal(image, kept), f"{kind}: the image was changed")
        _check_answer(answer, known, kind)
        for whose, other in (("second", estimator), ("another instance's", another)):
            again = _answer(other, image, camera, known, kind)
            where = difference(_values(answer), _values(again))
            require(where is None, f"{kind}: the {whose} answer differs from the first in {where}")
    if nearest_m is not None:
        _check_places(estimator, known, nearest_m)
    _check_refusals(estimator, known)


def images_of(meshes: Mapping[str, Mesh], rng: np.random.Generator) -> Iterator[tuple[str, Image, View]]:
    """Images of many kinds, each with the name of its kind and its camera."""
    things = list(meshes.values())
    places = rng.permutation(
        np.stack(np.meshgrid([-0.3, 0.0, 0.3], [-0.2, 0.1, 0.4]), axis=-1).reshape(-1, 2)
    )
    span = float(np.max([size_of(mesh).max() for mesh in things])) / 0.1
    standing = [
        Instance(things[k % len(things)], np.array([x * span, 0.0, z * span]), rng.uniform(-0.5, 0.5))
        for k, (x, z) in enumerate(places)
    ]
    camera = _looking(span)
    shape = (camera.intrinsics.height, camera.intrinsics.width, 3)
    yield "things on a table", _picture(standing, span, camera, rng), camera
    yield "an empty table", _picture([], span, camera, rng), camera
    yield "black", np.zeros(shape, np.uint8), camera
    yield "noise", rng.integers(0, 256, shape, dtype=np.uint8), camera
    for kind, width, height in (("small", 64, 36), ("tall", 120, 200), ("large", 1280, 720)):
        other = replace(camera, intrinsics=camera.intrinsics.resized(width, height))
        yield kind, _picture(standing, span, other, rng), other
    above = replace(camera, eye=np.array([0.0, 1.0 * span, 0.0]), pitch=-np.pi / 2)
    yield "from straight above", _picture(standing, span, above, rng), above
    away = replace(camera, pitch=0.9)
    yield "looking up", _picture(standing, span, away, rng), away
    rolled = replace(camera, roll=0.3)
    yield "rolled", _picture(standing, span, rolled, rng), rolled


def _looking(span: float) -> View:
    eye = np.array([0.0, 0.45, -0.6]) * span
    return View(HOLOLENS_2, eye, 0.0, -float(np.arctan2(0.45, 0.6)))


def _picture(things: list[Instance], span: float, camera: View, rng: np.random.Generator) -> Image:
    far = 0.8 * span
    top = pane([(-far, 0, -far), (far, 0, -far), (far, 0, far), (-far, 0, far)], (0, 1, 0), (120, 150, 90))
    table = Instance(mesh_of(top), np.zeros(3), casts_shadow=False)
    return Sensor().expose(Renderer([table, *things], smooth=True).draw(camera).rgb, rng)


def _answer(
    estimator: PoseEstimator, image: Image, camera: View, meshes: Mapping[str, Mesh], kind: str
) -> PoseEstimates:
    with attempt(f"{kind}: estimate"):
        return estimator.estimate(image, camera, meshes)


def _check_answer(answer: PoseEstimates, meshes: Mapping[str, Mesh], kind: str) -> None:
    right = isinstance(answer, PoseEstimates)
    require(right, f"{kind}: the answer must be PoseEstimates, is {type(answer).__name__}")
    found = answer.detections
    for k, category in enumerate(found.category):
        require(category in meshes, f"{kind}: detection {k} is a {category}, which was not asked for")
        same = np.allclose(found.size[k], size_of(meshes[str(category)]), rtol=1e-6)
        require(same, f"{kind}: detection {k} is {found.size[k]} m large, its mesh is not")
    require(not found.elevation.any(), f"{kind}: something does not stand on the plane")


def _check_places(estimator: PoseEstimator, meshes: Mapping[str, Mesh], nearest_m: float) -> None:
    for name, mesh in meshes.items():
        span = float(size_of(mesh).max()) / 0.1
        place, camera = np.array([0.1, 0.05]) * span, _looking(span)
        thing = Instance(mesh, np.array([place[0], 0.0, place[1]]), 0.3)
        image = _picture([thing], span, camera, np.random.default_rng(0))
        found = _answer(estimator, image, camera, {name: mesh}, f"a {name} alone").detections
        away = np.linalg.norm(found.position - place, axis=1).min(initial=np.inf)
        require(away <= nearest_m, f"a {name} alone is found {away:.3g} m from its place")


def _check_refusals(estimator: PoseEstimator, meshes: Mapping[str, Mesh]) -> None:
    camera = _looking(1.0)
    lens = camera.intrinsics
    image = np.zeros((lens.height, lens.width, 3), np.uint8)
    name, mesh = next(iter(meshes.items()))
    millimetres = {name: replace(mesh, corners=mesh.corners * 1e4 / size_of(mesh).max())}
    below = replace(camera, eye=camera.eye * [1, -1, 1])
    for kind, question in {
        "an image of other pixels than the camera's": (image[:-1], camera, meshes),
        "an image without colours": (image[..., 0], camera, meshes),
        "an image of floats": (image.astype(float), camera, meshes),
        "a camera below the table": (image, below, meshes),
        "no mesh": (image, camera, {}),
        "a mesh in millimetres": (image, camera, millimetres),
    }.items():
        try:
            estimator.estimate(*question)
        except InputError:
            continue
        except Exception as problem:
            raise AssertionError(f"{kind} raised {type(problem).__name__}, not an InputError") from problem
        require(False, f"{kind} was not refused")


def _values(answer: PoseEstimates) -> dict[str, object]:
    found = answer.detections
    names = ("covariance", "visible", "runner_up_yaw", "runner_up_weight")
    return {name: getattr(answer, name) for name in names} | {
        name: getattr(found, name) for name in ("category", "position", "yaw", "size", "confidence", "ids")
    }
