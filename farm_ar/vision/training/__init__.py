"""Training of the network on random renders of meshes."""

from __future__ import annotations

from importlib import import_module

from farm_ar.errors import MissingPackageError

PACKAGES = ("torch", "onnx")


def need_packages() -> None:
    """See that everything is there, before any work begins.

    Raises:
        MissingPackageError: it is not.
    """
    for package in PACKAGES:
        try:
            import_module(package)
        except ImportError as problem:
            way = "install the extra vision (in the project's folder: pip install '.[vision]')"
            raise MissingPackageError(f"training a network needs {package}: {way}") from problem
