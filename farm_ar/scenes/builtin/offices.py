"""The three synthetic offices of the paper (Table 1, Fig. 4), rebuilt: L2, M1 and H2."""

from __future__ import annotations

import numpy as np

from farm_ar.scenes.builtin.furniture import Model, Piece, as_left, facing_rows, furnish, placed, ring, rows
from farm_ar.scenes.scene import Scene

L2_SEED, M1_SEED, H2_SEED = 12, 21, 32
"""Seeds of the disorder in which the staff leave each office."""


def l2() -> Scene:
    """Small office: four desks with two chairs each that face one another; only the chairs are objects."""
    rng = np.random.default_rng(L2_SEED)
    low, high, broad = (
        Model("chair", size) for size in ((0.61, 1.14, 0.72), (0.65, 1.16, 0.69), (0.65, 1.17, 0.69))
    )
    desks = [
        (2.35, 2.10, 90.0, (low, high)), (5.35, 2.35, 0.0, (low, broad)),
        (5.60, 5.40, 90.0, (broad, low)), (2.60, 5.60, 0.0, (high, low)),
    ]  # fmt: skip
    pieces: list[Piece] = []
    for x, z, turn, (near, far) in desks:
        pair = [Piece(near, 0.0, -0.84, 0.0), Piece(far, 0.0, 0.84, 180.0)]
        pieces += placed(as_left(pair, rng, 0.06, 16.0), x, z, turn)
    stops = [
        (0.55, 1.15), (0.45, 3.05), (2.80, 3.50), (3.65, 4.25), (3.75, 6.55), (3.10, 7.70), (0.70, 7.10),
        (0.55, 5.20), (2.00, 4.00), (3.65, 3.15), (4.25, 1.40), (5.00, 0.75), (6.65, 0.65), (7.75, 3.25),
        (7.40, 5.10), (6.85, 6.05), (4.90, 6.55), (3.85, 5.15), (4.20, 3.60), (3.95, 1.20), (2.30, 0.55),
    ]  # fmt: skip
    return furnish("L2", (8.0, 8.0), pieces, [(x, z) for x, z, _, _ in desks], stops)


def m1() -> Scene:
    """Middle-sized office: four blocks of four desks, all looking one way, and three easy chairs."""
    rng = np.random.default_rng(M1_SEED)
    chair, easy_chair = Model("chair", (0.48, 0.89, 0.55)), Model("round-chair", (0.68, 0.86, 0.58))
    desk = Model("table", (0.92, 0.77, 0.63))
    xs, zs = (-0.53, 0.53), (-0.695, 0.695)
    blocks = [(1.55, 1.80), (5.25, 1.95), (1.60, 4.95), (5.30, 5.05)]
    corner = (2.60, 7.50)
    pieces: list[Piece] = []
    for x, z in blocks:
        seats = as_left(rows(chair, xs, [d + 0.65 for d in zs], 180.0), rng, 0.06, 7.0)
        pieces += placed([*rows(desk, xs, zs), *seats], x, z, 90.0)
    pieces += placed(as_left(rows(easy_chair, (-0.86, 0.0, 0.86), (0.0,)), rng, 0.06, 12.0), *corner, 180.0)
    stops = [
        (0.40, 0.85), (0.50, 3.30), (1.50, 3.40), (3.50, 3.15), (6.20, 3.30), (6.80, 3.40), (7.60, 6.30),
        (6.75, 7.45), (3.75, 6.50), (1.25, 6.60), (0.30, 5.80), (0.30, 3.75), (1.35, 3.15), (3.25, 3.55),
        (3.70, 5.00), (4.40, 6.75), (5.05, 7.50), (7.15, 7.45), (7.70, 5.50), (7.60, 3.10), (7.60, 1.00),
        (6.45, 0.45), (3.75, 0.25), (1.25, 0.30),
    ]  # fmt: skip
    return furnish("M1", (8.0, 8.0), pieces, [*blocks, corner], stops)


def h2() -> Scene:
    """Large office: desks along a wall, two conference tables, places to talk, two lounges."""
    rng = np.random.default_rng(H2_SEED)
    chair = Model("chair", (0.65, 1.07, 0.67))
    conference_chair = Model("conference-chair", (0.60, 1.05, 0.69))
    orange_chair = Model("orange-chair", (0.69, 0.81, 0.54))
    green_chair = Model("green-chair", (0.88, 0.76, 0.84))
    black_sofa = Model("black-sofa", (2.05, 0.73, 1.01))
    black_small_sofa = Model("black-small-sofa", (1.10, 0.74, 1.07))
    blue_sofa = Model("blue-sofa", (1.84, 0.85, 1.00))
    blue_small_sofa = Model("blue-small-sofa", (1.20, 0.87, 0.99))
    table = Model("table", (2.37, 0.71, 1.59))
    single_desk = Model("single-desk", (1.46, 0.74, 0.64))
    chat_table = Model("chat-table", (0.71, 0.38, 0.55))

    two_desks = rows(single_desk, (-0.98, 0.98), (0.0,))
    desk_seats = rows(chair, (-0.98, 0.98), (0.66,), 180.0)
    talk_seats = ring(chair, (0.80, 0.80), 90.0)
    conference_seats = facing_rows(conference_chair, (-0.88, 0.0, 0.88), apart=2.40)
    chat_seats = ring(orange_chair, (0.74, 0.74))
    green_seats = ring(green_chair, (0.75, 0.75, 0.75))
    black_lounge = [Piece(black_sofa), *rows(black_small_sofa, (-1.90, 1.90), (0.0,))]
    blue_lounge = [
        Piece(blue_sofa),
        Piece(blue_small_sofa, -1.55, 1.60, 100.0),
        Piece(blue_small_sofa, 1.50, 1.40, 200.0),
    ]
    # What stands still, the seats that people move, and where and how the group is turned.
    groups: list[tuple[list[Piece], list[Piece], float, float, float]] = [
        (two_desks, desk_seats, 2.60, 0.50, 0.0),
        (two_desks, desk_seats, 10.90, 0.50, 0.0),
        ([], talk_seats, 2.00, 4.30, 0.0),
        ([], talk_seats, 2.20, 8.40, 0.0),
        ([], talk_seats, 5.60, 6.90, 0.0),
        ([], talk_seats, 5.80, 3.20, 0.0),
        ([Piece(table)], conference_seats, 9.60, 4.15, 0.0),
        ([Piece(table)], conference_seats, 9.40, 9.65, 0.0),
        ([Piece(chat_table)], chat_seats, 13.30, 3.20, 0.0),
        ([Piece(chat_table)], chat_seats, 13.20, 6.40, 20.0),
        ([Piece(chat_table)], chat_seats, 13.40, 9.60, 80.0),
        ([], green_seats, 5.60, 10.90, 0.0),
        (black_lounge, [], 4.20, 14.00, 180.0),
        (blue_lounge, [], 12.40, 14.00, 180.0),
    ]
    pieces: list[Piece] = []
    for standing, seats, x, z, turn in groups:
        pieces += placed([*standing, *as_left(seats, rng, 0.05, 12.0)], x, z, turn)
    stops = [
        (1.20, 2.40), (0.50, 4.30), (1.00, 6.10), (2.60, 6.70), (3.80, 7.70), (3.40, 9.40), (1.60, 9.90),
        (0.80, 11.20), (1.20, 12.60), (4.50, 12.40), (7.50, 13.60), (9.40, 13.50), (10.20, 11.80),
        (12.00, 11.10), (11.75, 8.05), (11.70, 7.10), (9.00, 7.00), (7.40, 8.20), (7.60, 11.00),
        (6.50, 12.60), (4.00, 11.60), (4.20, 9.90), (6.65, 8.95), (7.05, 6.35), (7.40, 3.50), (8.40, 2.00),
        (10.95, 2.35), (14.30, 1.40), (14.20, 4.70), (12.10, 4.90), (11.50, 2.90), (7.90, 1.45),
        (6.50, 0.60), (5.60, 1.50), (3.90, 2.60),
    ]  # fmt: skip
    return furnish("H2", (15.0, 15.0), pieces, [(x, z) for _, _, x, z, _ in groups], stops)
