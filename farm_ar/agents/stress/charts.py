"""Charts as SVG text: lines, cells, bars; nothing but the numbers and a few strokes."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

COLOURS = ("#2563eb", "#d97706", "#059669", "#db2777", "#7c3aed", "#0891b2", "#65a30d", "#475569", "#111827")
"""Of the lines, in turn; the last for the best of all attacks."""

INK, FAINT, GRID = "#1f2937", "#6b7280", "#e5e7eb"
LEFT, RIGHT, TOP, BOTTOM = 52.0, 16.0, 14.0, 42.0


class Line(NamedTuple):
    """A line of a chart: its name, points, colour and dashes ("" for none)."""

    name: str
    x: Sequence[float]
    y: Sequence[float]
    colour: str
    dash: str = ""


def line_chart(
    lines: Sequence[Line],
    x_label: str,
    y_label: str,
    x_limit: float,
    y_limit: float = 1.0,
    size: tuple[float, float] = (480.0, 300.0),
) -> str:
    """Lines over a grid, with a legend; both axes begin at 0."""
    width, height = size
    across, up = width - LEFT - RIGHT, height - TOP - BOTTOM
    x_limit, y_limit = x_limit or 1.0, y_limit or 1.0  # a rule may fail with no effort at all

    def place(x: float, y: float) -> str:
        return f"{LEFT + across * x / x_limit:.1f},{TOP + up * (1 - y / y_limit):.1f}"

    parts = [_frame(size, x_label, y_label, x_limit, y_limit)]
    for line in lines:
        shown = [(x, y) for x, y in zip(line.x, line.y, strict=True) if x <= x_limit and np.isfinite(y)]
        points = " ".join(place(x, y) for x, y in shown)
        dash = f' stroke-dasharray="{line.dash}"' if line.dash else ""
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{line.colour}" stroke-width="2"{dash}/>'
        )
    return _svg(size, "".join(parts)) + legend([(line.name, line.colour, line.dash) for line in lines])


def bar_chart(
    values: Sequence[float], counts: Sequence[float], x_label: str, y_label: str, size: tuple[float, float]
) -> str:
    """Bars of equal width from 0 to 1 with the diagonal; NaN leaves a gap. Their strength is their count."""
    width, height = size
    across, up = width - LEFT - RIGHT, height - TOP - BOTTOM
    parts = [_frame(size, x_label, y_label, 1.0, 1.0)]
    most = max([*counts, 1.0])
    for k, (value, count) in enumerate(zip(values, counts, strict=True)):
        if np.isfinite(value):
            x, w = LEFT + across * k / len(values), across / len(values) - 2
            opacity = 0.25 + 0.75 * (count / most) ** 0.5
            parts.append(
                f'<rect x="{x + 1:.1f}" y="{TOP + up * (1 - value):.1f}" width="{w:.1f}" '
                f'height="{max(up * value, 1.0):.1f}" fill="{COLOURS[0]}" fill-opacity="{opacity:.2f}">'
                f"<title>{value:.2f} right of {count:.0f}</title></rect>"
            )
    ends = f'x1="{LEFT}" y1="{TOP + up}" x2="{LEFT + across}" y2="{TOP}"'
    parts.append(f'<line {ends} stroke="{FAINT}" stroke-dasharray="4 4"/>')
    return _svg(size, "".join(parts))


def cell_chart(
    cells: Sequence[Sequence[float]], x_label: str, y_label: str, x_limit: float, size: tuple[float, float]
) -> str:
    """Cells coloured by the logarithm of their numbers; a row per value of y from 1, the last "and more"."""
    width, height = size
    across, up = width - LEFT - RIGHT, height - TOP - BOTTOM
    whole = np.asarray(cells, dtype=np.float64)
    used = max(int(np.flatnonzero(whole.any(axis=1)).max(initial=0)) + 1, 4)
    table = whole[:used]
    rows, columns = table.shape
    strength = np.log1p(table) / max(float(np.log1p(table).max()), 1e-9)
    parts = []
    for r in range(rows):
        y = TOP + up * (rows - 1 - r) / rows
        label = f"{r + 1}+" if r == len(whole) - 1 else str(r + 1)
        parts.append(_text(LEFT - 6, y + up / rows / 2 + 3.5, label, "end", 10))
        for c in range(columns):
            if table[r, c] > 0:
                parts.append(
                    f'<rect x="{LEFT + across * c / columns:.1f}" y="{y:.1f}" '
                    f'width="{across / columns - 1:.1f}" height="{up / rows - 1:.1f}" fill="#b91c1c" '
                    f'fill-opacity="{0.08 + 0.92 * strength[r, c]:.2f}">'
                    f"<title>{table[r, c]:.0f} failures</title></rect>"
                )
    for k in range(6):
        x = LEFT + across * k / 5
        parts.append(_text(x, TOP + up + 16, f"{x_limit * k / 5:.2g}", "middle", 11))
    parts.append(f'<rect x="{LEFT}" y="{TOP}" width="{across}" height="{up}" fill="none" stroke="{GRID}"/>')
    return _svg(size, "".join(parts) + _axis_names(size, x_label, y_label))


def legend(entries: Sequence[tuple[str, str, str]]) -> str:
    """Names beside their strokes, as HTML."""
    items = []
    for name, colour, dash in entries:
        pattern = f' stroke-dasharray="{dash}"' if dash else ""
        stroke = f'<line x1="0" y1="5" x2="22" y2="5" stroke="{colour}" stroke-width="3"{pattern}/>'
        items.append(f'<span><svg width="22" height="10">{stroke}</svg> {escape(name)}</span>')
    return f'<div class="legend">{"".join(items)}</div>'


def _frame(size: tuple[float, float], x_label: str, y_label: str, x_limit: float, y_limit: float) -> str:
    width, height = size
    across, up = width - LEFT - RIGHT, height - TOP - BOTTOM
    parts = []
    for k in range(6):
        x, y = LEFT + across * k / 5, TOP + up * (1 - k / 5)
        parts.append(f'<line x1="{LEFT}" y1="{y:.1f}" x2="{LEFT + across}" y2="{y:.1f}" stroke="{GRID}"/>')
        parts.append(_text(LEFT - 6, y + 4, f"{y_limit * k / 5:.2g}", "end", 11))
        parts.append(_text(x, TOP + up + 16, f"{x_limit * k / 5:.2g}", "middle", 11))
    return "".join(parts) + _axis_names(size, x_label, y_label)


def _axis_names(size: tuple[float, float], x_label: str, y_label: str) -> str:
    width, height = size
    middle = TOP + (height - TOP - BOTTOM) / 2
    across = _text(LEFT + (width - LEFT - RIGHT) / 2, height - 6, x_label, "middle", 12)
    turned = f'<g transform="translate(13 {middle}) rotate(-90)">{_text(0, 0, y_label, "middle", 12)}</g>'
    return across + turned


def _text(x: float, y: float, text: str, anchor: str, size: float, colour: str = FAINT) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" fill="{colour}">'
        f"{escape(text)}</text>"
    )


def _svg(size: tuple[float, float], content: str) -> str:
    width, height = size
    return (
        f'<svg class="chart" viewBox="0 0 {width:g} {height:g}" width="{width:g}" role="img" '
        f'xmlns="http://www.w3.org/2000/svg">{content}</svg>'
    )
