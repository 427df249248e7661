"""Fits the estimator's confidence and covariances to its errors on random frames."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.rendering import Mesh
from farm_ar.vision.calibration import PLAIN, Evidence, fit_logistic, fit_spread
from farm_ar.vision.estimator import candidates, evidence_of, guesses_of
from farm_ar.vision.frames import errors, nearest_alike, random_frames
from farm_ar.vision.network import PoseNetwork
from farm_ar.vision.refinement import Solid, refine

SEED = 2**31
"""Of the frames: none is trained on."""

COUNTED = 0.15
"""Share of a thing that must be seen for it to be found rightly."""


def calibrate(
    model: Path, meshes: Mapping[str, Mesh], count: int, report: Callable[[str, float], None]
) -> dict[str, Any]:
    """Fit the calibration of a network on some random frames, and write it into its *.json."""
    network = PoseNetwork(model)
    solids = {name: Solid.of(mesh) for name, mesh in meshes.items()}
    seen: dict[str, list[tuple[Evidence, FloatArray, BoolArray]]] = {"refined": [], "unrefined": []}
    for number, frame in enumerate(random_frames(meshes, count, SEED)):
        truth = np.column_stack([frame.position, frame.yaw])
        found = candidates(frame.image, frame.view, network, meshes)
        refined = refine(frame.image, frame.view, solids, guesses_of(found, meshes))
        for kind, answer in (("unrefined", None), ("refined", refined)):
            pose = found.pose if answer is None else answer.pose
            which = nearest_alike(found.category, pose[:, :2], frame.category, frame.position, network.sizes)
            right = (which >= 0) & (np.append(frame.visible, 0.0)[which] >= COUNTED)
            error = np.full((len(found), 3), np.nan)
            error[which >= 0] = errors(frame.view, pose[which >= 0], truth[which[which >= 0]])
            seen[kind].append((evidence_of(found, answer, frame.view), error, right))
        report(f"calibrating on frame {number + 1} of {count}", (number + 1) / count)
    known = json.loads(model.with_suffix(".json").read_text())
    known["calibration"] = {kind: _fitted(rows) for kind, rows in seen.items()}
    model.with_suffix(".json").write_text(json.dumps(known, indent=1) + "\n")
    return dict(known["calibration"])


def _fitted(rows: list[tuple[Evidence, FloatArray, BoolArray]]) -> dict[str, list[float]]:
    evidence = Evidence.joined([one for one, _, _ in rows])
    error = np.concatenate([one for _, one, _ in rows])
    right = np.concatenate([one for _, _, one in rows])
    there = np.isfinite(error).all(axis=1)
    flipped = there & (np.abs(error[:, 2]) > np.pi / 2)
    straight = there & ~flipped & right
    fitted = {
        "score": fit_logistic(evidence.for_score(), right, np.array(PLAIN["score"])),
        "flip": fit_logistic(evidence.for_flip()[there], flipped[there], np.array(PLAIN["flip"])),
    }
    columns = evidence.for_spread()[straight]
    for axis, name in enumerate(("along", "across", "turn")):
        fitted[name] = fit_spread(columns, error[straight, axis], np.array(PLAIN[name]))
    return fitted
