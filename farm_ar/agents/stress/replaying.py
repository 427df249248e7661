"""Playing a failure again, from what its file says, and seeing that it is the same to the last bit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from farm_ar.agents.attacks import Trial
from farm_ar.agents.cases import Case
from farm_ar.agents.stress.rules import make_reid
from farm_ar.agents.stress.units import known_case
from farm_ar.reid import Identification
from farm_ar.scenes import Snapshot, observe


@dataclass(frozen=True, eq=False)
class Replayed:
    """A failure that was played again.

    Args:
        case: its case.
        snapshot: what the camera sees after it.
        answer: what the re-identifier says.
        truth: the labels that the detections really are.
        effort: what it takes now.
        wrong: wrong labels now; -1 if the perturbation is not allowed.
        same: whether effort and wrong labels are, bit for bit, those of the file.
    """

    case: Case
    snapshot: Snapshot
    answer: Identification
    truth: tuple[str | None, ...]
    effort: float
    wrong: int
    same: bool


def replay_failure(failure: Mapping[str, Any]) -> Replayed:
    """Play a failure again.

    Args:
        failure: scene, jitter, seed, case, reid, position, yaw, effort and wrong, as `stress.json` has them.
    """
    case = known_case(failure["scene"], failure["case"], failure["jitter"], failure["seed"])
    reid = make_reid(failure["reid"], case.scene)
    position, yaw = np.array(failure["position"]), np.array(failure["yaw"])
    trial = Trial(case, reid, queries=1, budget=np.inf)
    effort = float(trial.effort(position, yaw))
    trial.budget = max(effort, 1e-12)
    wrong = int(trial.ask(position[None], yaw[None])[0])
    snapshot, truth = observe(case.layout.with_poses(position, yaw), case.camera)
    same = effort == failure["effort"] and wrong == failure["wrong"]
    return Replayed(case, snapshot, reid.identify(snapshot), truth, effort, wrong, same)
