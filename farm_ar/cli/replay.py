"""`farm-ar replay`: whether an episode plays again to the same state."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

DIFFERENT = 1
"""Exit code where the episode does not play again as it was."""


def replay(
    trace: Annotated[
        Path, typer.Argument(metavar="TRACE", help="A JSON file that an environment's trace() returned.")
    ],
) -> None:
    """Replay a trace of an environment, and compare the states.

    The exit code is 0 where the episode is bit-exact, 1 where it differs.
    """
    from gymnasium.error import InvalidAction, ResetNeeded

    from farm_ar.cli.output import print_line
    from farm_ar.envs import TraceError, first_difference, load_trace

    episode = load_trace(trace)
    steps = len(episode["actions"])
    _check_arguments(episode, trace.name)
    try:
        difference = first_difference(episode)
    except (InvalidAction, ResetNeeded) as problem:
        expected = "must be actions of an episode with these arguments"
        raise TraceError("actions", expected, str(problem), trace.name) from None
    if difference is not None:
        print_line(f"differs from step {difference} on (of {steps})")
        raise typer.Exit(DIFFERENT)
    print_line(f"{steps} {'step' if steps == 1 else 'steps'}, bit-exact")


def _check_arguments(trace: Mapping[str, Any], source: str) -> None:
    """See that the episode's arguments are an environment's, and raise a `TraceError` if not."""
    import inspect

    from farm_ar.envs import FarmToTableEnv, TraceError

    known = inspect.signature(FarmToTableEnv).parameters
    for name in trace["arguments"]:
        if name not in known:
            raise TraceError("arguments", f"must be among {', '.join(known)}", name, source)
