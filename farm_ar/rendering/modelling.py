"""The models of the farm, built from shapes; `python -m farm_ar.rendering.modelling` writes them as glTF.

Each fills its box: to the right, up and ahead of the middle of its foot, metres. Coops are all alike, and so
are hutches: what distinguishes them is virtual.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.rendering.mesh import Mesh, merged
from farm_ar.rendering.modelling_scenery import SCENERY
from farm_ar.rendering.shapes import (
    Colour,
    Polygon,
    box,
    ellipsoid,
    hull,
    mesh_of,
    moved,
    pane,
    prism,
    sideways,
    tube,
)

WOOD: Colour = (211, 176, 129)
SEAM: Colour = (168, 137, 98)
COOP_ROOF: Colour = (136, 84, 62)
TRIM: Colour = (244, 236, 216)
DARK: Colour = (58, 40, 28)
SLATE: Colour = (194, 202, 205)
SLATE_SEAM: Colour = (155, 162, 164)
FELT: Colour = (100, 112, 116)
WIRE: Colour = (98, 108, 84)
BARN: Colour = (156, 104, 76)
BARN_SEAM: Colour = (122, 80, 58)
BARN_ROOF: Colour = (98, 70, 56)
GLASS: Colour = (188, 214, 224)
COAT: Colour = (235, 230, 220)
SKIN: Colour = (232, 184, 148)
SLEEVE: Colour = (72, 96, 150)

_LIFT = 0.0006
"""How far a pane lies before the wall behind it, metres."""


def coop() -> Mesh:
    """10 x 8 x 9 cm: plank walls under a gable roof; a ramp before the door, stairs at the left side."""
    w, d, back = 0.036, 0.026, -0.045
    eave, ridge = 0.048, 0.076
    gable = [(-w, 0.006), (w, 0.006), (w, eave), (0.0, ridge), (-w, eave)]
    body = prism(gable, back + 0.004, d, WOOD)
    body += box((-w, 0.0, back + 0.006), (w, 0.006, d - 0.002), SEAM)
    body += _seams_ahead(w, 0.006, eave, d, SEAM, 6) + _seams_ahead(w, 0.006, eave, back + 0.004, SEAM, 6)
    for side in (-1.0, 1.0):
        body += _seams_beside(side * w, 0.006, eave, back + 0.004, d, SEAM, 6)
    body += _window((0.0, 0.034, back + 0.004), 0.010, 0.009, -1.0)
    body += [*_beside_window(w, 0.030, -0.012, 0.012, 0.008)]
    roof = []
    for side in (-1.0, 1.0):
        slope = [(0.0, ridge + 0.004), (0.0, ridge - 0.001), (side * 0.05, 0.037), (side * 0.05, 0.042)]
        roof += prism(slope, back, d + 0.004, COOP_ROOF)
    roof += box((-0.004, ridge - 0.001, back), (0.004, 0.08, d + 0.004), (112, 68, 52))
    door = pane(_upright(-0.012, 0.008, 0.012, 0.040, d + _LIFT), (0, 0, 1), TRIM)
    door += pane(_upright(-0.010, 0.008, 0.010, 0.038, d + 2 * _LIFT), (0, 0, 1), DARK)
    ramp = hull(
        [
            *_slab(
                [(-0.009, 0.010, d), (0.009, 0.010, d), (0.009, 0.002, 0.045), (-0.009, 0.002, 0.045)], 0.002
            ),
        ],
        (190, 150, 100),
    )
    for share in (0.25, 0.5, 0.75):
        z, y = d + share * (0.045 - d), 0.010 - 0.008 * share
        ramp += box((-0.008, y, z - 0.001), (0.008, y + 0.0018, z + 0.001), (120, 88, 58))
    stairs: list[Polygon] = []
    for k, height in enumerate((0.015, 0.010, 0.005)):
        stairs += box((-0.0405 - 0.0045 * k, 0.0, 0.0), (-0.036 - 0.0045 * k, height, 0.016), (176, 140, 96))
    hatch = pane(
        [(-w - _LIFT, y, z) for y, z in ((0.015, 0.002), (0.015, 0.014), (0.034, 0.014), (0.034, 0.002))],
        (-1, 0, 0),
        DARK,
    )
    return merged(
        {
            name: mesh_of(part)
            for name, part in {
                "body": body + hatch,
                "roof": roof,
                "door": door,
                "ramp": ramp,
                "stairs": stairs,
            }.items()
        }
    )


def hutch() -> Mesh:
    """9 x 7 x 7 cm: light walls on legs, wire at the front, a felt roof that falls to the back."""
    w, front, back = 0.041, 0.030, -0.031
    profile = [(back, 0.010), (front, 0.010), (front, 0.064), (back, 0.048)]
    body = moved(sideways(prism([(-z, y) for z, y in profile], -w, w, SLATE)), (0, 0, 0))
    for x in (-w + 0.003, w - 0.003):
        for z in (back + 0.003, front - 0.003):
            body += box((x - 0.003, 0.0, z - 0.003), (x + 0.003, 0.010, z + 0.003), SLATE_SEAM)
    body += _seams_ahead(w, 0.010, 0.048, back, SLATE_SEAM, 5)
    for side in (-1.0, 1.0):
        body += _seams_beside(side * w, 0.010, 0.048, back, front, SLATE_SEAM, 4)
    wire = pane(_upright(-0.037, 0.016, 0.004, 0.058, front + _LIFT), (0, 0, 1), WIRE)
    for x in np.arange(-0.033, 0.004, 0.007):
        wire += pane(_upright(x, 0.016, x + 0.0015, 0.058, front + 2 * _LIFT), (0, 0, 1), TRIM)
    for y in (0.028, 0.042):
        wire += pane(_upright(-0.037, y, 0.004, y + 0.0015, front + 2 * _LIFT), (0, 0, 1), TRIM)
    door = box((0.008, 0.014, front), (0.038, 0.058, front + 0.002), TRIM)
    door += pane(_upright(0.012, 0.018, 0.034, 0.054, front + 0.002 + _LIFT), (0, 0, 1), DARK)
    door += box((0.009, 0.034, front + 0.002), (0.012, 0.038, front + 0.005), (150, 120, 60))
    roof = hull(
        _slab(
            [(-0.045, 0.070, 0.035), (0.045, 0.070, 0.035), (0.045, 0.050, -0.035), (-0.045, 0.050, -0.035)],
            0.004,
        ),
        FELT,
    )
    for share in (0.25, 0.5, 0.75):
        y, z = 0.070 - 0.020 * share + _LIFT, 0.035 - 0.070 * share
        strip = [
            (-0.045, y, z + 0.001),
            (0.045, y, z + 0.001),
            (0.045, y - 0.0006, z - 0.001),
            (-0.045, y - 0.0006, z - 0.001),
        ]
        roof += pane(strip, (0, 1, 0), (78, 88, 92))
    return merged(
        {
            name: mesh_of(part)
            for name, part in {"body": body, "wire": wire, "door": door, "roof": roof}.items()
        }
    )


def shed() -> Mesh:
    """20 x 14 x 16 cm: a barn with its ridge from side to side; both leaves of its gate open."""
    w, front, back = 0.094, 0.074, -0.074
    eave, ridge = 0.080, 0.134
    profile = [(front, 0.0), (front, eave), (0.0, ridge), (back, eave), (back, 0.0)]
    body = sideways(prism([(-z, y) for z, y in profile], -w, w, BARN))
    body += _seams_ahead(w, 0.0, eave, front, BARN_SEAM, 12) + _seams_ahead(w, 0.0, eave, back, BARN_SEAM, 12)
    for side in (-1.0, 1.0):
        body += _seams_beside(side * w, 0.0, eave, back, front, BARN_SEAM, 9)
        body += _side_window(side * w, 0.096, 0.0)
    for x in (-0.070, 0.070):
        body += _window((x, 0.046, front), 0.014, 0.013, 1.0)
    body += pane(_upright(-0.040, 0.0, 0.040, 0.070, front + _LIFT), (0, 0, 1), TRIM)
    body += pane(_upright(-0.036, 0.0, 0.036, 0.066, front + 2 * _LIFT), (0, 0, 1), DARK)
    gates: dict[str, list[Polygon]] = {}
    for side, name in ((-1.0, "gate-left"), (1.0, "gate-right")):
        z = front + 3 * _LIFT
        low, high = sorted((side * 0.0005, side * 0.0355))
        gate = box((low, 0.001, z), (high, 0.065, z + 0.002), BARN)
        for y in (0.001, 0.031, 0.061):
            gate += pane(_upright(low, y, high, y + 0.004, z + 0.002 + _LIFT), (0, 0, 1), TRIM)
        gates[name] = gate
    roof = []
    for side in (-1.0, 1.0):
        slope = [(0.0, ridge + 0.006), (0.0, ridge - 0.001), (side * 0.08, 0.070), (side * 0.08, 0.077)]
        roof += sideways(prism(slope, -0.1, 0.1, BARN_ROOF))
    return merged({name: mesh_of(part) for name, part in {"body": body, "roof": roof, **gates}.items()})


def chicken() -> Mesh:
    """2.2 cm high: the part "coat" has the label's colour."""
    coat = ellipsoid((0, 0.0105, 0), (0.0062, 0.0065, 0.009), COAT)
    coat += ellipsoid((0, 0.0175, 0.0075), (0.0036, 0.0042, 0.0036), COAT, 8, 5)
    coat += hull(
        _slab(
            [
                (-0.003, 0.012, -0.008),
                (0.003, 0.012, -0.008),
                (0.003, 0.019, -0.013),
                (-0.003, 0.019, -0.013),
            ],
            0.002,
        ),
        COAT,
    )
    rest = tube((0, 0.0172, 0.0105), (0, 0.0168, 0.0138), 0.0014, 0.0002, (240, 170, 40), 6)
    rest += box((-0.0006, 0.0205, 0.005), (0.0006, 0.0235, 0.0098), (210, 40, 40))
    for x in (-0.0025, 0.0025):
        rest += tube((x, 0.0, 0.001), (x, 0.006, 0.0), 0.0007, 0.0007, (240, 170, 40), 5)
        rest += ellipsoid((x * 1.28, 0.0182, 0.0088), (0.0006, 0.0006, 0.0006), (20, 20, 20), 5, 3)
    return merged({"coat": mesh_of(coat), "rest": mesh_of(rest)})


def bunny() -> Mesh:
    """2.6 cm high: the part "coat" has the label's colour."""
    coat = ellipsoid((0, 0.0075, -0.002), (0.0062, 0.0072, 0.0095), COAT)
    coat += ellipsoid((0, 0.0135, 0.0075), (0.0042, 0.0044, 0.0046), COAT, 8, 5)
    for x in (-0.0022, 0.0022):
        coat += hull(
            _slab(
                [
                    (x - 0.0013, 0.0165, 0.0058),
                    (x + 0.0013, 0.0165, 0.0058),
                    (x * 1.6 + 0.0008, 0.026, 0.0035),
                    (x * 1.6 - 0.0008, 0.026, 0.0035),
                ],
                0.0012,
            ),
            COAT,
        )
    rest = ellipsoid((0, 0.009, -0.0118), (0.0026, 0.0026, 0.0022), (250, 250, 250), 7, 4)
    rest += ellipsoid((0, 0.0132, 0.0119), (0.0009, 0.0007, 0.0007), (220, 120, 130), 5, 3)
    for x in (-0.0036, 0.0036):
        rest += ellipsoid((x, 0.0148, 0.0092), (0.0006, 0.0007, 0.0007), (20, 20, 20), 5, 3)
    return merged({"coat": mesh_of(coat), "rest": mesh_of(rest)})


def hand(closed: bool) -> Mesh:
    """A right hand over its palm's middle, fingers ahead, and the forearm that leads to it from behind."""
    skin = ellipsoid((0, 0.010, 0.004), (0.030, 0.011, 0.034), SKIN, 12, 6)
    for x, reach in ((-0.024, 0.042), (-0.008, 0.050), (0.008, 0.048), (0.023, 0.038)):
        knuckle = (x * 0.9, 0.012, 0.030)
        if closed:
            bend, tip = (x, 0.004, 0.030 + 0.4 * reach), (x, -0.022, 0.030 + 0.25 * reach)
        else:
            bend, tip = (x * 1.15, 0.012, 0.030 + 0.55 * reach), (x * 1.3, 0.006, 0.030 + reach)
        skin += tube(knuckle, bend, 0.0082, 0.0074, SKIN, 8) + tube(bend, tip, 0.0074, 0.0058, SKIN, 8)
        skin += ellipsoid(tip, (0.0058, 0.0058, 0.0058), SKIN, 8, 4)
    thumb = [
        (-0.024, 0.008, 0.0),
        (-0.042, 0.004, 0.020),
        (-0.036, -0.012, 0.038) if closed else (-0.054, 0.002, 0.038),
    ]
    skin += tube(thumb[0], thumb[1], 0.0105, 0.0088, SKIN, 8) + tube(
        thumb[1], thumb[2], 0.0088, 0.0064, SKIN, 8
    )
    skin += ellipsoid(thumb[2], (0.0064, 0.0064, 0.0064), SKIN, 8, 4)
    forearm = tube((0, 0.012, -0.018), (0, 0.030, -0.075), 0.022, 0.025, SKIN, 12)
    forearm += tube((0, 0.030, -0.075), (0.02, 0.075, -0.22), 0.025, 0.034, SKIN, 12)
    sleeve = tube((0.018, 0.070, -0.20), (0.045, 0.13, -0.40), 0.040, 0.052, SLEEVE, 12)
    return merged({"hand": mesh_of(skin), "forearm": mesh_of(forearm), "sleeve": mesh_of(sleeve)})


BUILDERS: dict[str, Callable[[], Mesh]] = {
    "coop": coop,
    "hutch": hutch,
    "shed": shed,
    "chicken": chicken,
    "bunny": bunny,
    "hand-open": partial(hand, False),
    "hand-closed": partial(hand, True),
    **SCENERY,
}
"""Builds each model by name."""


def write(mesh: Mesh, path: Path) -> None:
    """A mesh without texture as binary glTF, a node for each part."""
    import trimesh

    scene = trimesh.Scene()
    for k, name in enumerate(mesh.parts):
        of_part = mesh.part == k
        # Right is -x of glTF's right-handed frame.
        corners = mesh.corners[of_part] * [-1.0, 1.0, 1.0]
        colours = np.repeat(np.rint(mesh.colour[of_part]).astype(np.uint8), 3, axis=0)
        opaque = np.column_stack([colours, np.full(len(colours), 255, np.uint8)])
        part: Any = trimesh.Trimesh(
            corners.reshape(-1, 3),
            np.arange(3 * len(corners)).reshape(-1, 3),
            vertex_colors=opaque,
            process=False,
        )
        scene.add_geometry(part, node_name=name, geom_name=name)
    path.write_bytes(scene.export(file_type="glb"))  # type: ignore[no-untyped-call]


def _slab(top: list[tuple[float, float, float]], thick: float) -> list[np.ndarray[Any, Any]]:
    """The faces of a flat piece below four corners."""
    upper = np.array(top)
    lower = upper - [0.0, thick, 0.0]
    sides = [np.array([upper[k], upper[(k + 1) % 4], lower[(k + 1) % 4], lower[k]]) for k in range(4)]
    return [upper, lower, *sides]


def _upright(x0: float, y0: float, x1: float, y1: float, z: float) -> list[tuple[float, float, float]]:
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def _seams_ahead(w: float, low: float, high: float, z: float, colour: Colour, count: int) -> list[Polygon]:
    """Upright seams on a wall that looks ahead or back."""
    out = 1.0 if z > 0 else -1.0
    found: list[Polygon] = []
    for k in range(1, count):
        x = -w + 2 * w * k / count
        found += pane(_upright(x - 0.0005, low, x + 0.0005, high, z + out * _LIFT / 2), (0, 0, out), colour)
    return found


def _seams_beside(
    x: float, low: float, high: float, back: float, front: float, colour: Colour, count: int
) -> list[Polygon]:
    """The same on a wall that looks sideways."""
    out = 1.0 if x > 0 else -1.0
    found: list[Polygon] = []
    for k in range(1, count):
        z, at = back + (front - back) * k / count, x + out * _LIFT / 2
        found += pane(
            [(at, low, z - 0.0005), (at, low, z + 0.0005), (at, high, z + 0.0005), (at, high, z - 0.0005)],
            (out, 0, 0),
            colour,
        )
    return found


def _window(middle: tuple[float, float, float], half: float, tall: float, out: float) -> list[Polygon]:
    """A window in a wall that looks ahead (`out` 1) or back (-1)."""
    x, y, z = middle
    found: list[Polygon] = []
    for lift, edge, colour in ((1, 0.0, TRIM), (2, 0.002, GLASS)):
        corners = _upright(
            x - half + edge, y - tall + edge, x + half - edge, y + tall - edge, z + out * lift * _LIFT
        )
        found += pane(corners, (0, 0, out), colour)
    return found + pane(
        _upright(x - 0.0007, y - tall, x + 0.0007, y + tall, z + out * 3 * _LIFT), (0, 0, out), TRIM
    )


def _side_window(x: float, y: float, z: float) -> list[Polygon]:
    """A window in a wall that looks sideways."""
    out = 1.0 if x > 0 else -1.0
    found: list[Polygon] = []
    for lift, half, colour in ((1, 0.013, TRIM), (2, 0.010, GLASS)):
        at = x + out * lift * _LIFT
        corners = [
            (at, y - half, z - half),
            (at, y - half, z + half),
            (at, y + half, z + half),
            (at, y + half, z - half),
        ]
        found += pane(corners, (out, 0, 0), colour)
    return found


def _beside_window(x: float, y: float, z: float, half: float, tall: float) -> list[Polygon]:
    found: list[Polygon] = []
    for lift, edge, colour in ((1, 0.0, TRIM), (2, 0.002, DARK)):
        at = x + lift * _LIFT
        a, b, low, high = z - half + edge, z + half - edge, y - tall + edge, y + tall - edge
        found += pane([(at, low, a), (at, low, b), (at, high, b), (at, high, a)], (1, 0, 0), colour)
    return found


if __name__ == "__main__":
    folder = Path(__file__).parent / "models"
    for name, build in BUILDERS.items():
        write(build(), folder / f"{name}.glb")
