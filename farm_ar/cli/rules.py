"""The identification rules by the names that the command line gives them."""

from __future__ import annotations

from collections.abc import Callable

from farm_ar.cli.inputs import numbers, refuse
from farm_ar.errors import known_name
from farm_ar.reid import DistanceReid, LastKnownReid, NearestReid, Reidentifier, SpatialOptions, SpatialReid
from farm_ar.scenes import Scene, Weights

SIMPLE_RULES: dict[str, Callable[[Scene], Reidentifier]] = {
    "nearest": NearestReid,
    "distance": DistanceReid,
    "last-known": LastKnownReid,
}
"""The rules without options."""


def make_rule(
    scene: Scene,
    name: str,
    threshold: float | None,
    weights: str | None,
    gate: bool | None,
    solver: str | None,
) -> Reidentifier:
    """A rule for a scene; None leaves an option at the rule's own default.

    Raises:
        OptionError: the rule is not known, or an option does not apply to it or has a wrong value.
        SceneError: the scene has no objects, or a weight is negative.
    """
    known_name("--reid", name, ("spatial", *SIMPLE_RULES))
    if name in SIMPLE_RULES:
        given = {"--threshold": threshold, "--weights": weights, "--gate": gate, "--solver": solver}
        refuse(given.items(), f"with --reid {name}")
        return SIMPLE_RULES[name](scene)
    default = SpatialOptions()
    options = SpatialOptions(
        threshold=default.threshold if threshold is None else threshold,
        weights=default.weights if weights is None else Weights(*numbers("--weights", weights, "wt,wr")),
        gate_categories=default.gate_categories if gate is None else gate,
        solver=default.solver if solver is None else solver,
    )
    return SpatialReid(scene, options)
