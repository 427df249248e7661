"""`farm-ar evaluate`: the returns and scores of trained policies beside others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from farm_ar.cli.options import Seed, whole

if TYPE_CHECKING:
    from collections.abc import Mapping

    from farm_ar.agents.training.evaluation import Comparison


def evaluate(
    runs: Annotated[
        list[str],
        typer.Argument(
            metavar="RUN...",
            help="Folders of runs that differ in the seed, or a policy that comes with farm-ar.",
        ),
    ],
    episodes: Annotated[int, typer.Option(metavar="N", parser=whole(2), help="Held-out episodes.")] = 100,
    beside: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Other policies, with commas between: constant, greedy, analytic, cma, and those that come "
            "with farm-ar. Random is always there.",
        ),
    ] = "analytic,greedy",
    which: Annotated[str, typer.Option(metavar="NAME", help="best (by the evaluations) or last.")] = "best",
    arg: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Another argument of the environment.")
    ] = None,
    seed: Seed = 0,
    trust: Annotated[
        bool,
        typer.Option("--trust", help="Run code that the folder names or holds (modules, pickles)."),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Play held-out episodes with trained policies and with others.

    The score is 0 for a random policy and 1 for the best that any of the policies here found in each episode;
    of several runs it is the interquartile mean, with a 95% bootstrap interval.
    """
    from farm_ar.agents.packages import need_training

    need_training()
    from farm_ar.agents.training.evaluation import compare
    from farm_ar.cli.output import print_json, print_line, print_table
    from farm_ar.cli.train import arguments
    from farm_ar.cli.trust import code_of, require_trust

    names = [name.strip() for name in beside.split(",") if name.strip()]
    for run in runs:
        require_trust(run, code_of(run, which), trust)
    found = compare(runs, names, episodes, which, arguments(arg or []), seed, trust)
    if as_json:
        print_json(_as_json(found))
        return
    columns = ("policy", "return", "wrong labels", "effort", "score")
    print_table(columns, [_cells(row) for row in found.rows()], numbers=columns[1:])
    print_line(f"{episodes} held-out episodes; the best found: {found.best.mean():.2f}")


def _cells(row: Mapping[str, Any]) -> list[str]:
    return [
        str(row["player"]),
        f"{row['return']:.2f} ± {row['standard_error']:.2f}",
        f"{row['wrong_labels']:.2f}",
        f"{row['effort']:.2f}",
        str(row["score"]),
    ]


def _as_json(found: Comparison) -> dict[str, Any]:
    rows = [
        {**row, "score": [row["score"].value, row["score"].low, row["score"].high]} for row in found.rows()
    ]
    return {"episodes": len(found.best), "best": float(found.best.mean()), "players": rows}
