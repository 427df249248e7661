"""The models of what stands and grazes around a farm's buildings, built from shapes as in `modelling`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from farm_ar.rendering.mesh import Mesh, merged
from farm_ar.rendering.shapes import (
    Colour,
    Polygon,
    box,
    ellipsoid,
    mesh_of,
    prism,
    sideways,
    tube,
)

HAIR: Colour = (236, 228, 212)
HORN: Colour = (112, 94, 70)
SADDLE: Colour = (176, 128, 90)
TAN: Colour = (186, 128, 72)
PATCH: Colour = (62, 50, 44)
STEEL: Colour = (186, 194, 200)
WATER: Colour = (96, 176, 222)
LOG: Colour = (170, 120, 74)
BARK: Colour = (118, 82, 52)
HAY: Colour = (222, 188, 92)
GREEN: Colour = (52, 124, 60)
TYRE: Colour = (44, 44, 48)
CABIN: Colour = (238, 214, 74)
_INK: Colour = (30, 28, 26)


def goat() -> Mesh:
    """4 cm high: with the part "head-up" it looks, with "head-down" it grazes."""
    body = ellipsoid((0, 0.024, 0), (0.0105, 0.0115, 0.0200), HAIR)
    body += ellipsoid((0, 0.027, -0.008), (0.0108, 0.0095, 0.0105), SADDLE, 8, 5)
    body += _legs(0.0065, 0.013, 0.018, 0.0024, (168, 160, 146))
    body += tube((0, 0.027, -0.018), (0, 0.035, -0.024), 0.0032, 0.0014, HAIR, 6)
    heads = {}
    for name, (high, far) in {"head-up": (0.038, 0.026), "head-down": (0.010, 0.030)}.items():
        head = tube((0, 0.027, 0.014), (0, high, far - 0.002), 0.0065, 0.0050, HAIR, 8)
        head += ellipsoid((0, high, far + 0.001), (0.0052, 0.0054, 0.0085), HAIR, 8, 5)
        head += ellipsoid((0, high - 0.002, far + 0.0085), (0.0026, 0.0024, 0.0026), (120, 90, 84), 6, 4)
        for x in (-0.0032, 0.0032):
            horn = (x, high + 0.004, far - 0.002), (2 * x, high + 0.011, far - 0.009)
            head += tube(*horn, 0.0017, 0.0006, HORN, 6)
            head += ellipsoid((1.5 * x, high + 0.002, far + 0.004), (0.0010, 0.0011, 0.0011), _INK, 5, 3)
        heads[name] = head
    return _made({"body": body, **heads})


def cow() -> Mesh:
    """6 cm high: with the part "head-up" it looks, with "head-down" it drinks."""
    white: Colour = (246, 242, 234)
    body = ellipsoid((0, 0.041, 0), (0.0175, 0.0185, 0.0335), white, 12, 8)
    body += ellipsoid((-0.0100, 0.047, -0.014), (0.0100, 0.0120, 0.0120), PATCH, 8, 5)
    body += ellipsoid((0.0105, 0.044, 0.008), (0.0098, 0.0120, 0.0100), PATCH, 8, 5)
    body += _legs(0.0105, 0.021, 0.030, 0.0036, (206, 200, 190))
    body += tube((0, 0.047, -0.032), (0, 0.022, -0.039), 0.0016, 0.0012, white, 6)
    body += ellipsoid((0, 0.020, -0.039), (0.0022, 0.0036, 0.0022), PATCH, 6, 4)
    heads = {}
    for name, (high, far) in {"head-up": (0.058, 0.044), "head-down": (0.016, 0.050)}.items():
        head = tube((0, 0.046, 0.024), (0, high, far - 0.004), 0.0112, 0.0085, white, 10)
        head += ellipsoid((0, high, far), (0.0082, 0.0085, 0.0125), white, 10, 6)
        head += ellipsoid((0, high - 0.0035, far + 0.0105), (0.0060, 0.0055, 0.0050), (232, 176, 168), 8, 5)
        for x in (-0.0062, 0.0062):
            horn = (x, high + 0.006, far - 0.005), (1.7 * x, high + 0.014, far - 0.006)
            head += tube(*horn, 0.0020, 0.0006, HORN, 6)
            head += ellipsoid((1.7 * x, high + 0.003, far - 0.006), (0.0042, 0.0022, 0.0022), PATCH, 6, 4)
            head += ellipsoid((1.08 * x, high + 0.003, far + 0.005), (0.0013, 0.0015, 0.0015), _INK, 5, 3)
        heads[name] = head
    return _made({"body": body, **heads})


def dog() -> Mesh:
    """3 cm high, in a trot."""
    body = ellipsoid((0, 0.0165, 0), (0.0075, 0.0080, 0.0160), TAN)
    body += ellipsoid((0, 0.0255, 0.0155), (0.0066, 0.0070, 0.0072), TAN, 8, 5)
    body += ellipsoid((0, 0.0232, 0.0225), (0.0034, 0.0034, 0.0052), (206, 162, 116), 8, 4)
    body += ellipsoid((0, 0.0245, 0.0275), (0.0017, 0.0015, 0.0013), _INK, 6, 4)
    body += tube((0, 0.0195, -0.0145), (0, 0.0305, -0.0225), 0.0022, 0.0010, TAN, 6)
    for x, swing in ((-0.0042, 1.0), (0.0042, -1.0)):
        for z, kick in ((-0.0105, 0.0050), (0.0100, -0.0050)):
            body += tube((x, 0.012, z), (x, 0.0, z + swing * kick), 0.0021, 0.0016, (150, 102, 58), 6)
        body += ellipsoid((1.6 * x, 0.0255, 0.0130), (0.0019, 0.0062, 0.0034), (112, 76, 44), 6, 4)
        body += ellipsoid((0.8 * x, 0.0275, 0.0208), (0.0010, 0.0011, 0.0011), _INK, 5, 3)
    return _made({"body": body})


def silo() -> Mesh:
    """17 cm high, of steel."""
    tower = tube((0, 0, 0), (0, 0.132, 0), 0.037, 0.037, STEEL, 20)
    for y in np.arange(0.020, 0.132, 0.020):
        tower += tube((0, y, 0), (0, y + 0.0022, 0), 0.0376, 0.0376, (146, 154, 160), 20)
    tower += tube((0, 0.132, 0), (0, 0.150, 0), 0.0385, 0.026, (160, 168, 174), 20)
    tower += tube((0, 0.150, 0), (0, 0.166, 0), 0.026, 0.004, (148, 156, 162), 20)
    tower += box((-0.007, 0.0, 0.030), (0.007, 0.022, 0.0385), (90, 96, 102))
    return _made({"body": tower})


def tractor() -> Mesh:
    """7 cm high, parked."""
    body = box((-0.013, 0.018, -0.030), (0.013, 0.036, 0.046), GREEN)
    body += box((-0.0095, 0.036, 0.004), (0.0095, 0.046, 0.046), (80, 150, 88))
    body += box((-0.016, 0.036, -0.030), (0.016, 0.066, 0.002), (196, 228, 240))
    body += box((-0.018, 0.066, -0.033), (0.018, 0.072, 0.005), CABIN)
    for x in (-0.016, 0.014):
        for z in (-0.030, 0.000):
            body += box((x, 0.036, z), (x + 0.002, 0.066, z + 0.002), CABIN)
    body += tube((0.005, 0.046, 0.030), (0.005, 0.064, 0.030), 0.0022, 0.0022, _INK, 8)
    for z, radius, width in ((-0.020, 0.024, 0.012), (0.034, 0.015, 0.009)):
        for side in (-1.0, 1.0):
            inner, outer = side * 0.014, side * (0.014 + width)
            body += tube((inner, radius, z), (outer, radius, z), radius, radius, TYRE, 16)
            rim = outer + side * 0.0008
            body += tube((outer, radius, z), (rim, radius, z), 0.5 * radius, 0.5 * radius, CABIN, 12)
    return _made({"body": body})


def _trough(width: float, depth: float, inside: Colour) -> list[Polygon]:
    """A trough that widens upwards, full to 2 mm below its rim."""
    w, d, high = width / 2, depth / 2, 0.021
    wall = [(-0.8 * d, 0.0), (0.8 * d, 0.0), (d, high), (-d, high)]
    made = sideways(prism(wall, -w, w, LOG))
    made += box((-w + 0.004, high, -d + 0.003), (w - 0.004, high + 0.0012, d - 0.003), inside)
    for end in (-w, w - 0.004):
        made += box((end, high, -d), (end + 0.004, high + 0.003, d), BARK)
    for side in (-d, d - 0.003):
        made += box((-w, high, side), (w, high + 0.003, side + 0.003), BARK)
    return made


def water_trough() -> Mesh:
    """8 cm long, full of water."""
    return _made({"body": _trough(0.080, 0.028, WATER)})


def hay_trough() -> Mesh:
    """7 cm long, with hay in it."""
    rng = np.random.default_rng(7)
    body = _trough(0.072, 0.026, HAY)
    for x in np.arange(-0.026, 0.028, 0.0075):
        heap = (0.0075, float(rng.uniform(0.004, 0.008)), 0.0090)
        body += ellipsoid((x, 0.022, float(rng.uniform(-0.002, 0.002))), heap, HAY, 7, 5)
    return _made({"body": body})


def wood_stack() -> Mesh:
    """Logs, piled up."""
    body: list[Polygon] = []
    for row in range(3):
        for k in range(4 - row):
            z, y = -0.0195 + 0.013 * k + 0.0065 * row, 0.0066 + 0.0112 * row
            body += tube((-0.034, y, z), (0.034, y, z), 0.0065, 0.0065, BARK, 9)
            for end in (-0.0343, 0.034):
                body += tube((end, y, z), (end + 0.0003, y, z), 0.0055, 0.0055, (212, 176, 130), 9)
    return _made({"body": body})


def _legs(x: float, z: float, high: float, radius: float, colour: Colour) -> list[Polygon]:
    made: list[Polygon] = []
    for side in (-x, x):
        for end in (-z, z):
            made += tube((side, high + 0.004, end), (side, 0.0, end), radius, 0.8 * radius, colour, 6)
    return made


def _made(parts: dict[str, list[Polygon]]) -> Mesh:
    return merged({name: mesh_of(part) for name, part in parts.items()})


SCENERY: dict[str, Callable[[], Mesh]] = {
    "goat": goat,
    "cow": cow,
    "dog": dog,
    "silo": silo,
    "tractor": tractor,
    "water-trough": water_trough,
    "hay-trough": hay_trough,
    "wood-stack": wood_stack,
}
"""Builds each model by name."""
