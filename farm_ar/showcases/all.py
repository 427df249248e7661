"""The showcases by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from farm_ar.errors import known_name
from farm_ar.showcases.characters import show_characters
from farm_ar.showcases.delivery import film_delivery, show_deliveries
from farm_ar.showcases.doubt import show_doubt
from farm_ar.showcases.live import show_live
from farm_ar.showcases.result import Report, Shown
from farm_ar.showcases.shadows import show_shadows
from farm_ar.showcases.storytelling import film_story, show_stories, story_of

FILMED_LAYOUT, FILMED_STORY = 6, 14
"""With the seed 0, a delivery in which the methods filmed disagree, and a story with much to see."""


def _delivery(out: Path, layouts: int, seed: int, film: bool, report: Report) -> Shown:
    shown = show_deliveries(out, layouts, seed, report)
    for method in ("spatial", "likelihood") if film else ():
        trial, paths = film_delivery(out, method, seed, FILMED_LAYOUT)
        said = "right" if trial.right else "wrong" if trial.wrong else "no"
        shown.notes.append(f"Filmed: {method} in layout {FILMED_LAYOUT}, {said} chair.")
        shown.paths += paths
    return shown


def _storytelling(out: Path, layouts: int, seed: int, film: bool, report: Report) -> Shown:
    shown = show_stories(out, layouts, seed, report)
    if film:
        report("Filming a story", 0.9)
        shown.paths += film_story(out, story_of(seed, FILMED_STORY), "adaptive", 0.0, "storytelling")
    return shown


Show = Callable[[Path, int, int, bool, Report], Shown]

_SHOWS: dict[str, Show] = {
    "delivery": _delivery,
    "storytelling": _storytelling,
    "live": show_live,
    "characters": show_characters,
    "shadows": show_shadows,
    "doubt": show_doubt,
}


def show(name: str, out: Path, layouts: int, seed: int, film: bool, report: Report) -> Shown:
    """Run a showcase.

    Args:
        name: which.
        out: the folder for its files.
        layouts: how many layouts it tries.
        seed: of all randomness.
        film: whether films are made.
        report: called from time to time with the current task and the share of it that is done.

    Raises:
        OptionError: there is none of that name.
    """
    return _SHOWS[known_name("name", name, _SHOWS)](out, layouts, seed, film, report)
