"""Frames of which the truth is known, and how what was found in them compares with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.geometry import wrap
from farm_ar.rendering import HOLOLENS_2, Intrinsics, Mesh, Renderer, Sensor, View
from farm_ar.vision.canonical import WIDTH, azimuth
from farm_ar.vision.scoring import Frame

MATCHED = 0.5
"""Of a thing's largest side: what is found nearer than that, in the plane, is taken to be it."""


def random_frames(
    meshes: Mapping[str, Mesh], count: int, seed: int, lens: Intrinsics = HOLOLENS_2
) -> Iterator[Frame]:
    """Frames of random scenes, as the network is trained on, by a sensor with noise of SD 8 and JPEG 80."""
    from farm_ar.vision.training.samples import labels_of
    from farm_ar.vision.training.scenes import Stage

    stage = Stage(meshes)
    for number in range(count):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        scene = stage.scene(rng)
        view = View(lens, scene.view.eye, scene.view.yaw, scene.view.pitch)
        behind = rng.uniform(0, 255, 3).tolist()
        picture = Renderer([*scene.rest, *scene.things], scene.light, behind).draw(view)
        whole = np.array([0, lens.width - 1, 0, lens.height - 1]) * WIDTH // lens.width
        told = labels_of(replace(scene, view=view), picture.ids, whole)
        places = np.array([one.position for one in scene.things]).reshape(-1, 3)
        yield Frame(
            f"{number:05d}",
            Sensor().expose(picture.rgb, rng),
            view,
            tuple(stage.names[c] for c in scene.category),
            places[:, [0, 2]],
            np.array([one.yaw for one in scene.things]),
            told[:, 6].astype(np.float64),
            np.array([stage.gap(scene, k) < 0.01 * stage.span for k in range(len(places))], bool),
            np.zeros(len(places), bool),
        )


def document(frame: Frame) -> dict[str, object]:
    """A frame's truth, as its JSON file has it."""
    lens = frame.view.intrinsics
    x, y, z = frame.view.eye.tolist()
    names = ("fx", "fy", "cx", "cy", "width", "height")
    return {
        "image": f"{frame.name}.png",
        "camera": {
            "x": x,
            "y": y,
            "z": z,
            "yaw_deg": float(np.rad2deg(frame.view.yaw)),
            "pitch_deg": float(np.rad2deg(frame.view.pitch)),
        },
        "intrinsics": {name: getattr(lens, name) for name in names},
        "objects": [
            {
                "category": category,
                "x": float(frame.position[k, 0]),
                "z": float(frame.position[k, 1]),
                "yaw_deg": float(np.rad2deg(frame.yaw[k])),
                "visible": float(frame.visible[k]),
                "touching": bool(frame.touching[k]),
            }
            for k, category in enumerate(frame.category)
        ],
    }


def nearest_alike(
    category: tuple[str, ...],
    position: FloatArray,
    true_category: tuple[str, ...],
    true_position: FloatArray,
    sizes: Mapping[str, FloatArray],
) -> IntArray:
    """(M,) which true thing each of M found ones is, by nearness within the category; -1 for none."""
    found = np.full(len(category), -1, np.int64)
    if not (len(category) and len(true_category)):
        return found
    away = np.linalg.norm(position[:, None] - true_position[None], axis=-1)
    reach = np.array([MATCHED * float(sizes[name].max()) for name in true_category])
    same = np.array([[a == b for b in true_category] for a in category])
    cost = np.where(same & (away < reach), away / reach, 10.0)
    rows, columns = linear_sum_assignment(cost)
    right = cost[rows, columns] < 1
    found[rows[right]] = columns[right]
    return found


def errors(camera: View, pose: FloatArray, truth: FloatArray) -> FloatArray:
    """(N, 3) errors of poses (N, 3): away from the eye and to its side, metres, and of the yaw, radians."""
    toward = azimuth(camera, truth[:, :2])
    shift = pose[:, :2] - truth[:, :2]
    sine, cosine = np.sin(toward), np.cos(toward)
    along, across = sine * shift[:, 0] + cosine * shift[:, 1], cosine * shift[:, 0] - sine * shift[:, 1]
    return np.column_stack([along, across, wrap(pose[:, 2] - truth[:, 2])])
