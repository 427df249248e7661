"""Rectangles on the plane, compiled: how far apart two are, how far a point is, how far one reaches.

An angle is counter-clockwise as Chipmunk has it (`angle = -yaw`); half sides lie along the rectangle's own
right and forward.
"""

from __future__ import annotations

from math import cos, fabs, inf, sin, sqrt

from farm_ar.kernels import compiled


@compiled
def length(x: float, z: float) -> float:
    """Of a vector; `hypot` is not the same to the last bit everywhere."""
    return sqrt(x * x + z * z)


@compiled
def separation(
    dx: float,
    dz: float,
    angle: float,
    other_angle: float,
    half_width: float,
    half_depth: float,
    other_half_width: float,
    other_half_depth: float,
) -> tuple[float, float, float]:
    """How far apart two rectangles are along that side of either along which they are farthest apart.

    Separating axes: two rectangles are apart exactly if they are apart along a side of one of them.

    Args:
        dx: from the first one's centre to the second's, metres.
        dz: likewise.
        angle: of the first, radians.
        other_angle: of the second, radians.
        half_width: of the first, metres.
        half_depth: likewise.
        other_half_width: of the second, metres.
        other_half_depth: likewise.

    Returns:
        Metres, below 0 where they overlap: then by how much the second has to move to get out by the shortest
        way; and the unit vector along which.
    """
    turn = other_angle - angle
    shared_sine, shared_cosine = fabs(sin(turn)), fabs(cos(turn))
    most, along_x, along_z = -inf, 0.0, 0.0
    for k in range(2):
        sine, cosine = (sin(angle), cos(angle)) if k == 0 else (sin(other_angle), cos(other_angle))
        own_width, own_depth = (half_width, half_depth) if k == 0 else (other_half_width, other_half_depth)
        width, depth = (other_half_width, other_half_depth) if k == 0 else (half_width, half_depth)
        across, ahead = cosine * dx + sine * dz, cosine * dz - sine * dx
        gap = fabs(across) - (own_width + shared_cosine * width + shared_sine * depth)
        if gap > most:
            side = 1.0 if across >= 0 else -1.0
            most, along_x, along_z = gap, side * cosine, side * sine
        gap = fabs(ahead) - (own_depth + shared_sine * width + shared_cosine * depth)
        if gap > most:
            side = 1.0 if ahead >= 0 else -1.0
            most, along_x, along_z = gap, -side * sine, side * cosine
    return most, along_x, along_z


@compiled
def point_distance(dx: float, dz: float, angle: float, half_width: float, half_depth: float) -> float:
    """From a point, at (dx, dz) from its centre, to a rectangle, metres; 0 inside."""
    sine, cosine = sin(angle), cos(angle)
    across = max(fabs(cosine * dx + sine * dz) - half_width, 0.0)
    ahead = max(fabs(cosine * dz - sine * dx) - half_depth, 0.0)
    return length(across, ahead)


@compiled
def half_extent(angle: float, half_width: float, half_depth: float) -> tuple[float, float]:
    """How far a rectangle reaches from its centre along x and along z, metres."""
    sine, cosine = fabs(sin(angle)), fabs(cos(angle))
    return cosine * half_width + sine * half_depth, sine * half_width + cosine * half_depth
