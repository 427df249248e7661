"""The identification rules by the names that the command line gives them."""

from __future__ import annotations

from farm_ar.cli.inputs import numbers, refuse
from farm_ar.errors import OptionError, known_name
from farm_ar.reid import (
    REIDENTIFIERS,
    LikelihoodOptions,
    LikelihoodReid,
    Reidentifier,
    SpatialOptions,
    SpatialReid,
    explain,
)
from farm_ar.reid.explanations import Explains
from farm_ar.scenes import Scene, Snapshot, Weights


def make_rule(
    scene: Scene,
    name: str,
    threshold: float | None,
    weights: str | None,
    gate: bool | None,
    solver: str | None,
    min_confidence: float | None = None,
) -> Reidentifier:
    """A rule for a scene; None leaves an option at the rule's own default.

    Raises:
        OptionError: the rule is not known, or an option does not apply to it or has a wrong value.
        SceneError: the scene has no objects, or a weight is negative.
    """
    known_name("--reid", name, REIDENTIFIERS)
    if name != "spatial":
        given = {"--threshold": threshold, "--weights": weights, "--gate": gate, "--solver": solver}
        refuse(given.items(), f"with --reid {name}")
        if name == "likelihood" and min_confidence is not None:
            return LikelihoodReid(scene, LikelihoodOptions(min_confidence=min_confidence))
        refuse([("--min-confidence", min_confidence)], f"with --reid {name}")
        return REIDENTIFIERS[name](scene)
    refuse([("--min-confidence", min_confidence)], "with --reid spatial")
    default = SpatialOptions()
    options = SpatialOptions(
        threshold=default.threshold if threshold is None else threshold,
        weights=default.weights if weights is None else Weights(*numbers("--weights", weights, "wt,wr")),
        gate_categories=default.gate_categories if gate is None else gate,
        solver=default.solver if solver is None else solver,
    )
    return SpatialReid(scene, options)


def explanation(rule: Reidentifier, snapshot: Snapshot, detection: str) -> str:
    """Why a detection, by its id, gets the label that a rule gives it.

    Raises:
        OptionError: the rule does not explain itself.
        SnapshotError: there is no such detection.
    """
    if not isinstance(rule, Explains):
        raise OptionError("--explain", "must be with --reid spatial or likelihood", detection)
    return explain(rule, snapshot, detection).words()
