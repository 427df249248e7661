"""What cannot be seen or stand where it is said to be: outside the view or the bounds, one pose repeated."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.geometry import bearing, camera_frame, distance, footprint_corners
from farm_ar.reid.plausibility.finding import Finding, named, number
from farm_ar.reid.plausibility.kept import kept
from farm_ar.scenes import PAPER_FIELD_OF_VIEW, Camera, Detections, Layout, Scene, Snapshot, World

SLACK = 0.05
"""By what share of its distance from the camera, and of the bounds, a thing may lie outside."""

_ASSUMED = {
    "fov_left_deg": f"{np.rad2deg(PAPER_FIELD_OF_VIEW.left):.0f}° to the left",
    "fov_right_deg": f"{np.rad2deg(PAPER_FIELD_OF_VIEW.right):.0f}° to the right",
    "range_m": f"{PAPER_FIELD_OF_VIEW.range_m:g} m far",
}
"""What is taken of a view where a file does not give it."""

MOSTLY = 0.8
"""Share of the detections that a camera turned otherwise must have in view to be thought of; and of the
labels that a mirrored map must have inside its bounds."""


def reach_of(seen: Detections, scene: Scene) -> FloatArray:
    """(N,) half the diagonal of each detection's footprint, metres; the scene's usual one where not known."""
    own = np.hypot(seen.size[:, 0], seen.size[:, 2]) / 2
    return np.where(np.isnan(own), usual_reach(scene.layout), own)


@kept
def usual_reach(layout: Layout) -> float:
    """Half the diagonal of the usual label's footprint, metres."""
    usual = np.hypot(layout.size[:, 0], layout.size[:, 2]) / 2
    return float(np.nanmedian(usual)) if np.isfinite(usual).any() else 0.0


def check_view(scene: Scene, snapshot: Snapshot) -> Iterator[Finding]:
    """Detections outside the view of the camera, or a camera that looks another way than is said."""
    seen, camera = snapshot.detections, snapshot.camera
    reach = reach_of(seen, scene)
    outside = _outside_view(seen, camera, float(camera.yaw), reach)
    if not outside.any():
        return
    which = tuple(np.flatnonzero(outside).tolist())
    how_many = f"{number(len(which))} of {len(seen)} outside the camera's view"
    convention = f"{snapshot.world.yaw_words}; degrees in files, radians in Python"
    if outside.mean() >= MOSTLY:
        for yaw, how in _other_headings(float(camera.yaw), snapshot.world):
            if _outside_view(seen, camera, yaw, reach).mean() <= 1 - MOSTLY:
                said = f"{how_many}, which would hold them if {how}: check the camera's heading and its frame"
                yield Finding("camera", f"{said} ({convention})", which)
                return
    if assumed := [_ASSUMED[name] for name in snapshot.assumed]:
        how_many += f", taken to be {', '.join(assumed)} as the file does not say"
    todo = "check the camera's pose, field of view and range, and that its frame and unit are the detections'"
    if snapshot.assumed:
        todo = f"give the camera {named(list(snapshot.assumed))}, and check its pose"
    yield Finding("view", f"{how_many} ({named([seen.ids[i] for i in which])}): {todo}", which)


def _other_headings(yaw: float, world: World) -> Iterator[tuple[float, str]]:
    """Headings that may be meant, and how they would come about, in the numbers of the snapshot's file."""
    xr = " (data of OpenXR, WebXR and ARKit need the frame openxr)" if world.frame == "unity" else ""
    yield yaw + np.pi, f"it were turned around{xr}"
    yield -yaw, "its heading had the other sign"
    yield np.pi - yaw, "its heading were 180° less what it is"
    yield np.pi / 2 - yaw, f"its heading were {'90' if world.frame == 'unity' else '-90'}° less what it is"
    yield float(np.rad2deg(yaw)), "its heading were in radians and had been taken for degrees"


def _outside_view(seen: Detections, camera: Camera, yaw: float, reach: FloatArray) -> BoolArray:
    """(N,) which detections no part of a footprint of that reach brings into view.

    Where the camera has a flat picture, a part of the box in the picture does, too: where a camera looks
    down, the lower corners of its picture reach farther to the sides than its field of view on the plane.
    """
    fov = camera.fov
    away = distance(camera.position, seen.position)
    angle = bearing(camera.position, np.asarray(yaw), seen.position)
    slack = reach + SLACK * away
    beyond = np.maximum(angle - fov.right, -angle - fov.left)
    beyond = np.minimum(
        beyond, np.where(angle > 0, 2 * np.pi - angle - fov.left, 2 * np.pi + angle - fov.right)
    )
    # How far it is to the edge of the view: to the line, or, behind it, to the camera.
    aside = np.where(beyond < np.pi / 2, away * np.sin(np.clip(beyond, 0, np.pi / 2)), away)
    far = away - fov.range_m > slack
    outside: BoolArray = far | ((aside > slack) & _outside_picture(seen, camera, yaw, reach))
    return outside


def _outside_picture(seen: Detections, camera: Camera, yaw: float, reach: FloatArray) -> BoolArray:
    """(N,) which detections' boxes lie wholly beyond one edge of the camera's flat picture.

    A box is as wide all round as its footprint reaches, and of no height where that is not known. All are
    where the camera has no picture.
    """
    fov = camera.fov
    if fov.up is None or fov.down is None or camera.height is None:
        return np.ones(len(seen), dtype=bool)
    wide = np.repeat(2 * reach[:, None], 3, axis=1)
    around = footprint_corners(seen.position, np.full(len(seen), yaw), wide)
    eye = np.array([camera.position[0], float(camera.height), camera.position[1]])
    top = seen.elevation + np.nan_to_num(seen.size[:, 1])
    corner = np.concatenate(
        [np.insert(around, 1, height[:, None], axis=-1) for height in (seen.elevation, top)], axis=1
    )
    right, up, forward = np.moveaxis(
        camera_frame(corner.reshape(-1, 3), eye, yaw, camera.pitch).reshape(len(seen), -1, 3), -1, 0
    )
    slack = SLACK * np.linalg.norm(corner - eye, axis=-1)
    outside = np.zeros(len(seen), dtype=bool)
    for angle, towards in ((fov.left, -right), (fov.right, right), (fov.up, up), (fov.down, -up)):
        beyond = towards * np.cos(angle) - forward * np.sin(angle)
        outside |= (beyond > slack).all(axis=1)
    return outside


def check_bounds(scene: Scene, snapshot: Snapshot) -> Iterator[Finding]:
    """Labels, or detections, that stand outside the bounds; as one finding if all are mirrored."""
    if scene.bounds is None:
        return
    layout, seen, slack = scene.layout, snapshot.detections, bounds_slack(scene)
    beyond = labels_outside(scene)
    if beyond.mean() > 0.5 and (how := _inside_if(scene)):
        said = f"{number(int(beyond.sum()), 'label')} of {len(layout)} outside the scene's bounds, and inside"
        todo = "declare the frame of the scene's file and of the snapshot's (unity, openxr, ros)"
        yield Finding("mirrored", f"{said} with {how}: {todo}")
        return
    if beyond.any():
        names = named([layout.labels[j] for j in np.flatnonzero(beyond)])
        said = f"{number(int(beyond.sum()), 'label')} of {len(layout)} outside the scene's bounds ({names})"
        todo = (
            "give the bounds their origin, or leave them out; of data that is not Unity's declare the frame"
        )
        yield Finding("bounds", f"{said}: {todo}")
    strays = _outside_by(seen.position, scene) > slack + reach_of(seen, scene)
    if strays.any() and not beyond.mean() > 0.5:
        which = tuple(np.flatnonzero(strays).tolist())
        names = named([seen.ids[i] for i in which])
        said = f"{number(len(which))} of {len(seen)} outside the scene's bounds ({names})"
        yield Finding("bounds", f"{said}: check the snapshot's unit, origin and frame, or the bounds", which)


@kept
def labels_outside(scene: Scene) -> BoolArray:
    """(M,) which labels stand outside the bounds."""
    return _places_outside(scene, scene.layout.position)


def _places_outside(scene: Scene, places: FloatArray) -> BoolArray:
    """(M,) which labels would stand outside the bounds at places (M, 2)."""
    size = scene.layout.size
    across = np.hypot(size[:, 0], size[:, 2]) / 2
    outside: BoolArray = _outside_by(places, scene) > bounds_slack(scene) + np.nan_to_num(across)
    return outside


def _inside_if(scene: Scene) -> str:
    """How the map must be mirrored to have the labels inside the bounds; empty if no way does."""
    places, axes = scene.layout.position, scene.world.floor_axes
    for mirrored, how in (
        (places * [1.0, -1.0], f"{axes[1]} the other way"),
        (places * [-1.0, 1.0], f"{axes[0]} the other way"),
        (places[:, ::-1], f"{' and '.join(sorted(axes))} exchanged"),
    ):
        if _places_outside(scene, mirrored).mean() <= 1 - MOSTLY:
            return how
    return ""


def bounds_slack(scene: Scene) -> float:
    """How far outside the bounds a thing may stand, beside its own reach, metres."""
    assert scene.bounds is not None
    return SLACK * float(np.hypot(*np.ptp(scene.bounds.corners, axis=0)))


def _outside_by(points: FloatArray, scene: Scene) -> FloatArray:
    """(P,) how far points lie outside the bounds, metres; 0 within."""
    assert scene.bounds is not None
    start = scene.bounds.corners
    along = np.roll(start, -1, axis=0) - start
    offset = points[:, None] - start
    part = np.clip((offset * along).sum(axis=-1) / (along**2).sum(axis=-1), 0.0, 1.0)
    gap = np.linalg.norm(offset - part[..., None] * along, axis=-1).min(axis=1, initial=np.inf)
    return np.where(scene.bounds.contains(points), 0.0, gap)


def repeated_poses(scene: Scene, seen: Detections) -> list[tuple[int, ...]]:
    """Groups of detections that have one pose, digit by digit, oftener than labels of the scene have one."""
    groups = _same_rows(_poses(seen.position, seen.yaw, seen.elevation))
    usual = _piled(scene.layout)
    return [group for group in groups if len(group) > usual]


@kept
def _piled(layout: Layout) -> int:
    """How many labels have one pose, at most."""
    groups = _same_rows(_poses(layout.position, layout.yaw, layout.elevation))
    return max((len(one) for one in groups), default=1)


def _poses(position: FloatArray, yaw: FloatArray, elevation: FloatArray) -> FloatArray:
    return (
        np.column_stack([position, np.where(np.isnan(yaw), 1e9, yaw), elevation]) + 0.0
    )  # no negative zeros


def _same_rows(rows: FloatArray) -> list[tuple[int, ...]]:
    groups: dict[bytes, list[int]] = {}
    for i, row in enumerate(rows):
        groups.setdefault(row.tobytes(), []).append(i)
    return [tuple(group) for group in groups.values()]


def at_nothing(scene: Scene, snapshot: Snapshot) -> tuple[BoolArray, BoolArray]:
    """(N,) detections exactly at the origin, where no label is, or exactly at the camera."""
    seen, camera, layout = snapshot.detections, snapshot.camera, scene.layout
    zero = (seen.position == 0).all(axis=1) & ((seen.yaw == 0) | np.isnan(seen.yaw))
    if (layout.position == 0).all(axis=1).any():
        zero = np.zeros(len(seen), dtype=bool)
    at_camera = (seen.position == camera.position).all(axis=1)
    return zero, at_camera & ((seen.yaw == camera.yaw) | np.isnan(seen.yaw))


def is_lost(scene: Scene, snapshot: Snapshot) -> BoolArray:
    """(N,) detections whose pose is that of a tracker that has lost them.

    It is exactly the camera's; or several have it to the last digit, at the origin, or of several categories.
    """
    seen = snapshot.detections
    zero, lost = at_nothing(scene, snapshot)
    for group in repeated_poses(scene, seen):
        if len({seen.category[i] for i in group} - {None}) > 1 or zero[list(group)].any():
            lost[list(group)] = True
    return lost


def check_poses(scene: Scene, snapshot: Snapshot) -> Iterator[Finding]:
    """One pose repeated, or that of the origin or the camera: what trackers give for what they have lost."""
    seen = snapshot.detections
    same = sorted(i for group in repeated_poses(scene, seen) for i in group)
    nothing = np.flatnonzero(np.logical_or(*at_nothing(scene, snapshot))).tolist()
    lost = [i for i in nothing if i not in same]
    for which, how in (
        (same, "have one pose, to the last digit"),
        (lost, "exactly at the origin or the camera"),
    ):
        if which:
            at = snapshot.world.point(seen.position[which[0]])
            place = f"{named([seen.ids[i] for i in which])}, at {at}"
            said = f"{number(len(which))} of {len(seen)} {how} ({place})"
            todo = "leave out what the tracker has lost, or reports twice"
            yield Finding("repeated", f"{said}: {todo}", tuple(which))
