"""The re-identifiers by the names and options that the command line gives them."""

from __future__ import annotations

from dataclasses import replace

from farm_ar.cli.inputs import numbers, refuse
from farm_ar.errors import OptionError
from farm_ar.reid import (
    DistanceReid,
    Identification,
    LikelihoodOptions,
    LikelihoodReid,
    NearestReid,
    Reidentifier,
    SpatialOptions,
    SpatialReid,
    explain,
    load_reid,
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
    """A re-identifier for a scene; None leaves an option at its own default.

    Raises:
        OptionError: it is not known, or an option does not apply to it or has a wrong value.
        SceneError: the scene has no objects, or a weight is negative.
    """
    make, with_it = load_reid(name, "--reid"), f"with --reid {name}"
    if name != "likelihood":
        refuse([("--min-confidence", min_confidence)], with_it)
    if name not in ("spatial", "spatial-ungated"):
        refuse({"--threshold": threshold, "--weights": weights, "--solver": solver}.items(), with_it)
    if name not in ("spatial", "distance", "nearest"):
        refuse([("--gate", gate)], with_it)
    if name == "likelihood" and min_confidence is not None:
        return LikelihoodReid(scene, LikelihoodOptions(min_confidence=min_confidence))
    if name == "nearest" and gate is not None:
        return NearestReid(scene, gate)
    if name == "distance" and gate is not None:
        return DistanceReid(scene, gate_categories=gate)
    made = make(scene)
    if name not in ("spatial", "spatial-ungated") or not isinstance(made, SpatialReid):
        return made
    default = made.options
    options = SpatialOptions(
        threshold=default.threshold if threshold is None else threshold,
        weights=default.weights if weights is None else Weights(*numbers("--weights", weights, "wt,wr")),
        gate_categories=default.gate_categories if gate is None else gate,
        solver=default.solver if solver is None else solver,
    )
    return SpatialReid(scene, options)


def decided_by_category(reid: Reidentifier, snapshot: Snapshot, found: Identification) -> list[str]:
    """The ids of the detections that would have other labels if categories were not kept apart."""
    if isinstance(reid, NearestReid) and reid.gate_categories:
        ungated: Reidentifier = NearestReid(reid.scene, gate_categories=False)
    elif isinstance(reid, SpatialReid) and reid.options.gate_categories:
        ungated = SpatialReid(reid.scene, replace(reid.options, gate_categories=False))
    else:
        return []
    others = ungated.identify(snapshot).labels
    named = zip(snapshot.detections.ids, found.labels, others, strict=True)
    return [name for name, label, other in named if label != other]


def explanation(rule: Reidentifier, snapshot: Snapshot, detection: str) -> str:
    """Why a detection, by its id, gets the label that a rule gives it.

    Raises:
        OptionError: the rule does not explain itself.
        SnapshotError: there is no such detection.
    """
    if not isinstance(rule, Explains):
        raise OptionError("--explain", "must be with --reid spatial or likelihood", detection)
    return explain(rule, snapshot, detection).words()
