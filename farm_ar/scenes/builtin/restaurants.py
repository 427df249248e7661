"""The three synthetic restaurants of the paper (Table 1, Fig. 4), rebuilt: L1, M2 and H1."""

from __future__ import annotations

import numpy as np

from farm_ar.scenes.builtin.furniture import (
    Model,
    Piece,
    as_left,
    facing_rows,
    furnish,
    placed,
    ring,
    rows,
)
from farm_ar.scenes.scene import Scene

L1_SEED, M2_SEED, H1_SEED = 11, 22, 31
"""Seeds of the small disorder in which the guests leave each restaurant."""


def l1() -> Scene:
    """Small restaurant: two long tables with eight chairs each; only the chairs are objects."""
    rng = np.random.default_rng(L1_SEED)
    chair = Model("chair", (0.28, 0.54, 0.32))
    long_table = facing_rows(chair, xs=(-0.75, -0.25, 0.25, 0.75), apart=0.58)
    centres = [(1.55, 1.35), (3.30, 3.45)]
    pieces = [p for x, z in centres for p in as_left(placed(long_table, x, z), rng, 0.01, 1.0)]
    stops = [
        (0.45, 0.50), (2.30, 0.65), (3.30, 0.80), (3.90, 1.50), (3.70, 2.30), (1.85, 2.85), (1.50, 4.05),
        (2.70, 4.50), (4.20, 4.40), (4.60, 3.20), (3.60, 2.10), (2.05, 2.20), (1.10, 2.25), (0.35, 1.60),
    ]  # fmt: skip
    return furnish("L1", (5.0, 5.0), pieces, centres, stops)


def m2() -> Scene:
    """Middle-sized restaurant: six tables for four, three along either wall, and an aisle between them."""
    rng = np.random.default_rng(M2_SEED)
    chair, table = Model("chair", (0.33, 0.54, 0.38)), Model("table", (1.20, 0.35, 0.70))
    seats = facing_rows(chair, xs=(-0.28, 0.28), apart=0.64)
    centres = [(0.62, 0.65), (2.42, 0.62), (4.18, 0.68), (0.84, 4.36), (2.62, 4.38), (4.38, 4.34)]
    pieces: list[Piece] = []
    for x, z in centres:
        pieces += as_left(placed(seats, x, z, 90.0), rng, 0.025, 6.0)
        pieces += placed([Piece(table)], x, z, 90.0)
    stops = [
        (0.45, 1.85), (1.15, 1.75), (1.42, 1.20), (1.42, 0.50), (1.62, 0.50), (1.62, 1.20), (2.10, 1.60),
        (3.65, 1.50), (4.70, 1.75), (4.60, 2.90), (3.60, 3.45), (1.95, 3.50), (0.50, 3.30),
    ]  # fmt: skip
    return furnish("M2", (5.0, 5.0), pieces, centres, stops)


def h1() -> Scene:
    """Large restaurant: square tables for four, round ones for six, and a bench where guests wait."""
    rng = np.random.default_rng(H1_SEED)
    chair, blue_chair = Model("chair", (0.29, 0.54, 0.33)), Model("blue-chair", (0.29, 0.41, 0.28))
    table, small_table = Model("table", (0.59, 0.35, 0.62)), Model("small-table", (0.59, 0.35, 0.36))
    round_table = Model("round-table", (1.28, 0.35, 1.28))
    tucked_in, pulled_out = ring(chair, (0.33,) * 4), ring(chair, (0.33, 0.46, 0.33, 0.40))
    squares = [
        (1.20, 1.35, tucked_in), (3.35, 1.25, pulled_out), (5.60, 1.40, tucked_in),
        (1.25, 3.45, pulled_out), (5.70, 3.40, tucked_in), (3.30, 5.60, tucked_in), (5.75, 5.35, pulled_out),
    ]  # fmt: skip
    rounds = [(3.45, 3.50), (1.25, 5.70)]
    bench = (4.60, 6.68)
    pieces: list[Piece] = []
    for x, z, seats in squares:
        pieces += [*as_left(placed(seats, x, z), rng, 0.01, 2.0), Piece(table, x, z)]
    six = ring(blue_chair, (0.78,) * 6)
    for x, z in rounds:
        pieces += [*as_left(placed(six, x, z), rng, 0.02, 3.0), Piece(round_table, x, z)]
    pieces += placed([Piece(chair), *rows(small_table, (-0.62, 0.62), (0.0,))], *bench, 180.0)
    sites = [*((x, z) for x, z, _ in squares), *rounds, bench]
    stops = [
        (0.35, 0.40), (2.35, 0.65), (4.50, 0.35), (6.50, 0.55), (6.40, 2.30), (4.70, 2.50), (2.25, 1.80),
        (0.85, 2.50), (0.35, 4.30), (2.25, 4.90), (2.45, 6.30), (3.55, 6.30), (4.45, 5.85), (4.65, 4.80),
        (5.95, 4.05), (6.65, 5.40), (6.10, 6.20), (4.95, 6.20), (4.65, 4.60), (4.90, 2.95), (4.45, 0.85),
        (2.35, 0.85), (2.20, 2.45), (2.20, 4.20), (0.55, 4.35), (0.30, 3.40), (0.35, 1.85),
    ]  # fmt: skip
    return furnish("H1", (7.0, 7.0), pieces, sites, stops)
