"""`farm-ar plot`: learning curves of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def plot(
    runs: Annotated[list[str], typer.Argument(metavar="RUN...", help="Folders of runs of one environment.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The picture, .svg, .png or .pdf.")] = Path(
        "out/curves.svg"
    ),
    training: Annotated[
        bool, typer.Option("--training", help="Returns during training instead of the evaluations.")
    ] = False,
    title: Annotated[
        str | None, typer.Option(metavar="TEXT", help="Title; by default the environment's id.")
    ] = None,
) -> None:
    """Draw learning curves over seeds, with the returns of reference policies as lines.

    Runs that differ in the seed only are one curve: their mean, the single runs faintly, and the range.
    """
    from farm_ar.agents.packages import need_training
    from farm_ar.cli.options import make_folder, writing
    from farm_ar.cli.output import print_line
    from farm_ar.errors import OptionError

    if out.suffix not in (".svg", ".png", ".pdf"):
        raise OptionError("--out", "must end in .svg, .png or .pdf", str(out))
    need_training()
    from farm_ar.agents.training.curves import curves_of, draw, save
    from farm_ar.agents.training.run_folder import RunFolder

    curves, references = curves_of(runs, "training" if training else "evaluations")
    figure = draw(curves, references, title or RunFolder(Path(runs[0])).read().env)
    make_folder("--out", out.parent)
    with writing("--out", out):
        save(figure, out)
    if not references:
        print_line("No lines of reference policies: their returns hold for an id with its own arguments only")
    for curve in curves:
        last = curve.returns[:, -1]
        print_line(f"{curve.name}: {last.mean():z.2f} after {curve.steps[-1]:.0f} steps, {len(last)} seeds")
    print_line(f"Wrote {out}")
