"""Plans of whole visits: which object goes how far towards which label's place, found by a beam search."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from farm_ar.agents.players.acting import moves_left, possible
from farm_ar.agents.players.foreseeing import foresee
from farm_ar.arrays import BoolArray, FloatArray
from farm_ar.envs import FarmToTableEnv
from farm_ar.envs.actions import SlotAction
from farm_ar.envs.budget import Budget
from farm_ar.envs.moves import Move
from farm_ar.envs.placing import boxes_overlap
from farm_ar.envs.table import TableView
from farm_ar.geometry import wrap

AMBIGUITY_SHARE = 0.5
"""What a unit of ambiguity is worth beside a wrong label while a plan is unfinished."""

WAY_POINTS = 6
"""At how many places of its way an object must not stand in another."""


class Step(NamedTuple):
    """Object `mover` goes `share` of its way to the place of `label`."""

    mover: int
    label: int
    share: float


class _Node(NamedTuple):
    """An unfinished plan and the table after it."""

    steps: tuple[Step, ...]
    position: FloatArray
    yaw: FloatArray
    metres: float
    radians: float


def best_plan(env: FarmToTableEnv, beam: int) -> list[Step]:
    """The plan after which the paper's rule would give most wrong labels, less the price of the effort.

    Every object is moved once at most, over half of the way to the place of a label of its kind or farther
    (T3, T5), on a way that is clear, and within the budget. Plans grow step by step; of those of one length
    the most promising are kept.

    Args:
        env: an environment in an episode.
        beam: how many unfinished plans are kept.

    Raises:
        OptionError: the hand is steered.
    """
    view, most = env.view, moves_left(env)
    nodes = [_Node((), view.truth.position, view.truth.yaw, 0.0, 0.0)]
    best: tuple[float, tuple[Step, ...]] = (0.0, ())
    foreseen = foresee(env, view.truth.position[None], view.truth.yaw[None])
    before = int(foreseen.wrong[0])
    for _ in range(most):
        grown: dict[frozenset[Step], _Node] = {}
        for node in nodes:
            for step in _steps(view, node):
                key = frozenset((*node.steps, step))
                if key not in grown:
                    after = _after(env, node, step)
                    if after is not None:
                        grown[key] = after
        if not grown:
            break
        nodes = list(grown.values())
        seen = foresee(env, np.stack([n.position for n in nodes]), np.stack([n.yaw for n in nodes]))
        effort = np.array([n.metres / view.scene.diagonal + n.radians / np.pi for n in nodes])
        gain = seen.wrong - before - env.options.effort_weight * effort
        top = int(np.argmax(gain))
        if gain[top] > best[0]:
            best = float(gain[top]), nodes[top].steps
        promise = gain + AMBIGUITY_SHARE * seen.ambiguity
        nodes = [nodes[k] for k in np.argsort(-promise, kind="stable")[:beam]]
    return list(best[1])


def move_of(view: TableView, step: Step) -> Move:
    """The move that a step means, from where its object stands now."""
    shift = view.believed.position[step.label] - view.truth.position[step.mover]
    turn = float(wrap(view.believed.yaw[step.label] - view.truth.yaw[step.mover]))
    return Move(step.mover, step.share * shift, step.share * turn)


def _steps(view: TableView, node: _Node) -> list[Step]:
    """The steps that may come next."""
    done = {step.mover for step in node.steps}
    code = view.truth.category_code
    return [
        Step(int(i), int(j), share)
        for i in view.movable
        if view.in_view[i] and int(i) not in done
        for j in view.movable
        if i != j and code[i] == code[j]
        for share in SlotAction.SHARES
    ]


def _after(env: FarmToTableEnv, node: _Node, step: Step) -> _Node | None:
    """The plan with one step more; None where the budget does not reach or the way is not clear."""
    view = env.view
    move = _fitted(env.budget, node, possible(env, move_of(view, step)))
    metres = node.metres + float(np.linalg.norm(move.displacement))
    radians = node.radians + abs(move.turn)
    if metres + radians <= node.metres + node.radians:
        return None
    i = step.mover
    target = node.position[i] + move.displacement
    others = np.arange(len(node.yaw)) != i
    if not _way_is_clear(
        node.position, node.yaw, view.truth.size, others, i, target, float(node.yaw[i] + move.turn)
    ):
        return None
    position, yaw = node.position.copy(), node.yaw.copy()
    position[i], yaw[i] = target, yaw[i] + move.turn
    return _Node((*node.steps, step), position, yaw, metres, radians)


def _fitted(budget: Budget, node: _Node, move: Move) -> Move:
    """The move, scaled down to what the steps before it leave of the budget."""
    before = Move(-1, np.array([node.metres, 0.0]), node.radians)
    metres, radians = float(np.linalg.norm(move.displacement)), abs(move.turn)
    both = Move(-1, np.array([node.metres + metres, 0.0]), node.radians + radians)
    (kept,) = budget.fitted([both])
    by_way = (kept.displacement[0] - before.displacement[0]) / metres if metres else 0.0
    by_turn = (kept.turn - before.turn) / radians if radians else 0.0
    return Move(move.index, max(by_way, 0.0) * move.displacement, max(by_turn, 0.0) * move.turn)


@numba.njit(cache=True, nogil=True)
def _way_is_clear(
    position: FloatArray,
    yaw: FloatArray,
    size: FloatArray,
    others: BoolArray,
    i: int,
    target: FloatArray,
    heading: float,
) -> bool:
    """Whether object i stands in no other at several places on its way, its end included."""
    for k in range(1, WAY_POINTS + 1):
        share = k / WAY_POINTS
        x = position[i, 0] + share * (target[0] - position[i, 0])
        z = position[i, 1] + share * (target[1] - position[i, 1])
        turned = yaw[i] + share * (heading - yaw[i])
        for j in range(len(yaw)):
            if others[j] and boxes_overlap(
                position[j, 0] - x, position[j, 1] - z, turned, yaw[j], size[i] / 2, size[j] / 2
            ):
                return False
    return True
