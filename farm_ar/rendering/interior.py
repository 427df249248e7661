"""The inside of a room: chairs, tables, floor and walls, people who sit or stand, and a robot.

Ahead of a chair is where one who sits on it looks.
"""

from __future__ import annotations

from functools import cache

from farm_ar.rendering.mesh import Mesh
from farm_ar.rendering.shapes import Colour, Polygon, box, ellipsoid, mesh_of, pane, tube

SEAT_M = 0.46
"""Height of a chair's seat."""

CHAIR_SIZE = (0.45, 0.84, 0.50)
"""Width, height and depth of the chair that `chair` makes, metres."""

FABRIC: Colour = (70, 84, 104)
METAL: Colour = (52, 54, 58)
TOP: Colour = (206, 186, 154)
CARPET: Colour = (158, 156, 150)
PLASTER: Colour = (226, 224, 216)
SKIRTING: Colour = (188, 184, 176)
SKIN: Colour = (226, 182, 150)
TROUSERS: Colour = (58, 62, 84)
HAIR: Colour = (74, 52, 38)
SHOES: Colour = (44, 38, 36)
SHELL: Colour = (40, 42, 46)
LIGHT_SHELL: Colour = (230, 232, 234)


@cache
def chair() -> Mesh:
    """An office chair on four legs, of `CHAIR_SIZE`, its back behind."""
    w, h, d = (side / 2 for side in CHAIR_SIZE)
    parts = box((-w, SEAT_M - 0.06, -d + 0.02), (w, SEAT_M, d), FABRIC)
    parts += box((-w + 0.02, SEAT_M + 0.06, -d), (w - 0.02, 2 * h, -d + 0.05), FABRIC)
    for x in (-w + 0.03, w - 0.03):
        parts += tube((x, SEAT_M - 0.02, -d + 0.025), (x, 2 * h - 0.1, -d + 0.025), 0.014, 0.014, METAL, 6)
        for z in (-d + 0.05, d - 0.04):
            parts += tube((x, 0.0, z), (x, SEAT_M - 0.05, z), 0.015, 0.015, METAL, 6)
    return mesh_of(parts)


@cache
def table(width: float, height: float, depth: float) -> Mesh:
    """A table: its top on four legs."""
    w, d = width / 2, depth / 2
    parts = box((-w, height - 0.03, -d), (w, height, d), TOP)
    for x in (-w + 0.04, w - 0.04):
        for z in (-d + 0.04, d - 0.04):
            parts += tube((x, 0.0, z), (x, height - 0.03, z), 0.02, 0.02, METAL, 6)
    return mesh_of(parts)


@cache
def person(shirt: Colour, sitting: bool = True) -> Mesh:
    """A person who sits on the middle of a chair, or stands at the origin, looking ahead."""
    hip = SEAT_M + 0.09 if sitting else 0.92
    parts: list[Polygon] = []
    for side in (-1.0, 1.0):
        x = 0.09 * side
        if sitting:
            parts += tube((x, hip, -0.06), (x, hip - 0.01, 0.32), 0.075, 0.06, TROUSERS, 8)
            parts += tube((x, hip - 0.01, 0.32), (x, 0.09, 0.34), 0.06, 0.045, TROUSERS, 8)
            foot = 0.36
        else:
            parts += tube((x, hip, 0.0), (x, 0.09, 0.0), 0.08, 0.05, TROUSERS, 8)
            foot = 0.04
        parts += ellipsoid((x, 0.045, foot), (0.05, 0.045, 0.12), SHOES, 8, 4)
        back = -0.06 if sitting else 0.0
        elbow = (0.24 * side, hip + 0.22, back + 0.05)
        hand = (0.13 * side, hip + 0.12, 0.24) if sitting else (0.24 * side, hip - 0.06, 0.1)
        parts += tube((0.19 * side, hip + 0.46, back), elbow, 0.055, 0.045, shirt, 8)
        parts += tube(elbow, hand, 0.042, 0.035, shirt, 8)
        parts += ellipsoid(hand, (0.045, 0.04, 0.055), SKIN, 8, 4)
    back = -0.06 if sitting else 0.0
    parts += ellipsoid((0.0, hip + 0.25, back), (0.20, 0.31, 0.12), shirt, 12, 8)
    parts += tube((0.0, hip + 0.5, back), (0.0, hip + 0.6, back), 0.05, 0.05, SKIN, 8)
    parts += ellipsoid((0.0, hip + 0.69, back + 0.01), (0.09, 0.12, 0.10), SKIN, 12, 8)
    parts += ellipsoid((0.0, hip + 0.73, back - 0.02), (0.095, 0.11, 0.10), HAIR, 12, 8)
    return mesh_of(parts)


@cache
def robot(radius: float) -> Mesh:
    """A round base with a mast and a camera that looks ahead, like a LoCoBot."""
    parts = tube((0, 0.015, 0), (0, 0.10, 0), radius, radius, SHELL, 24)
    parts += tube((0, 0.10, 0), (0, 0.13, 0), radius * 0.9, radius * 0.85, LIGHT_SHELL, 24)
    parts += box((-0.03, 0.13, -0.08), (0.03, 0.52, -0.03), METAL)
    parts += box((-0.06, 0.52, -0.07), (0.06, 0.58, 0.02), LIGHT_SHELL)
    parts += box((-0.045, 0.54, 0.02), (0.045, 0.565, 0.035), SHELL)
    parts += box((-0.08, 0.13, 0.0), (0.08, 0.24, 0.12), (196, 144, 86))  # what it brings
    return mesh_of(parts)


@cache
def shell(width: float, depth: float, height: float = 3.2) -> Mesh:
    """Floor and walls of a room [0, width] x [0, depth], seen from inside."""
    w, d, h = width, depth, height
    parts = pane([(0, 0, 0), (w, 0, 0), (w, 0, d), (0, 0, d)], (0, 1, 0), CARPET)
    for low, high, colour in ((0.0, 0.1, SKIRTING), (0.1, h, PLASTER)):
        parts += pane([(0, low, d), (w, low, d), (w, high, d), (0, high, d)], (0, 0, -1), colour)
        parts += pane([(0, low, 0), (w, low, 0), (w, high, 0), (0, high, 0)], (0, 0, 1), colour)
        parts += pane([(0, low, 0), (0, low, d), (0, high, d), (0, high, 0)], (1, 0, 0), colour)
        parts += pane([(w, low, 0), (w, low, d), (w, high, d), (w, high, 0)], (-1, 0, 0), colour)
    return mesh_of(parts)
