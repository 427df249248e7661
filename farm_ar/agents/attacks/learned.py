"""The attack of trained policies: they play the case with the hand, and what they leave behind is refined."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from farm_ar.agents.attacks.base import Attack, QueryOracle
from farm_ar.agents.attacks.boundary_refinement import refine
from farm_ar.agents.cases import Case
from farm_ar.agents.packages import need_training
from farm_ar.arrays import FloatArray
from farm_ar.geometry import wrap
from farm_ar.scenes import Scene

ROUNDING = 1e-9
"""Radians below which a heading has not changed."""

if TYPE_CHECKING:
    from farm_ar.agents.policies import Policy
    from farm_ar.envs import FarmToTableEnv

SHIPPED = ("farm-displacement", "farm-slot")
"""The policies that come with farm-ar."""

SHARES = (1.0, 0.5, 0.25)
"""Of the budget with which a policy learnt: with less in hand it leaves cheaper failures behind."""


@dataclass(frozen=True)
class Learned(Attack):
    """Policies of the environments as an attack.

    Each plays the case from its layout and camera, in the environment that it was trained in, with all of its
    budget and with less. The layout after each of its moves, pushed objects included, is queried; then
    the cheapest failure is refined as every other attack's is.

    Args:
        policies: folders of training runs, or names of policies that come with farm-ar.
        trust: whether the folders may load code of whoever wrote them, as in `load_policy`.
    """

    policies: Sequence[str] = SHIPPED
    trust: bool = False

    def __call__(self, oracle: QueryOracle, rng: np.random.Generator) -> None:
        """Play, ask, refine; only what is refined by chance uses the generator.

        Raises:
            OptionError: a policy cannot act in the scene.
            RunError: there is no such policy.
            MissingPackageError: what training needs is not installed.
        """
        for name in self.policies:
            policy, env = _seated(name, oracle.case.scene, self.trust)
            for share in SHARES:
                left = list(layouts_left(policy, _with_budget(env, share), oracle.case))
                if left and oracle.left > 0:
                    oracle.query(*(np.stack(values) for values in zip(*left, strict=True)))
        refine(oracle, rng)

    def check(self, scene: Scene) -> None:
        """See that the policies can act in a scene.

        Raises:
            OptionError: one cannot.
            RunError: there is no such policy.
            MissingPackageError: what training needs is not installed.
        """
        for name in self.policies:
            _seated(name, scene, self.trust)

    @property
    def fingerprint(self) -> str:
        """A hash of what the policies have learnt; results with another hash are not reused.

        Raises:
            RunError: there is no such policy.
            MissingPackageError: what training needs is not installed.
        """
        need_training()
        return sha256(b"".join(_weights_of(name) for name in self.policies)).hexdigest()[:16]


def layouts_left(policy: Policy, env: FarmToTableEnv, case: Case) -> Iterator[tuple[FloatArray, FloatArray]]:
    """(N, 2) and (N,) the poses that a policy leaves behind, after each of its moves that changed some."""
    layout = case.layout
    env.reset(seed=0, options={"layout": layout, "camera": case.camera})
    before, over = env.world.truth, False
    while not over:
        _, _, terminated, truncated, _ = env.step(policy.act(env))
        over, after = terminated or truncated, env.world.truth
        turn = wrap(after.yaw - layout.yaw)
        if np.any(after.position != before.position) or np.any(after.yaw != before.yaw):
            # Physics knows headings but for whole turns, and the last bits.
            still = (np.abs(turn) < ROUNDING) & np.all(after.position == layout.position, axis=1)
            yield after.position, np.where(still | layout.fixed, layout.yaw, layout.yaw + turn)
        before = after


def _seated(name: str, scene: Scene, trust: bool) -> tuple[Policy, FarmToTableEnv]:
    """A policy, and the environment that it learnt in, with the scene's table."""
    need_training()
    from farm_ar.agents.policies.trained import policy_and_env

    return policy_and_env(name, arguments={"scene": scene, "jitter": "none", "visits": 1}, trust=trust)


def _with_budget(env: FarmToTableEnv, share: float) -> FarmToTableEnv:
    """The same environment with a share of the budget, and without animals."""
    options = env.config
    arguments = {field.name: getattr(options, field.name) for field in fields(options)}
    names = ("budget_m", "budget_rad") if options.budget is None else ("budget",)
    return type(env)(
        **arguments | {name: share * arguments[name] for name in names} | {"animals_a_second": 0.0}
    )


def _weights_of(name: str) -> bytes:
    """The file that holds what a policy has learnt."""
    from farm_ar.agents.policies.base import SHIPPED as MODELS
    from farm_ar.agents.policies.base import shipped
    from farm_ar.agents.training.checkpoints import MODEL
    from farm_ar.agents.training.run_folder import BEST, RunFolder

    if name in shipped():
        return files("farm_ar.agents.policies").joinpath(MODELS, f"{name}.npz").read_bytes()
    folder = RunFolder(Path(name))
    folder.read()
    return (folder.newest(BEST) / MODEL).read_bytes()
