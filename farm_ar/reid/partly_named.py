"""`AdaptiveReid` in a scene that says of some objects only what they look like."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from farm_ar.arrays import FloatArray, read_only
from farm_ar.reid.adaptive import AdaptiveReid, Disorder
from farm_ar.reid.adaptive.options import AdaptiveOptions
from farm_ar.reid.adaptive.pairs import Problem
from farm_ar.reid.categories import may_have
from farm_ar.scenes import Scene, Snapshot


class PartlyNamedReid(AdaptiveReid):
    """Identities where the categories of some objects are not known.

    Lengths and sizes are those of all objects together; a detection of a known category may be any object of
    that category, or of none that is known.

    Args:
        scene: the reference layout.
        options: what is assumed.
        disorder: what has been learnt of how untidy the place is.

    Raises:
        SceneError: the scene has no labels, or the disorder was learnt under other options.
    """

    def __init__(
        self, scene: Scene, options: AdaptiveOptions | None = None, disorder: Disorder | None = None
    ) -> None:
        super().__init__(scene.unnamed(), options, disorder)
        self.scene = scene
        periods = [scene.symmetry.get(name, 2 * np.pi) for name in scene.layout.category]
        self._known = replace(self._known, period=read_only(periods, np.float64))

    def _problem(self, snapshot: Snapshot, hint: FloatArray | None) -> Problem:
        layout, wrong = self.scene.layout, self.options.confusion
        allowed = np.array([may_have(layout, name) for name in snapshot.detections.category], dtype=bool)
        with np.errstate(divide="ignore"):
            odds = np.log(np.where(allowed.reshape(-1, len(layout)), 1.0, wrong))
        return super()._problem(snapshot, odds if hint is None else odds + hint)


def make_adaptive(scene: Scene) -> AdaptiveReid:
    """The method for a scene."""
    return adaptive_for(scene)(scene)


def adaptive_for(scene: Scene) -> type[AdaptiveReid]:
    """The class that identifies in a scene where nothing is known of the disorder."""
    return PartlyNamedReid if scene.layout.partly_named else AdaptiveReid
