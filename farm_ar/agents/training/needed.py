"""What training needs beyond the core, and what to install where it is missing."""

from __future__ import annotations

import importlib

from farm_ar.errors import MissingPackageError

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
