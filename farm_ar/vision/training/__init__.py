"""Training of the network on random renders of meshes."""

from __future__ import annotations

from farm_ar.errors import import_extra

PACKAGES = ("torch", "onnx")


def need_packages() -> None:
    """See that everything is there, before any work begins.

    Raises:
        MissingPackageError: it is not.
    """
    for package in PACKAGES:
        import_extra(package, "vision", "training a network")
