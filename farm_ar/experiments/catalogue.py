"""Every table and figure of the paper by its number: what gives it here, or why nothing does."""

from __future__ import annotations

import re

from farm_ar.errors import OptionError

SHOWN_BY = {
    "fig4": "table1",
    "fig6": "fig7",
    "fig8": "table3",
    **dict.fromkeys(("fig24", "fig25"), "fig13"),
    **dict.fromkeys(("fig10", "fig11", "fig12", "fig23"), "table4"),
}
"""Figures that are part of an experiment of another name."""

ELSEWHERE = {
    "fig2": "Fig. 2 (labels stay with the buildings after a move) is simulated: farm-ar demo demonstration-1",
    "fig16": "Fig. 16 (the game's table and its sites) is the scene `farm`: farm-ar scenes show farm",
    "fig17": "Fig. 17 (play facing S1) is simulated: farm-ar demo demonstration-1",
    "fig18": "Fig. 18 (play facing S4) is simulated: farm-ar demo demonstration-2",
    "fig19": "Fig. 19 (characters stay on their chairs) is simulated: farm-ar showcase storytelling",
    "fig21": "Fig. 21 (the robot reaches its chair) is simulated: farm-ar showcase delivery",
    "fig20": "Fig. 20 (the lab and its seven chairs) is the scene `lab`, rebuilt: farm-ar scenes show lab",
}
"""Figures that another command gives, and which."""

NOT_GIVEN = {
    "fig1": "it shows screenshots of commercial games",
    "fig3": "it is a diagram of the method, without a measurement",
    "fig15": "it is a screenshot of another game",
    "fig22": "it is a diagram of the authors' pose estimation, made of their photographs",
    "fig26": "it is a diagram of the robot's programme, without a measurement",
}
"""Figures that nothing here gives, and why."""


def numbered(what: str) -> str:
    """The plain name of a table or figure: `fig17` of "Figure 17" and "Fig. 17b"; anything else as it is."""
    found = re.fullmatch(r"(table|fig)(?:ure)?\.?\s*(\d+)[a-z]?", what.strip().lower())
    return what if found is None else found[1] + found[2]


def elsewhere(what: str) -> str | None:
    """One line on the command that gives a figure; None where it is an experiment, or nothing gives it."""
    return ELSEWHERE.get(numbered(what))


def experiment_of(what: str) -> str:
    """The name of the experiment that gives a table or figure; anything else as it is.

    Raises:
        OptionError: no experiment gives it; says what does, or why nothing can.
    """
    name = numbered(what)
    if name in NOT_GIVEN:
        raise OptionError("what", f"must be another: it cannot be reproduced, since {NOT_GIVEN[name]}", what)
    if name in ELSEWHERE:
        raise OptionError("what", f"must be an experiment: {ELSEWHERE[name]}", what)
    return SHOWN_BY.get(name, name)
