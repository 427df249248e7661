"""What the network should have said of a sample, and how far what it said is from that."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import torch
from torch import nn

from farm_ar.vision import heads
from farm_ar.vision.canonical import HEIGHT, STRIDE, WIDTH
from farm_ar.vision.training.samples import Sample

FloatImage = npt.NDArray[np.float32]

ROWS, COLUMNS = HEIGHT // STRIDE, WIDTH // STRIDE

LEAST_VISIBLE, SURELY_VISIBLE = 0.1, 0.3
"""Shares of a thing that must be seen for it to count at all, and to count in full."""

WEIGHTS = {"heat": 1.0, "foot": 1.0, "heading": 1.0, "visible": 0.3, "spread": 0.1, "foreground": 0.3}


def targets_of(samples: Sequence[Sample], categories: int) -> tuple[torch.Tensor, ...]:
    """What a batch of B samples teaches.

    Returns:
        Images (B, 3, H, W); heat (B, C, h, w) and how much it counts; values (B, 7, h, w), and how much they
        count (B, h, w); foreground (B, h, w).
    """
    count = len(samples)
    heat = np.zeros((count, categories, ROWS, COLUMNS), np.float32)
    careful = np.ones_like(heat)
    values = np.zeros((count, heads.VISIBLE + 1, ROWS, COLUMNS), np.float32)
    weight = np.zeros((count, ROWS, COLUMNS), np.float32)
    for b, sample in enumerate(samples):
        for thing in sorted(sample.things, key=lambda row: row[6]):
            _add(thing, heat[b], careful[b], values[b], weight[b])
    images = np.stack([sample.image for sample in samples]).astype(np.float32) / 255
    share = np.stack([sample.foreground for sample in samples]).astype(np.float32) / 255
    arrays = (images.transpose(0, 3, 1, 2), heat, careful, values, weight, share)
    return tuple(torch.from_numpy(np.ascontiguousarray(array)) for array in arrays)


def _add(
    thing: npt.NDArray[np.float32],
    heat: FloatImage,
    careful: FloatImage,
    values: FloatImage,
    weight: FloatImage,
) -> None:
    category, u, v, foot_u, foot_v, yaw, visible, extent = thing.tolist()
    if visible < 0.02:
        return
    column, row = (u + 0.5) / STRIDE - 0.5, (v + 0.5) / STRIDE - 0.5
    left, top = max(round(column) - 4, 0), max(round(row) - 4, 0)
    here = (slice(top, round(row) + 5), slice(left, round(column) + 5))
    rows, columns = np.mgrid[top : min(round(row) + 5, ROWS), left : min(round(column) + 5, COLUMNS)]
    sd = float(np.clip(0.12 * extent / STRIDE, 0.8, 2.0))
    away = (rows - row) ** 2 + (columns - column) ** 2
    nearest = (rows == round(row)) & (columns == round(column))
    bump = np.where(nearest, 1.0, np.exp(-away / (2 * sd * sd))).astype(np.float32)
    layer = int(category)
    if visible < LEAST_VISIBLE:  # neither right nor wrong
        careful[layer][here] = np.minimum(careful[layer][here], 1 - bump)
        return
    sure = float(np.clip((visible - LEAST_VISIBLE) / (SURELY_VISIBLE - LEAST_VISIBLE), 0.1, 1.0))
    heat[layer][here] = np.maximum(heat[layer][here], bump)
    careful[layer][here] = np.where(nearest, sure, careful[layer][here])
    mine = (bump > 0.3) & (bump >= weight[here] * 0.8)
    weight[here] = np.where(mine, bump, weight[here])
    told = [
        (foot_u + 0.5) / STRIDE - (columns + 0.5),
        (foot_v + 0.5) / STRIDE - (rows + 0.5),
        *(np.full(rows.shape, f(k * yaw)) for k in (1, 2) for f in (np.sin, np.cos)),
        np.full(rows.shape, visible),
    ]
    for channel, value in enumerate(told):
        values[channel][here] = np.where(mine, value, values[channel][here])


def losses_of(output: torch.Tensor, targets: tuple[torch.Tensor, ...]) -> dict[str, torch.Tensor]:
    """Each term of the loss of a batch; `WEIGHTS` says how much each counts."""
    _, heat, careful, values, weight, share = targets
    categories = heat.shape[1]
    logit, rest = output[:, :categories].float(), output[:, categories:].float()
    number = (heat == 1).sum().clamp(min=1)
    chance = torch.sigmoid(logit)
    right = nn.functional.logsigmoid(logit) * (1 - chance) ** 2 * (heat == 1)
    wrong = nn.functional.logsigmoid(-logit) * chance**2 * (1 - heat) ** 4 * (heat < 1)
    terms = {"heat": -((right + wrong) * careful).sum() / number}
    whole = weight.sum().clamp(min=1)
    off = (rest[:, heads.FOOT] - values[:, heads.FOOT]).abs()
    terms["foot"] = (_soft(off).sum(dim=1) * weight).sum() / whole
    both = slice(heads.HEADING.start, heads.AXIS.stop)
    terms["heading"] = (((rest[:, both] - values[:, both]) ** 2).sum(dim=1) * weight).sum() / whole
    seen = (rest[:, heads.VISIBLE] - values[:, heads.VISIBLE]) ** 2
    terms["visible"] = (seen * weight).sum() / whole
    axis = torch.cat([rest[:, heads.AXIS], values[:, heads.AXIS]], dim=1)
    turn = torch.atan2(
        axis[:, 0] * axis[:, 3] - axis[:, 1] * axis[:, 2], axis[:, 0] * axis[:, 2] + axis[:, 1] * axis[:, 3]
    )
    errors = torch.stack([off.sum(dim=1), turn.abs() / 2], dim=1).detach()
    logs = rest[:, heads.SPREAD].clamp(-8, 3)
    terms["spread"] = ((logs + errors * torch.exp(-logs)).sum(dim=1) * weight).sum() / whole
    terms["foreground"] = nn.functional.binary_cross_entropy_with_logits(rest[:, heads.FOREGROUND], share)
    return terms


def _soft(error: torch.Tensor, knee: float = 0.1) -> torch.Tensor:
    """The error, below the knee its square."""
    return torch.where(error < knee, error * error / (2 * knee), error - knee / 2)
