"""Simulated worlds, unlike one another and unlike the paper's noise, each in its own units and origin.

Every world is a function of a generator and a number of examples; what it assumes stands in its docstring.
"""

from farm_ar.benchmark.worlds import elsewhere, fish, flats, measured, pedestrians, players
from farm_ar.benchmark.worlds.base import Example, Row, Truth

ROWS: dict[str, Row] = {
    row.name: row for world in (players, pedestrians, fish, flats, measured, elsewhere) for row in world.ROWS
}
"""The rows by name."""

__all__ = ["ROWS", "Example", "Row", "Truth"]
