"""`farm-ar replay`: whether an episode plays again to the same state."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

DIFFERENT = 1
"""Exit code where the episode does not play again as it was."""


def replay(
    trace: Annotated[
        Path, typer.Argument(metavar="TRACE", help="A JSON file of what an environment's trace() gave.")
    ],
) -> None:
    """Play a trace of an environment again, and compare.

    The exit code is 0 where the episode is bit-exact, 1 where it differs.
    """
    from farm_ar.cli.output import print_line
    from farm_ar.envs import first_difference, load_trace

    episode = load_trace(trace)
    steps = len(episode["actions"])
    difference = first_difference(episode)
    if difference is not None:
        print_line(f"differs from step {difference} on (of {steps})")
        raise typer.Exit(DIFFERENT)
    print_line(f"{steps} {'step' if steps == 1 else 'steps'}, bit-exact")
