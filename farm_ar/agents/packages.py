"""Packages that only some policies, attacks and the training need."""

from __future__ import annotations

import importlib
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


PACKAGES = ("torch", "stable_baselines3", "sb3_contrib", "tensorboard", "yaml")


def need_training() -> None:
    """See that everything is there, before any work begins.

    Raises:
        MissingPackageError: it is not.
    """
    for package in PACKAGES:
        try:
            importlib.import_module(package)
        except ImportError as problem:
            way = "install the extra train (in the project's folder: pip install '.[train]')"
            raise MissingPackageError(f"training needs {package}: {way}") from problem
