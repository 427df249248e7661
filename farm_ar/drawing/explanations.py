"""A figure of an explanation: the cost terms of a detection's label beside the runner-up's."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from farm_ar.drawing.palette import INK, RIGHT, SMALL
from farm_ar.reid.explanations import Explanation

_RUNNER_UP = "#b0b0b0"


def draw_explanation(axes: Axes, explanation: Explanation) -> None:
    """Draw a pair of bars for each term: the label given, and the runner-up. Less speaks for a label.

    Args:
        axes: plain Matplotlib axes.
        explanation: what to draw; a detection without label and runner-up gives empty axes with a title.
    """
    shown = [
        (one, colour)
        for one, colour in ((explanation.given, RIGHT), (explanation.runner_up, _RUNNER_UP))
        if one is not None
    ]
    height = 0.8 / max(len(shown), 1)
    names: list[str] = []
    for k, (one, colour) in enumerate(shown):
        names = list(one.terms)
        place = np.arange(len(names)) + (k - (len(shown) - 1) / 2) * height
        label = f"{one.label}: {one.total:.2f}"
        axes.barh(place, list(one.terms.values()), height, color=colour, label=label)
    axes.set_yticks(range(len(names)), names, fontsize=SMALL, color=INK)
    axes.invert_yaxis()
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.tick_params(labelsize=SMALL)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(f"why {explanation.detection} is {_name(explanation)}", fontsize=SMALL)
    axes.set_xlabel("cost", fontsize=SMALL)
    if shown:
        axes.legend(frameon=False, fontsize=SMALL)


def _name(explanation: Explanation) -> str:
    return "none of the labels" if explanation.given is None else explanation.given.label
