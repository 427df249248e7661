"""Packages that only some players and attacks need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from farm_ar.errors import MissingPackageError


def package(name: str) -> Any:
    """A package, or a module of one.

    Raises:
        MissingPackageError: it is not installed; says how to.
    """
    try:
        return import_module(name)
    except ImportError as problem:
        top = name.partition(".")[0]
        expected = (
            f"this needs {top}: install the extra train (in the project's folder: pip install '.[train]')"
        )
        raise MissingPackageError(expected) from problem
