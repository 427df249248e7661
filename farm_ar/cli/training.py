"""`farm-ar train`, `evaluate` and `watch`: policies that learn, what they score, and what they do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from farm_ar.cli.options import (
    OWN_CLUSTER,
    Address,
    AsJson,
    EnvironmentArguments,
    Seed,
    Trust,
    Where,
    Which,
    Workers,
    executor_of,
    whole,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from farm_ar.agents.training.evaluation import Comparison
    from farm_ar.agents.training.run_folder import Run
    from farm_ar.sweeps import Executor

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
        typer.Option(metavar="N", parser=whole(0), help="Imitate a planner in the first N steps."),
    ] = None,
    lift: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            parser=whole(0),
            help="Then take N steps in a batch with carry=lift, and the others without.",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(metavar="N", parser=whole(0, 2**32 - 1), help="Seed of all random numbers.")
    ] = 0,
    recipe: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML of hyperparameters, keyed by environment id.")
    ] = None,
    eval_every: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Steps between evaluations.")
    ] = 10_000,
    eval_episodes: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Episodes of each evaluation.")
    ] = 50,
    threads: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Threads for the network.")] = 1,
    processes: Annotated[
        bool, typer.Option("--processes", help="Run each environment in a process of its own.")
    ] = False,
    seeds: Annotated[
        int | None,
        typer.Option(
            metavar="N", parser=whole(1, 1000), help="Train N seeds, from --seed on, in RUN/seed-N."
        ),
    ] = None,
    workers: Workers = 1,
    executor: Where = None,
    address: Address = OWN_CLUSTER,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Continue the run in the folder, with its own options except --steps."),
    ] = False,
    trust: Trust = False,
    progress: Annotated[
        bool, typer.Option("--progress/--no-progress", help="Whether to show the progress.")
    ] = True,
) -> None:
    """Train a policy for an environment with Stable-Baselines3.

    With --arg sign=-1 the policy is a helper. The folder has the model, its checkpoints, the learning curve
    (also for TensorBoard), and all that is needed to repeat the run. --resume continues an interrupted run.
    """
    import shlex

    from farm_ar.agents.packages import need_training
    from farm_ar.cli.options import code_of, make_folder, require_trust
    from farm_ar.cli.output import print_line
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
    if seeds is None and (workers, executor, address) != (1, None, OWN_CLUSTER):
        raise OptionError("--seeds", "must be given with --workers, --executor and --address", None)
    with arguments(arg) as given:
        known = load_recipe(algo, env, recipe).with_arguments(given, steps, imitate, lift)
        asked = Run(algo, env, seed, known, threads, processes, eval_every, eval_episodes)
        if not resume:
            check(asked)  # before a folder is made
    make_folder("RUN", run)
    if seeds is not None:
        with executor_of(executor, workers, address) as units:
            train_beside(asked, range(seed, seed + seeds), run, units)
        return
    try:
        model = learn(asked, run, resume, progress, steps, trust)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"Go on with: farm-ar train {shlex.quote(str(run))} --resume") from None
    which = "" if RunFolder(run).kept(BEST) else " --which last"
    print_line(f"{model.num_timesteps} steps are done. Look at it: farm-ar watch {run}{which}")


def train_beside(run: Run, seeds: range, home: Path, units: Executor) -> None:
    """Train several seeds beside each other, and say where they are.

    Raises:
        UnfinishedSweepError: one gave no result; the same command tries it again.
    """
    from rich.console import Console

    from farm_ar.agents.training.seeds import train_seeds
    from farm_ar.cli.output import print_line
    from farm_ar.sweeps.progress import shown

    with shown(Console(stderr=True)) as watch:
        folders = train_seeds(run, seeds, home, units, watch)
    print_line(f"{len(folders)} runs are done. Compare them: farm-ar plot {' '.join(map(str, folders))}")


def refuse_others(context: typer.Context) -> None:
    """Refuse options that a run that goes on would ignore.

    Raises:
        OptionError: an option is given that the run has already.
    """
    from farm_ar.errors import OptionError

    for name, value in context.params.items():
        source = context.get_parameter_source(name)
        if name not in GOING_ON and source is not None and source.name == "COMMANDLINE":
            expected = "must be left out with --resume, as the run's own counts"
            raise OptionError(f"--{name.replace('_', '-')}", expected, value)


@contextmanager
def arguments(given: list[str] | None) -> Iterator[dict[str, Any]]:
    """The environment's arguments, their values read as JSON where they are JSON.

    Raises:
        OptionError: there is no = in one; or, inside, one of them is wrong, which is named as it was typed.
    """
    import json

    from farm_ar.errors import OptionError

    values: dict[str, Any] = {}
    for text in given or ():
        name, sign, value = text.partition("=")
        if not sign:
            raise OptionError("--arg", "must be NAME=VALUE", text)
        try:
            values[name] = json.loads(value)
        except ValueError:
            values[name] = value
    try:
        yield values
    except OptionError as problem:
        typed = {"argument": "--arg", "arguments": "--arg"} | {name: f"--arg {name}" for name in values}
        if problem.field not in typed:
            raise
        raise OptionError(typed[problem.field], problem.expected, problem.got) from None


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
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Other policies, separated by commas: constant, greedy, analytic, cma, and those that come "
            "with farm-ar; random is always included. By default analytic and greedy, if they can act.",
        ),
    ] = None,
    which: Which = "best",
    arg: EnvironmentArguments = None,
    seed: Seed = 0,
    trust: Trust = False,
    as_json: AsJson = False,
) -> None:
    """Play held-out episodes with trained policies and with others.

    The score is 0 for a random policy and 1 for the best of these policies in each episode;
    of several runs it is the interquartile mean, with a 95% bootstrap interval.
    """
    from farm_ar.agents.packages import need_training
    from farm_ar.agents.policies import check_request
    from farm_ar.cli.options import code_of, require_trust
    from farm_ar.cli.output import print_json, print_line, print_table, progress

    names = None if beside is None else [name.strip() for name in beside.split(",") if name.strip()]
    with arguments(arg) as given:
        check_request(runs, names, which, given)
        need_training()
        from farm_ar.agents.training.evaluation import compare

        for run in runs:
            require_trust(run, code_of(run, which), trust)
        with progress("Playing", at_once=False) as watch:
            found = compare(runs, names, episodes, which, given, seed, trust, watch)
    if as_json:
        print_json(_as_json(found))
        return
    columns = ("policy", "return", "wrong labels", "effort", "score")
    print_table(columns, [_cells(row) for row in found.rows()], numbers=columns[1:])
    print_line(f"{episodes} held-out episodes; the best found: {found.best.mean():.2f}")


def _cells(row: Mapping[str, Any]) -> list[str]:
    return [
        str(row["policy"]),
        f"{row['return']:.2f} ± {row['standard_error']:.2f}",
        f"{row['wrong_labels']:.2f}",
        f"{row['effort']:.2f}",
        str(row["score"]),
    ]


def _as_json(found: Comparison) -> dict[str, Any]:
    rows = [
        {**row, "score": [row["score"].value, row["score"].low, row["score"].high]} for row in found.rows()
    ]
    return {"episodes": len(found.best), "best": float(found.best.mean()), "policies": rows}


def watch(
    run: Annotated[
        str,
        typer.Argument(metavar="RUN", help="Folder of a run, or a policy that comes with farm-ar."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The film, .mp4 or .gif; by default RUN/watch.mp4, or out/RUN.mp4."
        ),
    ] = None,
    episodes: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Number of episodes.")] = 2,
    seed: Annotated[
        int,
        typer.Option(
            metavar="N", parser=whole(0, 2**31), help="Seed of the first episode; the others follow."
        ),
    ] = 0,
    which: Which = "best",
    arg: EnvironmentArguments = None,
    trust: Trust = False,
) -> None:
    """Film a trained policy: its moves, the headset's belief after them, and where the animals run."""
    from farm_ar.agents.packages import need_training
    from farm_ar.agents.policies import check_request, shipped
    from farm_ar.cli.options import code_of, make_folder, require_trust, writing
    from farm_ar.cli.output import print_line
    from farm_ar.drawing.video import write_gif, write_mp4
    from farm_ar.errors import OptionError
    from farm_ar.showcases.episode_film import film_episode
    from farm_ar.showcases.film import FPS, Image

    path = out or (Path("out") / f"{run}.mp4" if run in shipped() else Path(run) / "watch.mp4")
    if path.suffix not in (".mp4", ".gif"):
        raise OptionError("--out", "must end in .mp4 or .gif", str(path))
    # Films show what training leaves out.
    shown = {"play_seconds": 3.0, "animals_a_second": 10.0}
    with arguments(arg) as given:
        check_request([run], None, which, given)
        need_training()
        from farm_ar.agents.policies.trained import policy_and_env

        require_trust(run, code_of(run, which), trust)
        policy, env = policy_and_env(run, which, shown | given, trust)
    make_folder("--out", path.parent)
    told: list[str] = []

    def film() -> Iterator[Image]:
        for k in range(episodes):
            total, wrong = yield from film_episode(env, policy, seed + k, f"episode {k + 1}")
            told.append(f"Episode {k + 1}: return {total:.2f}, wrong labels {wrong}")

    with writing("--out", path):
        if path.suffix == ".gif":
            write_gif(path, [f for n, f in enumerate(film()) if n % 5 == 0], FPS / 5, 640)
        else:
            write_mp4(path, film(), FPS)
    for line in (*told, f"Wrote {path}"):
        print_line(line)
