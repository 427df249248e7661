"""Assignment of labels to detections: the compiled method, the optimum and its margins, solvers by name."""

from farm_ar.reid.assignment.assessment import (
    assess,
    assess_objects,
    fill_costs,
    in_parts,
    known_objects,
    labels_of_one,
    margins_of_one,
    pose_cost,
)
from farm_ar.reid.assignment.optimum import (
    assign,
    assign_most,
    find_margins,
    margins,
    margins_and_runners_up,
)
from farm_ar.reid.assignment.problem import Answer, CostModel, Known, Seen, known_at, seen_at
from farm_ar.reid.assignment.solvers import (
    SOLVERS,
    UNASSIGNED,
    Assignment,
    k_best,
    solve_assignment,
    solve_lsap,
    solve_mip,
)
from farm_ar.reid.assignment.workspace import Workspace, workspace_for

__all__ = [
    "SOLVERS",
    "UNASSIGNED",
    "Answer",
    "Assignment",
    "CostModel",
    "Known",
    "Seen",
    "Workspace",
    "assess",
    "assess_objects",
    "assign",
    "assign_most",
    "fill_costs",
    "find_margins",
    "in_parts",
    "k_best",
    "known_at",
    "known_objects",
    "labels_of_one",
    "margins",
    "margins_and_runners_up",
    "margins_of_one",
    "pose_cost",
    "seen_at",
    "solve_assignment",
    "solve_lsap",
    "solve_mip",
    "workspace_for",
]
