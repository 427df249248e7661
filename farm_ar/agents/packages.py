"""Packages that only some policies, attacks and the training need."""

from __future__ import annotations

from types import ModuleType

from farm_ar.errors import import_extra

PACKAGES = ("torch", "stable_baselines3", "sb3_contrib", "tensorboard", "yaml")


def package(name: str) -> ModuleType:
    """A package of the extra `train`, or a module of one.

    Raises:
        MissingPackageError: it is not installed; says how to.
    """
    return import_extra(name, "train")


def need_training() -> None:
    """See that everything is there, before any work begins.

    Raises:
        MissingPackageError: it is not.
    """
    for name in PACKAGES:
        import_extra(name, "train", "training")
