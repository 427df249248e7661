"""Stories in many rearranged labs, by method."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from farm_ar.geometry import wrap
from farm_ar.showcases.result import Report, Row, Shown, column, percent, points
from farm_ar.showcases.storytelling.story import CHARACTERS, METHODS, Story, outcome_of, seats_of

LEAST = 0.8
"""Confidence below which a character waits, where waiting is allowed."""


def story_of(seed: int, layout: int) -> Story:
    """A lab rearranged at random; the same for every method."""
    return Story.random(np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(layout,))))


def tell(story: Story, layout: int, method: str, least: float) -> Row:
    """One story by one method: what becomes of the characters.

    Args:
        story: the lab and the snapshot.
        layout: its number.
        method: one of `METHODS`.
        least: confidence below which a character waits.

    Returns:
        A row: each character's outcome; how far seats are from their own chairs, metres and degrees.
    """
    seats = seats_of(story, method, least)
    outcomes = outcome_of(story, seats)
    metres, degrees = 0.0, 0.0
    for label, seat, outcome in zip(CHARACTERS, seats, outcomes, strict=True):
        if outcome == "own" and seat.place is not None:
            i = story.moved.index(label)
            metres = max(metres, float(np.linalg.norm(story.moved.position[i] - seat.place)))
            degrees = max(degrees, float(np.rad2deg(np.abs(wrap(story.moved.yaw[i] - seat.yaw)))))
    wrong = any(one in ("other", "air") for one in outcomes)
    return {
        "layout": layout,
        "method": method + (f", waits below {LEAST:.0%}" if least else ""),
        **{f"on {label}": one for label, one in zip(CHARACTERS, outcomes, strict=True)},
        "right": all(one == "own" for one in outcomes),
        "other": any(one == "other" for one in outcomes),
        "air": any(one == "air" for one in outcomes),
        "waits": not wrong and "waits" in outcomes,
        "metres": round(metres, 4),
        "degrees": round(degrees, 2),
    }


def show_stories(
    out: Path, layouts: int, seed: int, report: Report, methods: Sequence[str] = METHODS
) -> Shown:
    """Play the story in many layouts with every method, and sum up."""
    asked = [(method, 0.0) for method in methods]
    asked += [(method, LEAST) for method in methods if method in ("likelihood", "adaptive")]
    trials: list[Row] = []
    for i in range(layouts):
        story = story_of(seed, i)
        trials += [tell(story, i, *one) for one in asked]
        report("Playing the stories", (i + 1) / layouts)
    names = list(dict.fromkeys(trial["method"] for trial in trials))
    rows = {name: [trial for trial in trials if trial["method"] == name] for name in names}
    shown = Shown(f"Two characters on chairs 1 and 2 after {layouts} rearrangements of the lab")
    shown.rows = [_summary(name, of, rows.get("spatial")) for name, of in rows.items()]
    shown.notes = [
        "The viewer sees both chairs in every layout.",
        "A character whose label no chair was given stands up and waits.",
    ]
    shown.write(out, "storytelling", trials)
    return shown


def _summary(name: str, trials: list[Row], paper: list[Row] | None) -> Row:
    right = column(trials, "right")
    own = [trial for trial in trials if trial["metres"] > 0]
    return {
        "method": name,
        "both on their own chairs": percent(right),
        "one on a stranger's": percent(column(trials, "other")),
        "one in the air": percent(column(trials, "air")),
        "waits": percent(column(trials, "waits")),
        "right less spatial's": points(right, column(paper, "right")) if paper and paper != trials else "",
        "seat, 90th percentile": _exact(own),
    }


def _exact(own: list[Row]) -> str:
    """How far seats are from their own chairs."""
    if not own:
        return ""
    metres, degrees = (np.quantile(column(own, name), 0.9) for name in ("metres", "degrees"))
    return f"{100 * metres:.1f} cm, {degrees:.1f}°"
