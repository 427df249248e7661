"""Poses from pictures of the farm whose camera is not quite known, with and without putting it right.

    python benchmarks/camera_refinement.py [--pictures N] [--seed N]

The camera's place is off by 1 cm and its direction by half a degree, root mean square of the whole vectors.
Errors are of what the estimator finds; "lifted" are true pixels of the buildings' feet, lifted through the
camera: no estimator does better without putting the camera right.
"""

from __future__ import annotations

import argparse

import numpy as np

from farm_ar.rendering import Instance, View
from farm_ar.scenes import builtin_scene
from farm_ar.vision import Landmarks, NetworkEstimator, meshes_of
from farm_ar.vision.canonical import on_plane
from farm_ar.vision.measured_noise import moments_of
from farm_ar.vision.perception import PixelPerception, source_of

RIM_M = 0.016
"""Of the table in the game's pictures."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--pictures", type=int, default=60)
    parser.add_argument("--seed", type=int, default=50)
    asked = parser.parse_args()
    scene = builtin_scene("farm")
    perception, meshes = PixelPerception(scene), meshes_of(scene)
    home = scene.layout
    fixed = [
        Instance(meshes[home.category[k]], np.insert(home.position[k], 1, 0.0), float(home.yaw[k]))
        for k in np.flatnonzero(home.fixed)
    ]
    plain = NetworkEstimator()
    righted = NetworkEstimator(landmarks=Landmarks.of_table(*scene.size, fixed, RIM_M))
    away: dict[str, list[float]] = {"lifted": [], "estimated": [], "estimated, camera put right": []}
    for number, (truth, camera) in enumerate(moments_of(scene, asked.pictures, asked.seed)):
        rng = np.random.default_rng([asked.seed, number])
        image, view = perception.picture(truth, camera, rng)
        shift, turn = (sd / np.sqrt(3) * rng.standard_normal(3) for sd in (0.01, np.deg2rad(0.5)))
        angles = np.array([view.yaw, view.pitch, view.roll]) + turn
        wrong = View(view.intrinsics, view.eye + shift, *angles.tolist())
        pixel = view.pixels(np.insert(truth.position, 1, 0.0, axis=1))
        seen = (pixel > 0).all(axis=1) & (pixel < [640, 360]).all(axis=1)
        lifted = on_plane(wrong, pixel[seen]) - truth.position[seen]
        away["lifted"] += np.linalg.norm(lifted, axis=1).tolist()
        for name, estimator in (("estimated", plain), ("estimated, camera put right", righted)):
            found = estimator.estimate(image, wrong, meshes).detections
            source = source_of(found.category, found.position, truth)
            error = found.position[source >= 0] - truth.position[source[source >= 0]]
            away[name] += np.linalg.norm(error, axis=1).tolist()
    for name, errors in away.items():
        median, most = 100 * np.percentile(errors, [50, 90])
        print(f"{name}: {len(errors)} buildings, median {median:.2f} cm, 90% within {most:.2f} cm")


if __name__ == "__main__":
    main()
