"""The numbers of one plane, by the names of their places: three arrays, so that a compiled call costs little.

* `handle`: addresses of Chipmunk's objects, as named by `SPACE` to `FIRST`; from `FIRST` on the boxes'
bodies.
* `state`: numbers that change, as named by `TICKS` to `STATES`.
* `box`: a row for each box, its columns named by `BOX_X` to `COLUMNS`.

What works on them is `resting`, `nearness`, `arm`, `ticking` and `guiding`. Only `math` is used there, not
NumPy, so that they give the same bytes where they are not compiled.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Addresses = npt.NDArray[np.int64]

TICK = 1 / 60
"""Length of a tick, seconds."""

SPACE, ARM, DISC, DISC_SHAPE, PULL, TWIST, MOVED, FIRST = range(8)
"""Places in `handle`. `MOVED` is the body that the arm moves."""

(
    TICKS,
    STILL,
    QUIET,
    PRESENT,
    RAISED,
    GOES_LOW,
    GRIPPED,
    X,
    Z,
    ANGLE,
    VELOCITY_X,
    VELOCITY_Z,
    SPIN,
    POINT_X,
    POINT_Z,
    TURN,
    WIDTH,
    DEPTH,
    METRES,
    RADIANS,
    CHANGES,
    STATES,
) = range(22)
"""Places in `state`: ticks so far; whether all is still, and for how many ticks nothing was touched; whether
there is a hand, it hovers, is to go down, and which box it holds (-1 for none); where it hovers; how it is
steered; the point of the moved body that it is at, and how it is turned against that; the plane's extent;
the way and the turns of all boxes so far; how often poses have changed; how many places there are."""

BOX_X, BOX_Z, BOX_ANGLE, HALF_WIDTH, HALF_DEPTH, MOVABLE, OLD_X, OLD_Z, OLD_ANGLE, ELEVATION, COLUMNS = range(
    11
)
"""Columns of `box`: its pose; half its sides; 1 if it can be moved; its pose when it was last compared;
how high its pivot is."""
