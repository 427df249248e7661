"""Numbers and tables as the page and the terminal write them."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from farm_ar.agents.stress.statistics import Share
from farm_ar.scenes import Scene


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as HTML; all but the first column are aligned on the right."""
    top = "".join(f"<th>{escape(name)}</th>" for name in head)
    lines = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>{lines}</tbody></table></div>'


def number(value: float | None) -> str:
    """A number with three digits; an infinite one, or None, as "> budget"; NaN as a dash."""
    if value is None or value == np.inf:
        return "> budget"
    return "–" if not np.isfinite(value) else f"{value:.3g}"


def ratio(value: float) -> str:
    """A factor with two decimals; an infinite one as "> budget"; NaN as a dash."""
    return f"{value:.2f}" if np.isfinite(value) else number(value)


def share(value: Share) -> str:
    """A share with its interval, in per cent."""
    if not np.isfinite(value.value):
        return "–"
    digits = 1 if 0 < min(value.value, 1 - value.value) < 0.05 else 0
    return f"{100 * value.value:.{digits}f}% ({100 * value.low:.{digits}f}–{100 * value.high:.{digits}f})"


def in_metres(effort: float, scene: Scene) -> str:
    """An effort as the way that takes it, without turning."""
    if not np.isfinite(effort):
        return "–"
    metres = effort * scene.diagonal
    return f"{100 * metres:.1f} cm" if metres < 1 else f"{metres:.2f} m"


def section(title: str, content: str) -> str:
    """A part of the page under its title."""
    return f"<section><h2>{escape(title)}</h2>{content}</section>"
