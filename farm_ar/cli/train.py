"""`farm-ar train`: an adversary, or a helper, learns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from farm_ar.cli.options import whole

GOING_ON = ("run", "resume", "steps", "progress", "trust")
"""The options that a run that goes on may be given; the others are its own already."""


def train(
    context: typer.Context,
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of the run, as in runs/first.")],
    algo: Annotated[
        str, typer.Option(metavar="NAME", help="maskable-ppo, ppo, or sac for continuous actions.")
    ] = "maskable-ppo",
    env: Annotated[str, typer.Option(metavar="ID", help="The environment.")] = "FarmToTable-v0",
    arg: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="An argument of the environment, as in jitter=easy."),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            parser=whole(1),
            help="Steps in all, rounded up to whole rollouts; the recipe's, or the run's, by default.",
        ),
    ] = None,
    imitate: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole(0), help="Imitate a planner in the first N of them."),
    ] = None,
    rehearse: Annotated[
        int | None,
        typer.Option(
            metavar="N", parser=whole(0), help="Then N steps of PPO in the surrogate environment; 0 for none."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(metavar="N", parser=whole(0, 2**32 - 1), help="Seed of everything.")
    ] = 0,
    recipe: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML of hyperparameters, keyed by environment id.")
    ] = None,
    eval_every: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Steps between evaluations.")
    ] = 10_000,
    eval_episodes: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Episodes of each.")] = 50,
    threads: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Threads of the network.")] = 1,
    processes: Annotated[
        bool, typer.Option("--processes", help="A process for each environment, in place of one for all.")
    ] = False,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume", help="Go on with the run in the folder, with its own options but for --steps."
        ),
    ] = False,
    trust: Annotated[
        bool,
        typer.Option("--trust", help="Run code that the folder names or holds (modules, pickles)."),
    ] = False,
    progress: Annotated[
        bool, typer.Option("--progress/--no-progress", help="Whether to show a bar, or lines.")
    ] = True,
) -> None:
    """Train a policy for an environment with Stable-Baselines3.

    With --arg sign=-1 it is a helper. The folder holds the model, its checkpoints, the learning curve (also
    for TensorBoard), and all that is needed to repeat the run. A run that was killed goes on with --resume.
    """
    import shlex

    from farm_ar.agents.packages import need_training
    from farm_ar.cli.output import print_line
    from farm_ar.cli.places import make_folder
    from farm_ar.cli.trust import code_of, require_trust
    from farm_ar.errors import OptionError, known_name

    known_name("--algo", algo, ("maskable-ppo", "ppo", "sac"))
    need_training()
    from farm_ar.agents.training.recipes import load_recipe
    from farm_ar.agents.training.run_folder import BEST, Run, RunFolder
    from farm_ar.agents.training.training import check
    from farm_ar.agents.training.training import train as learn

    if resume and not (run / "run.json").exists():
        raise OptionError("--resume", "must have a run to go on with in the folder", str(run))
    if resume:
        refuse_others(context)
        require_trust(str(run), code_of(str(run), "last"), trust)
    given = load_recipe(algo, env, recipe).with_arguments(arguments(arg or []), steps, imitate, rehearse)
    asked = Run(algo, env, seed, given, threads, processes, eval_every, eval_episodes)
    if not resume:
        check(asked)  # before a folder is made
    make_folder("RUN", run)
    try:
        model = learn(asked, run, resume, progress, steps, trust)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"Go on with: farm-ar train {shlex.quote(str(run))} --resume") from None
    which = "" if RunFolder(run).kept(BEST) else " --which last"
    print_line(f"{model.num_timesteps} steps are done. Look at it: farm-ar watch {run}{which}")


def refuse_others(context: typer.Context) -> None:
    """See that nothing is asked of a run that goes on which it would not heed.

    Raises:
        OptionError: an option is given that the run has already.
    """
    from farm_ar.errors import OptionError

    for name, value in context.params.items():
        source = context.get_parameter_source(name)
        if name not in GOING_ON and source is not None and source.name == "COMMANDLINE":
            expected = "must be left out with --resume, as the run's own counts"
            raise OptionError(f"--{name.replace('_', '-')}", expected, value)


def arguments(given: list[str]) -> dict[str, Any]:
    """The environment's arguments, their values read as JSON where they are JSON.

    Raises:
        OptionError: there is no = in one.
    """
    import json

    from farm_ar.errors import OptionError

    values: dict[str, Any] = {}
    for text in given:
        name, sign, value = text.partition("=")
        if not sign:
            raise OptionError("--arg", "must be NAME=VALUE", text)
        try:
            values[name] = json.loads(value)
        except ValueError:
            values[name] = value
    return values
