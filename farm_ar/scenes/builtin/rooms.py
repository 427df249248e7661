"""The paper's real rooms (Table 4 and Fig. 20), rebuilt: pantry, cafeteria, classroom and lab.

Only the chairs are objects; the tables that they stand at are the sites.
"""

from __future__ import annotations

import numpy as np

from farm_ar.scenes.builtin.furniture import (
    Model,
    Piece,
    Point,
    as_left,
    facing_rows,
    furnish,
    placed,
    ring,
    rows,
)
from farm_ar.scenes.camera import FieldOfView
from farm_ar.scenes.scene import Scene

PANTRY_SEED, CAFETERIA_SEED, CLASSROOM_SEED, LAB_SEED = 41, 42, 43, 44
"""Seeds of the disorder in which people leave the chairs of each room."""

HEADSET_VIEW = FieldOfView.symmetric(np.deg2rad(64.7), 5.0)
"""The video camera of a HoloLens 2, 64.7 degrees wide; the paper gives no range, 5 m is our choice."""

CHAIR = Model("chair", (0.45, 0.84, 0.50))


def pantry() -> Scene:
    """Pantry with two tables, for six and for four."""
    rng = np.random.default_rng(PANTRY_SEED)
    six = facing_rows(CHAIR, (-0.62, 0.0, 0.62), apart=1.20)
    four = facing_rows(CHAIR, (-0.36, 0.36), apart=1.20)
    stops = [
        (0.45, 1.50), (0.60, 0.45), (2.10, 0.28), (2.85, 0.75), (3.15, 2.05), (4.30, 2.70), (5.30, 2.40),
        (5.50, 1.50), (5.30, 0.60), (4.30, 0.30), (3.20, 0.90), (2.95, 2.15), (2.30, 2.72), (0.60, 2.55),
    ]  # fmt: skip
    return _room("pantry", (6.0, 3.0), [(six, 1.65, 1.50, 0.0), (four, 4.30, 1.50, 0.0)], rng, stops)


def cafeteria() -> Scene:
    """Cafeteria with five small round tables, for three and in the middle for four."""
    rng = np.random.default_rng(CAFETERIA_SEED)
    three, four = ring(CHAIR, (0.66,) * 3), ring(CHAIR, (0.68,) * 4)
    tables = [
        (three, 1.50, 1.45, 20.0), (three, 5.45, 1.60, -35.0), (four, 3.50, 3.55, 40.0),
        (three, 1.60, 5.50, 75.0), (three, 5.40, 5.35, 10.0),
    ]  # fmt: skip
    stops = [
        (0.45, 3.30), (0.45, 1.20), (1.70, 0.30), (3.20, 1.30), (4.80, 2.90), (6.40, 3.00), (6.65, 1.30),
        (5.30, 0.40), (3.70, 1.60), (2.10, 3.20), (2.70, 5.00), (3.60, 6.45), (5.60, 6.70), (6.55, 5.20),
        (5.20, 3.90), (3.60, 5.00), (2.20, 6.60), (0.60, 6.20),
    ]  # fmt: skip
    return _room("cafeteria", (7.0, 7.0), tables, rng, stops)


def classroom() -> Scene:
    """Classroom with seven tables for group work, one of them for five."""
    rng = np.random.default_rng(CLASSROOM_SEED)
    four, five = ring(CHAIR, (0.92, 0.72, 0.92, 0.72)), ring(CHAIR, (0.90,) * 5)
    tables = [
        (four, 4.00, 2.10, 90.0), (four, 9.00, 2.20, 75.0), (four, 2.20, 5.25, 0.0), (five, 6.50, 5.10, 20.0),
        (four, 10.80, 4.90, 100.0), (four, 4.20, 8.00, 60.0), (four, 8.90, 7.90, 90.0),
    ]  # fmt: skip
    stops = [
        (0.60, 0.70), (0.70, 3.30), (3.60, 3.60), (6.20, 3.30), (6.60, 0.80), (9.20, 0.60), (12.20, 1.60),
        (12.40, 5.00), (10.90, 6.60), (8.20, 6.30), (6.60, 7.00), (6.60, 9.30), (9.30, 9.40), (11.60, 8.20),
        (9.00, 5.30), (7.80, 3.80), (4.80, 4.00), (4.20, 6.30), (2.40, 7.20), (1.70, 9.00), (0.70, 8.20),
        (0.60, 5.00), (2.10, 3.00), (2.20, 1.20),
    ]  # fmt: skip
    return _room("classroom", (13.0, 10.0), tables, rng, stops)


def lab() -> Scene:
    """Partly scanned lab with seven movable chairs."""
    rng = np.random.default_rng(LAB_SEED)
    side_by_side = rows(CHAIR, (-0.45, 0.45), (-0.60,))
    three = ring(CHAIR, (0.75, 0.80, 0.75), 60.0)
    benches = [(side_by_side, 1.60, 4.10, 0.0), (three, 3.00, 2.05, 0.0), (side_by_side, 5.30, 3.10, 90.0)]
    stops = [
        (0.60, 0.60), (0.70, 2.30), (2.60, 3.20), (3.90, 3.90), (3.95, 3.20), (4.35, 2.20), (4.60, 1.40),
        (3.20, 0.70),
    ]  # fmt: skip
    return _room("lab", (6.0, 5.0), benches, rng, stops)


def _room(
    name: str,
    size: tuple[float, float],
    tables: list[tuple[list[Piece], float, float, float]],
    rng: np.random.Generator,
    stops: list[Point],
) -> Scene:
    """A room of tables (chairs around it, x, z, turn in degrees), its chairs as people left them."""
    pieces: list[Piece] = []
    for seats, x, z, turn in tables:
        pieces += as_left(placed(seats, x, z, turn), rng, 0.05, 12.0)
    return furnish(name, size, pieces, [(x, z) for _, x, z, _ in tables], stops, HEADSET_VIEW)
