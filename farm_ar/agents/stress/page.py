"""The stress test as one HTML page that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

import numpy as np

from farm_ar import __version__
from farm_ar.agents.certificates import NO_BOUND
from farm_ar.agents.stress.charts import COLOURS, line_chart
from farm_ar.agents.stress.pictures import failure_picture
from farm_ar.agents.stress.rule_part import curve, reach_of, rule_part
from farm_ar.agents.stress.study import Study
from farm_ar.agents.stress.style import STYLE
from farm_ar.agents.stress.summary import Summary
from farm_ar.agents.stress.units import known_case
from farm_ar.agents.stress.wording import in_metres, number, ratio, section, share, table
from farm_ar.envs.generator import scene_of
from farm_ar.scenes import Scene


def page_of(study: Study, summary: Summary) -> str:
    """The whole page."""
    scene = scene_of(study.options.scene, game=False)
    many = len(summary.rules) > 1
    parts = [_head(study, scene), _cards(summary, scene)]
    parts.append(section("In short", _rules_table(summary, scene)))
    parts.append(section("What it comes to", _harm_table(summary)))
    if many:
        parts.append(section("Side by side", _comparison(study, summary)))
        parts.append(section("Transfer", _transfer(summary)))
    for rule in summary.rules:
        parts.append(rule_part(study, rule, scene, many))
    parts.append(section("Failures to look at", _gallery(study, summary)))
    parts.append(section("How to read this", _explanation()))
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
            ]
        )
    head = [
        "re-identifier", "median least perturbation", "as a way", "certified", "by T1 alone",
"found / certified", "cases that failed", "fails in everyday disorder",
    ]  # fmt: skip
    return table(head, rows)


def _harm_table(summary: Summary) -> str:
    rows = [
        [
            rule.reid,
            number(rule.endpoint_error_m),
            "–" if rule.miscounts is None else f"{rule.miscounts:.1f}",
            "–" if rule.by_hand is None else share(rule.by_hand),
            number(rule.by_hand_median),
            number(rule.most_wrong_labels),
            number(rule.most_wrong_effort),
        ]
        for rule in summary.rules
    ]
    head = [
        "re-identifier", "endpoint error, m", "miscounted animals", "carried out by the hand",
        "median effort by the hand", "most labels wrong", "median effort of that",
    ]  # fmt: skip
    return table(head, rows)


def _comparison(study: Study, summary: Summary) -> str:
    lines, reach = [], reach_of(study, summary)
    for rule, colour in zip(summary.rules, COLOURS, strict=False):
        lines.append(curve(reach, rule.reid, rule.best.least, colour))
        if rule.theorem != NO_BOUND:
            lines.append(curve(reach, f"{rule.reid}, certified", rule.bounds, colour, "5 4"))
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
        f"{escape(row['attack'])}: {facts}{_hand(failure)}"
        f"<code>farm-ar stress-replay stress.json {number_of}</code></figcaption></figure>"
    )


def _hand(failure: Mapping[str, Any]) -> str:
    if "by_hand" not in failure:
        return ""
    effort = failure["by_hand"]
    return " · not by the hand" if effort is None else f" · by the hand {effort:.3f}"


EXPLANATION = """
<p><b>Effort</b> is D(q, p) = |q − p| / l + sin(|turn| / 2), summed over the objects that were moved: l is the
room's diagonal, so that 0.1 is a tenth of it, or a turn of 11.5°. A <b>failure</b> is a layout, with nothing
outside the room and nothing in anything else, whose snapshot has a wrong label. The <b>least
perturbation</b> of a case is the effort of the cheapest failure found. The <b>certified</b> effort is proven:
no displacement of whatever objects with less makes any label wrong. Intervals are exact binomial ones at
95%.</p>
<p><b>Endpoint error</b> is from where labels are believed to be to where their own objects are, summed, and
<b>miscounted animals</b> did not get into the building of their colour in the eight seconds after it: both
of the cheapest failures.</p>
<p><b>Carried out by the hand</b>: how many of the cheapest failures the game's hand can bring about, in one
visit with the moves and the budget of FarmToTable-v0, by gripping what is in view, dragging it and pushing
what is in the way; and the median effort of that, pushed objects included. <b>Most labels wrong</b>: of each
case's failure with most wrong labels within the budget, the median number and effort.</p>
<p><b>Everyday disorder</b> is normal noise (SD 5 cm on the farm's table, larger in larger rooms, and 15°) on
all objects. <b>Relative likelihood</b> is that of a failure under such noise, against nothing having
moved.</p>
"""


def _explanation() -> str:
    files = "Numbers for programs: stress.json, stress.csv; measured times: stress-times.csv."
    return f"{EXPLANATION}<p>farm-ar {escape(__version__)}. {files}</p>"
