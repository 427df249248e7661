"""How the parts of real things stand, seen in the headset's picture: analysis by synthesis.

For a gate or a coop's stairs the picture is drawn both ways, from where things are believed to be, and
compared with what the camera gives, where the two drawings differ: a likelihood ratio under normal noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.drawing.game.real_things import CameraPicture
from farm_ar.game_logic.events import Parts
from farm_ar.game_logic.render_state import RenderState
from farm_ar.rendering import Sensor
from farm_ar.scenes import Scene
from farm_ar.showcases.result import Image

SIZE = (640, 360)
"""Width and height of the headset's picture, pixels."""

DIFFERENT = 6.0
"""Least difference of the two drawings, of 255, that counts."""

NOISE = 14.0
"""SD of what sensor and compression leave of a pixel's error after the gain is fitted, of 255."""

FEWEST, SURE = 25, 8.0
"""Pixels and (natural) logarithm of the likelihood ratio below which what was known stays."""


@dataclass(frozen=True)
class Verdict:
    """What a picture says of one part.

    Args:
        log_ratio: logarithm of how much likelier "open", or "off", is than its opposite.
        pixels: how many pixels say so.
    """

    log_ratio: float
    pixels: int

    @property
    def decided(self) -> bool:
        """Whether it is enough to go by."""
        return self.pixels >= FEWEST and abs(self.log_ratio) >= SURE


class PixelParts:
    """Finds out how gates and stairs stand from the camera's picture.

    Args:
        scene: the table.
        rng: for the sensor's noise.
        sensor: what the camera does to what is there.
    """

    def __init__(self, scene: Scene, rng: np.random.Generator, sensor: Sensor | None = None) -> None:
        self._scene, self._rng = scene, rng
        self._sensor = sensor or Sensor()
        self._camera = CameraPicture(scene, SIZE)
        self.verdicts: dict[tuple[str, int], Verdict] = {}

    def detect(self, state: RenderState, known: Parts) -> Parts:
        """How they stand: nothing is read off the state but the picture that it gives, and beliefs."""
        return self.explain(self._sensor.expose(self._camera.draw(state), self._rng), state, known)

    def explain(self, picture: Image, state: RenderState, known: Parts) -> Parts:
        """The parts that explain a picture (H, W, 3) best, one after the other."""
        believed = replace(state, truth=state.believed, hand=None)
        found, layout = known, self._scene.layout
        self.verdicts = {}
        for i in np.flatnonzero(layout.fixed).tolist():
            ways = (found.with_gate(i, 0.0), found.with_gate(i, 1.0))
            verdict = self.verdicts["gate", i] = self._compare(picture, believed, ways)
            if verdict.decided:
                found = ways[int(verdict.log_ratio > 0)]
        for i in [i for i, category in enumerate(layout.category) if category == "coop"]:
            ways = (found.with_stairs(i, True), found.with_stairs(i, False))
            verdict = self.verdicts["stairs", i] = self._compare(picture, believed, ways)
            if verdict.decided:
                found = ways[int(verdict.log_ratio > 0)]
        return found

    def _compare(self, picture: Image, believed: RenderState, ways: Sequence[Parts]) -> Verdict:
        """The second way against the first."""
        drawn = [
            self._camera.draw(
                replace(believed, missing=dict(parts.missing), open_gates=dict(parts.open_gates))
            ).astype(np.float64)
            for parts in ways
        ]
        where = np.abs(drawn[1] - drawn[0]).max(axis=-1) >= DIFFERENT
        count = int(where.sum())
        if not count:
            return Verdict(0.0, 0)
        seen = picture.astype(np.float64)
        around = _around(where)
        same = around & ~where
        gain = _gain(drawn[0][same], seen[same])
        errors = [
            (np.square(seen[where] - gain * one[where]) / (2 * NOISE**2)).mean(axis=-1) for one in drawn
        ]
        return Verdict(float((errors[0] - errors[1]).sum()), count)


def _around(where: BoolArray) -> BoolArray:
    """The box around some pixels, half as large again on every side."""
    rows, columns = np.flatnonzero(where.any(axis=1)), np.flatnonzero(where.any(axis=0))
    box: BoolArray = np.zeros_like(where)
    tall, wide = np.ptp(rows) // 2 + 8, np.ptp(columns) // 2 + 8
    box[max(rows[0] - tall, 0) : rows[-1] + tall + 1, max(columns[0] - wide, 0) : columns[-1] + wide + 1] = (
        True
    )
    return box


def _gain(drawn: FloatArray, seen: FloatArray) -> FloatArray:
    """(3,) by how much each colour of a picture is brighter than it was drawn."""
    if len(drawn) < 10:
        return np.ones(3)
    gain: FloatArray = np.median(seen / np.maximum(drawn, 1.0), axis=0)
    return gain
