"""What the page of a stress test says of one re-identifier."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.charts import COLOURS, Line, bar_chart, cell_chart, line_chart
from farm_ar.agents.stress.pictures import cameras_picture
from farm_ar.agents.stress.statistics import broken_within
from farm_ar.agents.stress.study import Study
from farm_ar.agents.stress.summary import AttackSummary, RuleSummary, Summary
from farm_ar.agents.stress.wording import number, ratio, section, share, table
from farm_ar.scenes import Scene

POINTS = 201
"""Points of a curve."""

WEAKEST = 8
"""Cameras and labels that the tables name."""


def rule_part(study: Study, rule: RuleSummary, scene: Scene, many: bool) -> str:
    """What the page says of one re-identifier.

    Args:
        study: the stress test.
        rule: its numbers of the re-identifier.
        scene: the room.
        many: whether there are others beside it.
    """
    prefix = f"{rule.reid}: " if many else ""
    reach = reach_of(study, Summary((rule,), ()))
    colours = [*COLOURS[: len(rule.attacks) - 1], COLOURS[-1]]
    shown = rule.attacks if len(rule.attacks) > 2 else rule.attacks[:1]
    lines = [curve(reach, one.attack, one.least, colour) for one, colour in zip(shown, colours, strict=False)]
    if rule.theorem != NO_BOUND:
        lines.append(curve(reach, "certified", rule.bounds, "#dc2626", "5 4"))
    chart = line_chart(lines, "effort", "share of cases broken", reach)
    both = f'<div class="row"><div>{chart}</div><div>{_attacks_table(rule)}</div></div>'
    parts = [section(f"{prefix}success against effort", both)]
    parts.append(section(f"{prefix}kinds of failures", _cells(study, rule)))
    parts.append(section(f"{prefix}how sure it is of itself", _calibration(rule)))
    parts.append(section(f"{prefix}where it is weak", _weak(study, rule, scene)))
    return "".join(parts)


def curve(reach: float, name: str, least: Sequence[float | None], colour: str, dash: str = "") -> Line:
    """The share of the cases that fail within each effort, up to `reach`."""
    efforts = np.linspace(0, reach, POINTS)
    return Line(name, efforts.tolist(), broken_within(least, efforts).tolist(), colour, dash)


def _attacks_table(rule: RuleSummary) -> str:
    def row(one: AttackSummary) -> list[str]:
        return [
            one.attack,
            number(one.median),
            share(one.failed),
            ratio(one.tightness) if rule.theorem != NO_BOUND else "–",
        ]

    head = ["attack", "median least", "failed", "found / certified"]
    shown = rule.attacks if len(rule.attacks) > 2 else rule.attacks[:1]
    return table(head, [row(one) for one in shown])


def _cells(study: Study, rule: RuleSummary) -> str:
    total = np.zeros((1, 1))
    for row in study.attacked:
        if row["reid"] == rule.reid:
            total = total + np.array(row["cells"])
    chart = cell_chart(total.tolist(), "effort", "wrong labels", study.options.budget, (560.0, 300.0))
    return chart + "<p>All failures that the attacks met, by effort and by how many labels were wrong.</p>"


def _calibration(rule: RuleSummary) -> str:
    if not rule.calibration.answers.sum():
        return "<p>The rule does not say how sure it is.</p>"
    size = (280.0, 240.0)
    charts = []
    for title, one in (
        ("everyday disorder", rule.calibration),
        ("cheapest failures", rule.calibration_attacked),
    ):
        chart = bar_chart(one.right.tolist(), one.answers.tolist(), "confidence", "share right", size)
        charts.append(
            f"<figure>{chart}<figcaption>{title}: calibration error {number(one.error)}, "
            f"{one.answers.sum():.0f} answers</figcaption></figure>"
        )
    return f'<div class="row">{"".join(charts)}</div>'


def _weak(study: Study, rule: RuleSummary, scene: Scene) -> str:
    certified = rule.theorem != NO_BOUND
    labels = [
        [label, str(misread), str(seen), number(bound) if certified else "–"]
        for label, misread, seen, bound in rule.labels[:WEAKEST]
    ]
    cameras = [
        [
            str(case), f"{x:.2f}, {z:.2f}", f"{np.rad2deg(yaw) + 0.0:.0f}°", number(effort),
            number(bound) if certified else "–", _most(rule.most_wrong[case]),
        ]
        for case, (x, z, yaw), effort, bound in rule.cases[:WEAKEST]
    ]  # fmt: skip
    head = ["case", "camera at, m", "heading", "least", "certified", "most labels wrong at effort"]
    efforts = [study.options.budget if effort is None else effort for _, _, effort, _ in rule.cases]
    low, high = min(efforts), max(max(efforts), min(efforts) + 1e-9)
    strength = [(effort - low) / (high - low) for effort in efforts]
    picture = cameras_picture(scene, [camera for _, camera, _, _ in rule.cases], strength)
    return (
        f'<div class="row"><div>{table(["label", "misread", "cases in view", "certified"], labels)}'
        f"{table(head, cameras)}</div>"
        f"<figure>{picture}<figcaption>Cameras, red where the least effort was small</figcaption></figure>"
        f"</div>"
    )


def _most(worst: tuple[int, float] | None) -> str:
    return "none" if worst is None else f"{worst[0]} at {number(worst[1])}"


def reach_of(study: Study, summary: Summary) -> float:
    """How far a curve of efforts need go: to where little happens any more, a round number."""
    values = [v for rule in summary.rules for v in (*rule.best.least, *rule.bounds) if v is not None]
    top = max(values, default=study.options.budget) * 1.1
    step = 10.0 ** np.floor(np.log10(max(top, 1e-6))) / 2
    return float(min(study.options.budget, np.ceil(top / step) * step))
