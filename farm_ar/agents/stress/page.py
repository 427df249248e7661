"""The stress test as one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from farm_ar import __version__
from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.charts import COLOURS, Line, bar_chart, cell_chart, line_chart
from farm_ar.agents.stress.pictures import cameras_picture, failure_picture
from farm_ar.agents.stress.statistics import Share, broken_within
from farm_ar.agents.stress.study import Study
from farm_ar.agents.stress.style import STYLE
from farm_ar.agents.stress.summary import AttackSummary, RuleSummary, Summary
from farm_ar.agents.stress.units import known_case
from farm_ar.envs.starting import scene_of
from farm_ar.scenes import Scene

POINTS = 201
"""Points of a curve."""

WEAKEST = 8
"""Cameras and labels that the tables name."""


def page_of(study: Study, summary: Summary) -> str:
    """The whole page."""
    scene = scene_of(study.options.scene, game=False)
    many = len(summary.rules) > 1
    parts = [_head(study, scene), _cards(summary, scene)]
    parts.append(_section("In short", _rules_table(summary, scene)))
    if many:
        parts.append(_section("Side by side", _comparison(study, summary)))
        parts.append(_section("Transfer", _transfer(summary)))
    for rule in summary.rules:
        parts.append(_rule_part(study, rule, scene, many))
    parts.append(_section("Failures to look at", _gallery(study, summary)))
    parts.append(_section("How to read this", _explanation()))
    body = "\n".join(parts)
    title = f"Stress test of {', '.join(study.options.reids)} on {study.options.scene}"
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n{body}\n</main>\n"
        f"</body>\n</html>\n"
    )


def command_of(study: Study) -> str:
    """The command that makes this report again."""
    o = study.options
    which = f"--reid {o.reids[0]}" if len(o.reids) == 1 else f"--compare {','.join(o.reids)}"
    return (
        f"farm-ar stress --scene {o.scene} {which} --attack {','.join(o.attacks)} --queries {o.queries} "
        f"--cases {o.cases} --budget {o.budget:g} --jitter {o.jitter} --seed {o.seed}"
    )


def _head(study: Study, scene: Scene) -> str:
    o = study.options
    return (
        f"<header><h1>How much does it take to break it?</h1>"
        f"<p>Re-identification by <b>{escape(', '.join(o.reids))}</b> in the scene <b>{escape(o.scene)}</b>: "
        f"{o.cases} layouts and cameras, {o.queries} snapshots per attack and case.</p>"
        f"<pre>{escape(command_of(study))}</pre></header>"
    )


def _cards(summary: Summary, scene: Scene) -> str:
    cards = []
    for rule in summary.rules:
        certified = rule.theorem != NO_BOUND
        bound = f"no attack below {number(rule.bound_median)}" if certified else "no certificate"
        tight = f", known to a factor of {ratio(rule.best.tightness)} ({rule.theorem})" if certified else ""
        cards.append(
            f'<div class="card"><div class="name">{escape(rule.reid)}</div>'
            f'<div class="big">{number(rule.best.median)}</div>'
            f'<div class="what">median least perturbation<br>{in_metres(rule.best.median, scene)}</div>'
            f'<div class="note">{bound}{tight}</div></div>'
        )
    return f'<div class="cards">{"".join(cards)}</div>'


def _rules_table(summary: Summary, scene: Scene) -> str:
    rows = []
    for rule in summary.rules:
        certified = rule.theorem != NO_BOUND
        rows.append(
            [
                rule.reid,
                number(rule.best.median),
                in_metres(rule.best.median, scene),
                number(rule.bound_median) if certified else "none",
                number(rule.bound_t1) if certified else "none",
                ratio(rule.best.tightness) if certified else "–",
                share(rule.best.failed),
                share(rule.noise),
                number(rule.endpoint_error_m),
                "–" if rule.miscounts is None else f"{rule.miscounts:.1f}",
            ]
        )
    head = [
        "re-identifier", "median least perturbation", "as a way", "certified", "by T1 alone",
        "found / certified", "cases that failed", "fails in everyday disorder", "endpoint error, m",
        "miscounted animals",
    ]  # fmt: skip
    return table(head, rows)


def _comparison(study: Study, summary: Summary) -> str:
    lines, reach = [], _reach(study, summary)
    for rule, colour in zip(summary.rules, COLOURS, strict=False):
        lines.append(_curve(reach, rule.reid, rule.best.least, colour))
        if rule.theorem != NO_BOUND:
            lines.append(_curve(reach, f"{rule.reid}, certified", rule.bounds, colour, "5 4"))
    chart = line_chart(lines, "effort", "share of cases broken", reach)
    return (
        chart
        + "<p>Solid: what the attacks reach. Dashed: what no attack can exceed, where a theorem says so."
        "</p>"
    )


def _transfer(summary: Summary) -> str:
    names = [rule.reid for rule in summary.rules]
    rows = [[rule.reid, *(share(rule.transfer[name]) for name in names)] for rule in summary.rules]
    text = "The cheapest failures made for the rule on the left, shown to the rule above: how many break it."
    return f"<p>{text}</p>" + table(["made for", *names], rows)


def _rule_part(study: Study, rule: RuleSummary, scene: Scene, many: bool) -> str:
    prefix = f"{rule.reid}: " if many else ""
    reach = _reach(study, Summary((rule,), ()))
    colours = [*COLOURS[: len(rule.attacks) - 1], COLOURS[-1]]
    shown = rule.attacks if len(rule.attacks) > 2 else rule.attacks[:1]
    lines = [
        _curve(reach, one.attack, one.least, colour) for one, colour in zip(shown, colours, strict=False)
    ]
    if rule.theorem != NO_BOUND:
        lines.append(_curve(reach, "certified", rule.bounds, "#dc2626", "5 4"))
    curve = line_chart(lines, "effort", "share of cases broken", reach)
    both = f'<div class="row"><div>{curve}</div><div>{_attacks_table(rule)}</div></div>'
    parts = [_section(f"{prefix}success against effort", both)]
    parts.append(_section(f"{prefix}kinds of failures", _cells(study, rule)))
    parts.append(_section(f"{prefix}how sure it is of itself", _calibration(rule)))
    parts.append(_section(f"{prefix}where it is weak", _weak(study, rule, scene)))
    return "".join(parts)


def _curve(reach: float, name: str, least: Sequence[float | None], colour: str, dash: str = "") -> Line:
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
            number(bound) if certified else "–",
        ]
        for case, (x, z, yaw), effort, bound in rule.cases[:WEAKEST]
    ]  # fmt: skip
    efforts = [study.options.budget if effort is None else effort for _, _, effort, _ in rule.cases]
    low, high = min(efforts), max(max(efforts), min(efforts) + 1e-9)
    strength = [(effort - low) / (high - low) for effort in efforts]
    picture = cameras_picture(scene, [camera for _, camera, _, _ in rule.cases], strength)
    return (
        f'<div class="row"><div>{table(["label", "misread", "cases in view", "certified"], labels)}'
        f"{table(['case', 'camera at', 'heading', 'least', 'certified'], cameras)}</div>"
        f"<figure>{picture}<figcaption>Cameras, red where the least effort was small</figcaption></figure>"
        f"</div>"
    )


def _gallery(study: Study, summary: Summary) -> str:
    titles = {
        "cheapest": "Cheapest",
        "worst": "Most labels wrong",
        "likeliest": "Likeliest in everyday disorder",
    }
    groups: dict[tuple[str, str], list[str]] = {}
    for i, (kind, row, failure) in enumerate(summary.failures):
        groups.setdefault((row["reid"], kind), []).append(_failure_card(study, i, row, failure))
    parts = []
    for (reid, kind), cards in groups.items():
        name = f"{reid}: " if len(summary.rules) > 1 else ""
        parts.append(f"<h3>{escape(name + titles[kind])}</h3><div class='gallery'>{''.join(cards)}</div>")
    return "".join(parts) or "<p>Nothing failed.</p>"


def _failure_card(study: Study, number_of: int, row: Mapping[str, Any], failure: Mapping[str, Any]) -> str:
    o = study.options
    case = known_case(o.scene, row["case"], o.jitter, o.seed)
    facts = (
        f"effort {failure['effort']:.3f} (largest {failure['largest']:.3f}) · "
        f"{100 * failure['metres']:.1f} cm · {failure['degrees']:.0f}° · {failure['wrong']} wrong · "
        f"relative likelihood "
        f"{np.exp(-failure['surprise']):.2g}"
    )
    return (
        f'<figure class="failure">{failure_picture(case, failure)}<figcaption>case {row["case"]}, '
        f"{escape(row['attack'])}: {facts}<code>farm-ar stress-replay stress.json {number_of}</code>"
        f"</figcaption></figure>"
    )


EXPLANATION = """
<p><b>Effort</b> is D(q, p) = |q − p| / l + sin(|turn| / 2), summed over the objects that were moved: l is the
room's diagonal, so that 0.1 is a tenth of it, or a turn of 11.5°. A <b>failure</b> is a layout, with nothing
outside the room and nothing in anything else, whose snapshot has a wrong label. The <b>least
perturbation</b> of a case is the effort of the cheapest failure found. The <b>certified</b> effort is proven:
no displacement of whatever objects with less makes any label wrong. Intervals are exact binomial ones at
95%.</p>
<p><b>Everyday disorder</b> is normal noise (SD 5 cm on the farm's table, larger in larger rooms, and 15°) on
all objects. <b>Relative likelihood</b> is that of a failure under such noise, against nothing having
moved.</p>
"""


def _explanation() -> str:
    files = "Numbers for programs: stress.json, stress.csv; measured times: stress-times.csv."
    return f"{EXPLANATION}<p>farm-ar {escape(__version__)}. {files}</p>"


def _reach(study: Study, summary: Summary) -> float:
    """How far a curve of efforts need go: to where little happens any more, a round number."""
    values = [v for rule in summary.rules for v in (*rule.best.least, *rule.bounds) if v is not None]
    top = max(values, default=study.options.budget) * 1.1
    step = 10.0 ** np.floor(np.log10(max(top, 1e-6))) / 2
    return float(min(study.options.budget, np.ceil(top / step) * step))


def _section(title: str, content: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{content}</section>"


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
