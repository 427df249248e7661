"""`farm-ar stress` and `farm-ar stress-replay`: how much it takes to break a re-identifier."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from farm_ar.cli.options import Seed, number, whole

LEGEND = (
    "D: effort summed over the objects moved, each way / the room's diagonal + sin(turn / 2).",
    "as a way: how far an object goes for that effort, without turning.",
    "certified: no attack breaks the rule with less (the median of the cases); none: no theorem tells.",
    "/ certified: what was found by what is certified, case by case (the median); 1 is exact.",
    "failed: cases broken within the budget, with the exact 95% interval.",
    "queries/s: snapshots identified a second of the processor, everything included.",
)
"""What the columns of the table say."""


def stress(
    scene: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="A built-in scene, or a .json file.")
    ] = "farm",
    reid: Annotated[
        str,
        typer.Option(
            metavar="RULE", help="A built-in rule, or module:Class of your own, called with the scene."
        ),
    ] = "spatial",
    compare: Annotated[
        str | None,
        typer.Option(metavar="RULE,RULE,...", help="Several rules side by side, in place of --reid."),
    ] = None,
    attack: Annotated[
        str,
        typer.Option(
            metavar="NAME,...",
            help="random, halton, constant, greedy, cma, ribs, planned, analytic, ladder, learned, "
            "several of them, or all (but for learned).",
        ),
    ] = "ladder",
    player: Annotated[
        str | None,
        typer.Option(
            metavar="RUN",
            help="Who plays in the attack learned: a training run's folder, or a player that comes with "
            "farm-ar; by default both of these.",
        ),
    ] = None,
    queries: Annotated[
        int,
        typer.Option(metavar="N", parser=whole(1), help="Snapshots that an attack may ask about in a case."),
    ] = 2000,
    cases: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="How many layouts and cameras.")
    ] = 40,
    budget: Annotated[
        float,
        typer.Option(
            metavar="D", parser=number(), help="Effort that a perturbation may take, summed over the objects."
        ),
    ] = 1.0,
    jitter: Annotated[
        str, typer.Option(help="How far layouts stray from the scene's: none, easy, default or hard.")
    ] = "default",
    seed: Seed = 0,
    workers: Annotated[
        int,
        typer.Option(metavar="N", parser=whole(1, 1000), help="Processes; the results do not depend on it."),
    ] = 1,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the report goes.")] = Path("out/stress"),
    fail_under: Annotated[
        float | None,
        typer.Option(
            metavar="D",
            parser=number(),
            help="Exit code 1 if the median least perturbation of a rule is below this.",
        ),
    ] = None,
) -> None:
    """Find out how small a change of a scene makes a re-identifier give wrong labels.

    Writes a page to look at, stress.html, the same as stress.json and stress.csv, and prints the numbers.
    Interrupted, the same command goes on where it stopped.
    """
    from rich.console import Console

    from farm_ar.agents.stress import StressOptions, run_stress, summarise, write_study
    from farm_ar.agents.stress.wording import in_metres, number, ratio, share
    from farm_ar.cli.output import print_line, print_table
    from farm_ar.cli.places import make_folder, writing
    from farm_ar.envs.generator import scene_of
    from farm_ar.sweeps import make_executor
    from farm_ar.sweeps.progress import shown

    options = StressOptions(
        scene=scene,
        reids=tuple((compare or reid).split(",")),
        attacks=attacks_asked_for(attack, player),
        queries=queries,
        cases=cases,
        budget=budget,
        jitter=jitter,
        seed=seed,
    )
    make_folder("--out", out)
    executor = make_executor("process" if workers != 1 else "serial", workers)
    with executor, shown(Console(stderr=True)) as watch:
        study = run_stress(options, out / "stress.sqlite", executor, watch)
    room = scene_of(scene, game=False)
    summary = summarise(study, room.layout.labels)
    with writing("--out", out):
        files = write_study(study, summary, out)
    head = (
        "rule", "attack", "median least, D", "as a way", "certified, D", "/ certified", "failed",
        "queries/s",
    )  # fmt: skip
    rows = []
    for rule in summary.rules:
        certified = number(rule.bound_median) if rule.theorem != "none" else "none"
        for one in rule.attacks if len(options.attacks) > 1 else rule.attacks[:1]:
            pace = "–" if one.attack == "best" else f"{one.queries_per_second:.0f}"
            found = number(one.median), in_metres(one.median, room), certified, ratio(one.tightness)
            rows.append((rule.reid, one.attack, *found, share(one.failed), pace))
    print_table(head, rows, head[2:])
    for line in LEGEND:
        print_line(line)
    print_line(f"Wrote {', '.join(str(file) for file in files)}")
    if fail_under is not None:
        weak = [rule.reid for rule in summary.rules if rule.best.median < fail_under]
        if weak:
            print_line(f"Median least perturbation below {fail_under:g}: {', '.join(weak)}")
            raise typer.Exit(1)


def attacks_asked_for(names: str, player: str | None) -> tuple[str, ...]:
    """The attacks of a command line; the player's name becomes a part of that of its attack.

    Raises:
        OptionError: there is a player, and no attack for it.
    """
    from farm_ar.agents.attacks import ATTACKS, LEARNED
    from farm_ar.errors import OptionError

    asked = [one for name in names.split(",") for one in (ATTACKS if name == "all" else (name,))]
    if player is None:
        return tuple(asked)
    if LEARNED not in asked:
        raise OptionError("--player", f"must come with --attack {LEARNED}", player)
    return tuple(f"{LEARNED}:{player}" if name == LEARNED else name for name in asked)


def stress_replay(
    report: Annotated[Path, typer.Argument(metavar="FILE", help="stress.json of a stress test.")],
    failure: Annotated[
        int, typer.Argument(metavar="N", parser=whole(0), help="Which failure, as the report numbers them.")
    ],
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the answer, .svg or .png.")] = None,
) -> None:
    """Play a failure of a stress test again; exit code 1 if it is not the same to the last bit."""
    from farm_ar.agents.stress import read_failure, replay_failure
    from farm_ar.cli.output import print_line, print_table

    again = replay_failure(read_failure(report, failure))
    rows = [
        (detected, true or "nothing", given or "nothing", "" if given == true else "wrong")
        for detected, true, given in zip(
            again.snapshot.detections.ids, again.truth, again.answer.labels, strict=True
        )
    ]
    print_table(("detection", "is", "was read as", ""), rows)
    print_line(f"effort {again.effort!r}, {again.wrong} wrong label{'' if again.wrong == 1 else 's'}")
    if plot is not None:
        from farm_ar.cli.pictures import picture_of_identification

        picture_of_identification(again.case.scene, again.snapshot, again.answer, plot, again.truth)
        print_line(f"Wrote {plot}")
    if not again.same:
        print_line("This is not what the report says.")
        raise typer.Exit(1)
    print_line("The same as in the report, bit for bit.")
