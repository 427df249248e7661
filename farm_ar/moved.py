"""Modules that have moved: files made earlier name functions and classes by the modules of their time.

Stores name the functions of their units, failures a re-identifier, pickles their classes. Importing a
former name gives the module of today, so each of them opens as it did.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

MOVED = {
    "farm_ar.agents.stress.units": "farm_ar.agents.stress.study",
    "farm_ar.agents.training.algorithms": "farm_ar.agents.training.recipes",
    "farm_ar.agents.training.imitating": "farm_ar.agents.training.imitation",
    "farm_ar.agents.training.muon_adam": "farm_ar.agents.training.object_policy",
    "farm_ar.benchmark.asking": "farm_ar.benchmark.evaluation",
    "farm_ar.benchmark.running": "farm_ar.benchmark.run",
    "farm_ar.envs.farm_to_table": "farm_ar.envs.env",
    "farm_ar.reid.alternatives": "farm_ar.reid.explanations",
    "farm_ar.reid.association": "farm_ar.reid.fusion.association",
    "farm_ar.reid.certified_pruning": "farm_ar.reid.certificates",
    "farm_ar.reid.identification": "farm_ar.reid.answers",
    "farm_ar.reid.k_best": "farm_ar.reid.assignment.solvers",
    "farm_ar.reid.likelihood_options": "farm_ar.reid.likelihood.options",
    "farm_ar.reid.motion_models": "farm_ar.reid.likelihood.motions",
    "farm_ar.reid.noise_prior": "farm_ar.reid.likelihood.motions",
    "farm_ar.reid.relational_options": "farm_ar.reid.relational.options",
    "farm_ar.reid.solvers": "farm_ar.reid.assignment.solvers",
    "farm_ar.reid.tracking": "farm_ar.reid.fusion.tracking",
}
"""The module of today by each former name under which files may know it."""

FORMER = {today: former for former, today in reversed(MOVED.items())}
"""The first of the former names of each module that has moved."""


class _Former(MetaPathFinder, Loader):
    """Finds modules by their former names, where nothing else does."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return ModuleSpec(fullname, self) if fullname in MOVED else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = import_module(MOVED[spec.name])
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        former = module.__spec__
        module.__spec__ = former.loader_state if former is not None else None


def find_moved() -> None:
    """Have former names found from now on."""
    if not any(isinstance(finder, _Former) for finder in sys.meta_path):
        sys.meta_path.append(_Former())
