"""The pose estimators by name, and users' own."""

from __future__ import annotations

from importlib import import_module

from farm_ar.errors import OptionError
from farm_ar.reid.registry import imported
from farm_ar.vision.base import PoseEstimator

ESTIMATORS = {"network": "farm_ar.vision.estimator:NetworkEstimator"}
"""Where each is found."""


def load_estimator(name: str, field: str = "estimator") -> PoseEstimator:
    """An estimator by name: one of ours, or one that a class of the user's own makes without arguments.

    Args:
        name: one in `ESTIMATORS`, or `module:Class`; importing its module runs it.
        field: what the error calls it.

    Raises:
        OptionError: there is no such name or class, or it makes something without `estimate`.
    """
    if name in ESTIMATORS:
        module, _, attribute = ESTIMATORS[name].partition(":")
        made = getattr(import_module(module), attribute)()
    else:
        made = imported(name, field, ESTIMATORS)()
    if not isinstance(made, PoseEstimator) and not callable(getattr(made, "estimate", None)):
        expected = "must give something with estimate(image, camera, meshes) when called"
        raise OptionError(field, expected, name)
    return made  # type: ignore[no-any-return]
