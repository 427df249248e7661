"""Whether the check has nothing to say of a snapshot, which is so of most: one compiled call finds out.

It computes bounds of what `check` and `set_aside` compute, from the same densities, and stops where they are
not conclusive: then those two say what there is, if anything.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from farm_ar.arrays import FloatArray, IntArray
from farm_ar.kernels import compiled
from farm_ar.reid.plausibility.kept import kept
from farm_ar.reid.plausibility.look_alikes import check_names
from farm_ar.reid.plausibility.patterns import MOST_DETECTIONS, places_of
from farm_ar.reid.plausibility.quiet_frames import as_given
from farm_ar.reid.plausibility.quiet_places import Labels, apart, in_place
from farm_ar.reid.plausibility.view import bounds_slack, labels_outside, usual_reach
from farm_ar.scenes import UNKNOWN, Scene, Snapshot

_compile = compiled(error_model="numpy")

_NO_CORNERS: FloatArray = np.zeros((0, 2))


class _Kept(NamedTuple):
    """What follows from a scene: its labels for the kernel, the codes of its categories, whether it is right.

    Args:
        labels: for the kernel.
        codes: of the categories; None for one that is not known.
        right: whether nothing is said of the scene itself.
    """

    labels: Labels
    codes: dict[str | None, int]
    right: bool


@kept
def _known(scene: Scene) -> _Kept:
    layout, places = scene.layout, places_of(scene)
    bounds = scene.bounds
    labels = Labels(
        np.array(layout.position),
        np.array(layout.yaw),
        np.array(places.period, dtype=np.float64),
        np.array(layout.category_code),
        np.log(layout.size).mean(axis=1),
        _NO_CORNERS if bounds is None else np.array(bounds.corners),
        np.array(places.widths),
        (
            places.spacing,
            places.extent,
            usual_reach(layout),
            0.0 if bounds is None else bounds_slack(scene),
        ),
    )
    right = not check_names(layout) and (bounds is None or not labels_outside(scene).any())
    return _Kept(labels, {name: i for i, name in enumerate(layout.categories)} | {None: UNKNOWN}, right)


class Quiet(NamedTuple):
    """What there is certainly nothing to say of.

    Args:
        check: whether `check` finds nothing, or is not asked.
        aside: whether `set_aside` sets nothing aside.
    """

    check: bool
    aside: bool


LOUD = Quiet(False, False)
"""There may be something to say of anything."""


def quiet(scene: Scene, snapshot: Snapshot, checks: bool = True) -> Quiet:
    """What of `check` and `set_aside` has nothing to say; False where that is not obvious.

    Args:
        scene: the reference layout and its place.
        snapshot: what was seen.
        checks: whether `check` is asked; without it only what is set aside counts.
    """
    seen, camera = snapshot.detections, snapshot.camera
    if not len(seen) or not len(scene.layout):
        return LOUD
    labels, codes, right = _known(scene)
    try:
        category = np.array([codes[name] for name in seen.category])
    except KeyError:
        return LOUD
    fov = camera.fov
    eye = (float(camera.position[0]), float(camera.position[1]), float(camera.yaw))
    view = (fov.left, fov.right, fov.range_m)
    poses = np.column_stack([seen.position, seen.yaw, seen.elevation, seen.size])
    if not math.isfinite(poses[:, :2].sum()):
        return LOUD
    asked = checks and right
    check, aside = _nothing_to_say(poses, category, eye, view, labels, asked, _compared(len(seen)))
    return Quiet(check and asked == checks, aside)


@lru_cache(maxsize=256)
def _compared(n: int) -> IntArray:
    """Which of n detections are compared with the map."""
    return np.linspace(0, n - 1, min(n, MOST_DETECTIONS)).astype(np.int64)


@_compile
def _nothing_to_say(
    poses: FloatArray,
    category: IntArray,
    eye: tuple[float, float, float],
    view: tuple[float, float, float],
    labels: Labels,
    checks: bool,
    some: IntArray,
) -> tuple[bool, bool]:
    """`quiet`, of detections as `apart` has them and a camera as `in_place` has it."""
    poses_differ, single = apart(poses, category, eye[:2], labels)
    if not poses_differ:
        return False, False
    if not checks:
        return True, single
    right = in_place(poses, category, eye, view, labels) and as_given(poses[some], category[some], labels)
    return right, single
