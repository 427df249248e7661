"""The methods that a session of the service can have: by name, with options that are declared here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from farm_ar.arrays import SHARE, WEIGHT
from farm_ar.errors import OptionError
from farm_ar.reid import (
    AdaptiveOptions,
    AdaptiveReid,
    DistanceReid,
    LikelihoodOptions,
    LikelihoodReid,
    NearestReid,
    Reidentifier,
    RelationalOptions,
    RelationalReid,
    SpatialOptions,
    SpatialReid,
    SquaredDistanceReid,
)
from farm_ar.reid.registry import MOST_PAIRS, REIDENTIFIERS, ReidFactory
from farm_ar.scenes import Scene, Weights
from farm_ar.scenes.documents import Object
from farm_ar.scenes.kinds import Either, Flag, Kind, MismatchError, Number, Numbers, Text

DEFAULT = "adaptive"
"""The method of a session that names none."""

IN_SPACE = ("spatial-3d",)
"""Methods that compare rotations in space, not headings alone."""

_MIN_CONFIDENCE = Number(SHARE, default=0.0, about="A label less probable than this is not given.")
_CONFUSION = Number(SHARE, default=0.0, about="How often a detected category is wrong; below 1.")
_OCCLUSION = Flag(default=True, about="Whether what stands behind a detection is out of view.")
_GATE = Flag(default=True, about="Whether a label goes only to detections of its category.")
_SPATIAL: dict[str, Kind] = {
    "threshold": Number(SHARE, default=1.0, about="Sites considered: 0 for the camera's own, 1 for all."),
    "weights": Either(
        (Text(("scene", "paper", "scale-free")), Numbers(2, WEIGHT, "[w_t, w_r]")),
        "scene, paper, scale-free or [w_t, w_r]",
        default="scene",
        about="Of translation and rotation.",
    ),
    "gate_categories": _GATE,
    "solver": Text(("lsap", "mip"), default="lsap"),
}
OPTIONS: dict[str, Object] = {name: Object({}) for name in REIDENTIFIERS} | {
    "adaptive": Object({"min_confidence": _MIN_CONFIDENCE, "confusion": _CONFUSION}),
    "likelihood": Object(
        {
            "min_confidence": _MIN_CONFIDENCE,
            "confusion": _CONFUSION,
            "occlusion": _OCCLUSION,
        }
    ),
    "relational": Object({"occlusion": _OCCLUSION}),
    "spatial": Object(_SPATIAL),
    "nearest": Object({"gate_categories": _GATE}),
    "distance": Object({"gate_categories": _GATE}),
    "squared-distance": Object({"gate_categories": _GATE}),
}
"""The options of each method, by its name."""

_MADE: dict[str, Callable[[Scene, Mapping[str, Any]], Reidentifier]] = {
    "adaptive": lambda scene, given: AdaptiveReid(scene, AdaptiveOptions(**given)),
    "likelihood": lambda scene, given: LikelihoodReid(scene, LikelihoodOptions(**given)),
    "relational": lambda scene, given: RelationalReid(
        scene, RelationalOptions(alone=LikelihoodOptions(**given))
    ),
    "spatial": lambda scene, given: SpatialReid(scene, _spatial(given)),
    "nearest": lambda scene, given: NearestReid(scene, **given),
    "distance": lambda scene, given: DistanceReid(scene, **given),
    "squared-distance": lambda scene, given: SquaredDistanceReid(scene, **given),
}


def method_of(name: object, options: object) -> tuple[ReidFactory, dict[str, Any]]:
    """What makes a method for a scene, and its options with those that were left out.

    Raises:
        OptionError: there is no such method, or an option is not one of its own or has a wrong value.
    """
    if not isinstance(name, str) or name not in OPTIONS:
        raise OptionError("method", f"must be one of {', '.join(sorted(OPTIONS))}", name)
    try:
        given = OPTIONS[name].check(options)
    except MismatchError as problem:
        field = ".".join(["options", *map(str, problem.path)])
        raise OptionError(field, problem.expected, problem.got) from None
    make = partial(_made, name, given) if name in _MADE else REIDENTIFIERS[name]
    return make, given


def check_size(name: str, labels: int, detections: int) -> None:
    """See that a method that looks at every motion of every pair is not asked about too many.

    Raises:
        OptionError: it would take gigabytes.
    """
    if labels * detections > MOST_PAIRS.get(name, labels * detections):
        expected = f"must be spatial, distance or nearest beyond {MOST_PAIRS[name]} labels times detections"
        raise OptionError("method", expected, f"{name} ({labels} x {detections})")


def _made(name: str, given: Mapping[str, Any], scene: Scene) -> Reidentifier:
    return _MADE[name](scene, given)


def _spatial(given: Mapping[str, Any]) -> SpatialOptions:
    weights = given["weights"]
    chosen = Weights(*weights) if isinstance(weights, tuple) else weights
    return SpatialOptions(**{**given, "weights": chosen})
