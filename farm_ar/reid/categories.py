"""Categories as codes: those that detections have must be those that the scene declares, or not known."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite

import numpy as np

from farm_ar.arrays import BoolArray, IntArray, first_wrong
from farm_ar.errors import SceneError, SnapshotError
from farm_ar.scenes import NO_CATEGORY, UNKNOWN, Detections, Layout, SnapshotBatch
from farm_ar.scenes.kinds import NEEDED

CategoryCodes = Mapping[str | None, int]
"""From each category that a scene declares to its index, and from None to `UNKNOWN`."""


class _NoneNamed(dict[str | None, int]):
    """The codes of a scene that names no categories: that of every name is `UNKNOWN`."""

    def __missing__(self, name: str | None) -> int:
        return UNKNOWN

    def get(self, name: str | None, default: object = None) -> int:
        """`UNKNOWN`, whatever the name."""
        return UNKNOWN


def declared_codes(layout: Layout) -> CategoryCodes:
    """The code of each category of a layout: its index in `layout.categories`.

    Of a layout that names no categories, that of every name is `UNKNOWN`.

    Raises:
        SceneError: it names those of some objects only, which `partly_named` sees to for `adaptive`.
    """
    if layout.partly_named:
        i = layout.category.index(NO_CATEGORY)
        expected = "must be given, as other objects have one: only the method adaptive does without"
        raise SceneError(f"objects[{i}].category", expected, NEEDED)
    if not layout.names_categories:
        return _NoneNamed()
    return {None: UNKNOWN} | {name: code for code, name in enumerate(layout.categories)}


def may_have(layout: Layout, category: str | None) -> BoolArray:
    """(M,) the labels that a detection of a category may have."""
    if category is None or not layout.names_categories:
        return np.ones(len(layout), dtype=bool)
    return np.array([name in (category, NO_CATEGORY) for name in layout.category], dtype=bool)


def require_places(seen: Detections) -> None:
    """See that every detection has a position.

    Raises:
        SnapshotError: one is not known.
    """
    if isfinite(np.vdot(seen.position, seen.position)):  # quicker than to look at each, and never too large
        return
    where = first_wrong(np.isfinite(seen.position))
    if where is not None:
        expected = "must be finite; farm_ar.reid.identify sets such detections aside"
        raise SnapshotError(f"detections[{where[0]}].position", expected, seen.position[where[0]].tolist())


def codes_in(seen: Detections, declared: CategoryCodes) -> list[int]:
    """The code of the category of each detection, of which all have a pose.

    Raises:
        SnapshotError: a category is not declared, or a position is not known.
    """
    require_places(seen)
    try:
        return [declared[name] for name in seen.category]
    except KeyError as problem:
        name = problem.args[0]
        raise _undeclared(f"detections[{seen.category.index(name)}]", name, declared) from None


def batch_codes(batch: SnapshotBatch, exists: BoolArray, declared: CategoryCodes) -> IntArray:
    """The code of the category of each detection of a batch.

    Args:
        batch: B snapshots of up to K detections.
        exists: (B, K) which of these there are.
        declared: the codes.

    Returns:
        (B, K) codes, `UNKNOWN` where there is no detection.

    Raises:
        SnapshotError: a category that occurs is not declared.
    """
    undeclared = UNKNOWN - 1
    # The last entry is the one that UNKNOWN, -1, picks.
    code = np.array([*(declared.get(name, undeclared) for name in batch.categories), UNKNOWN])
    codes: IntArray = code[np.where(exists, batch.category, UNKNOWN)]
    where = first_wrong(codes != undeclared)
    if where is not None:
        name = batch.categories[batch.category[where]]
        raise _undeclared(f"snapshots[{where[0]}].detections[{where[1]}]", name, declared)
    return codes


def _undeclared(where: str, category: str, declared: CategoryCodes) -> SnapshotError:
    known = ", ".join(name for name in declared if name is not None)
    return SnapshotError(f"{where}.category", f"must be null or one of {known}", category)
