"""A scene from arrays of poses, in whatever frame and units other software has them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from farm_ar.scenes.bounds import Bounds
from farm_ar.scenes.layout import NO_CATEGORY, Layout
from farm_ar.scenes.scene import Scene
from farm_ar.scenes.worlds import World


def from_poses(
    labels: Sequence[str],
    position: npt.ArrayLike | None = None,
    *,
    yaw: npt.ArrayLike | None = None,
    quaternion: npt.ArrayLike | None = None,
    matrix: npt.ArrayLike | None = None,
    size: npt.ArrayLike | None = None,
    category: Sequence[str | None] | str | None = None,
    bounds: Bounds | npt.ArrayLike | None = None,
    frame: str = "unity",
    units: str = "m",
    name: str = "scene",
) -> Scene:
    """A scene of N labelled objects; what is left out is not known.

    Detections and cameras in such a frame are made of what `World(frame, units).read` gives.

    Args:
        labels: N different names.
        position: (N, 3) places in the frame's axes, or (N, 2) on its floor: x and z, or x and y in `ros`.
        yaw: (N,) headings, radians: 0 is forward, positive the way the frame turns about its upward axis; or
        quaternion: (N, 4) as (x, y, z, w), unit, from the object's axes to the world's; or
        matrix: (N, 4, 4) rigid, likewise, which say the places, too.
        size: (N, 3) width (to the right), height and depth (along the heading), or one for all.
        category: N of them, or one for all: objects of one category look alike; None where not known.
        bounds: within which the objects stand: (P, 2) corners on the frame's floor, or bounds in our frame
            and metres.
        frame: unity, openxr (WebXR's, ARKit's and ARCore's, too) or ros.
        units: of lengths: m, cm, mm, km, in, ft or yd.
        name: of the scene.

    Raises:
        SceneError: a value cannot be used; names it.
        OptionError: the frame or the units are not known.
    """
    world, n = World(frame, units), len(labels)
    poses = world.read(position, yaw, quaternion, matrix)
    if bounds is not None and not isinstance(bounds, Bounds):
        bounds = Bounds(world.floor(bounds))
    if category is None or isinstance(category, str):
        category = (category or NO_CATEGORY,) * n
    sizes = np.full(3, np.nan) if size is None else world.lengths(size)
    return Scene(
        name,
        layout=Layout(
            tuple(labels),
            tuple(one or NO_CATEGORY for one in category),
            poses.position,
            poses.yaw,
            np.broadcast_to(sizes, (n, 3)) if sizes.ndim == 1 else sizes,
            poses.elevation,
            tilt=poses.tilt,
        ),
        bounds=bounds,
    )
