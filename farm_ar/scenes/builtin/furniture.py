"""What the built-in rooms are described in: models of furniture, pieces of them, groups, and wandering paths.

A group of pieces is described about its own centre, then placed in the room and turned. Headings stand in
degrees here, as in a scene file, because they are written by hand; `furnish` makes radians of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from farm_ar.scenes.camera import PAPER_FIELD_OF_VIEW, CameraPath, FieldOfView
from farm_ar.scenes.layout import Layout
from farm_ar.scenes.scene import Scene, Site, Template, Weights

Point = tuple[float, float]
"""A place as (x, z), metres."""


@dataclass(frozen=True)
class Model:
    """A make of furniture: its category and its width, height and depth, metres."""

    category: str
    size: tuple[float, float, float]


@dataclass(frozen=True)
class Piece:
    """One piece of furniture: its model, where its pivot is, its heading, and its label where it has one."""

    model: Model
    x: float = 0.0
    z: float = 0.0
    yaw_deg: float = 0.0
    label: str | None = None
    fixed: bool = False


def rows(model: Model, xs: Iterable[float], zs: Iterable[float], yaw_deg: float = 0.0) -> list[Piece]:
    """Pieces at every crossing of the columns `xs` with the rows `zs`, all with one heading."""
    columns = tuple(xs)
    return [Piece(model, x, z, yaw_deg) for z in zs for x in columns]


def facing_rows(model: Model, xs: Iterable[float], apart: float) -> list[Piece]:
    """Two rows of pieces along x that face each other across `apart` metres."""
    columns = tuple(xs)
    return [*rows(model, columns, [-apart / 2], 0.0), *rows(model, columns, [apart / 2], 180.0)]


def ring(model: Model, radii: Iterable[float], first_deg: float = 0.0) -> list[Piece]:
    """Pieces that face the centre, one per radius, at equal angles clockwise from bearing `first_deg`."""
    distances = tuple(radii)
    bearings = first_deg + 360.0 / len(distances) * np.arange(len(distances))
    return [
        Piece(model, r * float(np.sin(b)), r * float(np.cos(b)), float(np.rad2deg(b)) + 180.0)
        for r, b in zip(distances, np.deg2rad(bearings), strict=True)
    ]


def placed(group: Iterable[Piece], x: float, z: float, turn_deg: float = 0.0) -> list[Piece]:
    """The group turned clockwise by `turn_deg` about its centre, with the centre at (x, z)."""
    sin, cos = float(np.sin(np.deg2rad(turn_deg))), float(np.cos(np.deg2rad(turn_deg)))
    return [
        replace(
            piece,
            x=x + cos * piece.x + sin * piece.z,
            z=z - sin * piece.x + cos * piece.z,
            yaw_deg=piece.yaw_deg + turn_deg,
        )
        for piece in group
    ]


def as_left(
    pieces: Iterable[Piece], rng: np.random.Generator, shift_m: float, turn_deg: float
) -> list[Piece]:
    """The pieces as people leave them: shifted and turned a little.

    Args:
        pieces: as they are meant to stand.
        rng: where the randomness comes from.
        shift_m: standard deviation in x and in z, metres.
        turn_deg: standard deviation of the heading, degrees.

    Shifts and turns stop at two standard deviations, so that neighbours keep clear of each other.
    """
    left = []
    for piece in pieces:
        dx, dz, turn = np.clip(rng.standard_normal(3), -2.0, 2.0) * (shift_m, shift_m, turn_deg)
        left.append(replace(piece, x=piece.x + dx, z=piece.z + dz, yaw_deg=piece.yaw_deg + turn))
    return left


def wander(stops: Sequence[Point]) -> CameraPath:
    """A smooth closed path through the stops, in their order.

    At each stop it runs parallel to the line between the stops before and after; its control points stand
    a third of the distance to the next stop along that direction.
    """
    stop = np.asarray(stops, dtype=np.float64)
    after, before = np.roll(stop, -1, axis=0), np.roll(stop, 1, axis=0)
    direction = (after - before) / np.linalg.norm(after - before, axis=1, keepdims=True)
    reach = np.linalg.norm(after - stop, axis=1, keepdims=True) / 3
    leaving, arriving = stop + reach * direction, after - reach * np.roll(direction, -1, axis=0)
    points = np.stack([stop, leaving, arriving], axis=1).reshape(-1, 2)
    return CameraPath(np.concatenate([points, stop[:1]]), closed=True)


def furnish(
    name: str,
    size: tuple[float, float],
    pieces: Sequence[Piece],
    sites: Iterable[Point],
    stops: Sequence[Point] = (),
    fov: FieldOfView = PAPER_FIELD_OF_VIEW,
    weights: Weights | None = None,
) -> Scene:
    """A scene of the pieces, with the first of each category as its template.

    Args:
        name: of the scene.
        size: width and depth of the room, metres.
        pieces: what stands in it; those without a label are numbered from 1 in their order.
        sites: centres of the Voronoi cells, named S1, S2, ... in their order.
        stops: that the camera's closed path passes; none for no path.
        fov: what the camera sees.
        weights: of the costs; None for the paper's formula.
    """
    layout = Layout(
        labels=tuple(piece.label or str(i) for i, piece in enumerate(pieces, start=1)),
        category=tuple(piece.model.category for piece in pieces),
        # To the millimetre and the tenth of a degree, as one would write them down.
        position=np.round([(piece.x, piece.z) for piece in pieces], 3),
        yaw=np.deg2rad(np.round([piece.yaw_deg % 360.0 for piece in pieces], 1)),
        size=np.array([piece.model.size for piece in pieces]),
        fixed=np.array([piece.fixed for piece in pieces]),
    )
    first = {category: layout.category.index(category) for category in layout.categories}
    return Scene(
        name=name,
        size=size,
        layout=layout,
        sites=tuple(Site(f"S{i}", x, z) for i, (x, z) in enumerate(sites, start=1)),
        camera_path=wander(stops) if stops else None,
        fov=fov,
        weights=weights,
        templates=tuple(
            Template(category, float(layout.yaw[i]), pieces[i].model.size) for category, i in first.items()
        ),
    )
