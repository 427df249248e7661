"""`farm-ar stress`, `stress-replay` and `design`: the smallest changes that fool a re-identifier."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import (
    OWN_CLUSTER,
    REID_HELP,
    Address,
    Plot,
    Seed,
    Trust,
    Where,
    Workers,
    executor_of,
    number,
    whole,
)

if TYPE_CHECKING:
    from farm_ar.agents.design import Design
    from farm_ar.agents.stress.report import Summary
    from farm_ar.scenes import Scene

MOST_DESIGNED = 500
"""Objects that a design places: it compares all pairs."""

LEGEND = (
    "D: the paper's distance, summed over the objects moved: metres / the room's diagonal + sin(turn / 2).",
    "in metres: the shift of one object that has that D, without turning.",
    "certified: proven that no attack succeeds with less (the median of the cases); none: no such proof.",
    "/ certified: least D found divided by the certified one, case by case (the median); 1 is tight.",
    "failed: share of cases with a wrong label within the budget, with the exact 95% interval.",
    "queries/s: snapshots identified per second of processor time, everything included.",
)
"""What the columns of the table say."""


def stress(
    scene: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="A built-in scene, or a .json file.")
    ] = "farm",
    reid: Annotated[str, typer.Option(metavar="METHOD", help=REID_HELP)] = "spatial",
    compare: Annotated[
        str | None,
        typer.Option(metavar="METHOD,...", help="Several methods side by side, instead of --reid."),
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
            "--policy",
            "--player",
            metavar="RUN",
            help="The policy of the attack learned: a training run's folder, or a policy that comes with "
            "farm-ar; by default both of these.",
        ),
    ] = None,
    trust: Trust = False,
    queries: Annotated[
        int,
        typer.Option(metavar="N", parser=whole(1), help="Snapshots that an attack may query per case."),
    ] = 2000,
    cases: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Number of cases, each a layout and a camera.")
    ] = 40,
    budget: Annotated[
        float,
        typer.Option(
            metavar="D",
            parser=number(),
            help="Largest distance D of a perturbation, summed over the objects.",
        ),
    ] = 1.0,
    jitter: Annotated[
        str, typer.Option(help="Noise on the scene's layout: none, easy, default or hard.")
    ] = "default",
    seed: Seed = 0,
    workers: Workers = 1,
    executor: Where = None,
    address: Address = OWN_CLUSTER,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the report goes.")] = Path("out/stress"),
    fail_under: Annotated[
        float | None,
        typer.Option(
            metavar="D",
            parser=number(),
            help="Exit code 1 if the median minimum perturbation of a method is below this.",
        ),
    ] = None,
) -> None:
    """Find the smallest changes of a scene that make a re-identifier give wrong labels.

    Writes a page to look at, stress.html, the same as stress.json and stress.csv, and prints the numbers.
    After an interruption the same command continues where it stopped.
    """
    from rich.console import Console

    from farm_ar.agents.stress import StressOptions, run_stress, summarise, write_study
    from farm_ar.cli.options import make_folder, writing
    from farm_ar.cli.output import print_line, saying
    from farm_ar.envs.generator import scene_of
    from farm_ar.sweeps.progress import shown

    options = StressOptions(
        scene=scene,
        reids=tuple((compare or reid).split(",")),
        attacks=attacks_asked_for(attack, player, trust),
        queries=queries,
        cases=cases,
        budget=budget,
        jitter=jitter,
        seed=seed,
    )
    make_folder("--out", out)
    with executor_of(executor, workers, address) as units, shown(Console(stderr=True)) as watch:
        study = run_stress(options, out / "stress.sqlite", units, watch)
    room = scene_of(scene, game=False)
    with saying("Drawing what failed, and writing the report"), writing("--out", out):
        summary = summarise(study, room.layout.labels)
        files = write_study(study, summary, out)
    _print_summary(summary, room, one_attack=len(options.attacks) == 1)
    print_line(f"Wrote {', '.join(str(file) for file in files)}")
    if fail_under is not None:
        weak = [tested.reid for tested in summary.reids if tested.best.median < fail_under]
        if weak:
            print_line(f"Median minimum perturbation below {fail_under:g}: {', '.join(weak)}")
            raise typer.Exit(1)


def _print_summary(summary: Summary, room: Scene, one_attack: bool) -> None:
    """Print what each attack did to each re-identifier, and what the columns say."""
    from farm_ar.agents.stress.report import in_metres, number, ratio, share
    from farm_ar.cli.output import print_line, print_table

    head = (
        "method", "attack", "median minimum, D", "in metres", "certified, D", "/ certified", "failed",
        "queries/s",
    )  # fmt: skip
    rows = []
    for tested in summary.reids:
        certified = number(tested.bound_median) if tested.certified else "none"
        for one in tested.attacks[:1] if one_attack else tested.attacks:
            pace = "–" if one.attack == "best" else f"{one.queries_per_second:.0f}"
            found = number(one.median), in_metres(one.median, room), certified, ratio(one.tightness)
            rows.append((tested.reid, one.attack, *found, share(one.failed), pace))
    print_table(head, rows, head[2:])
    for line in (*summary.notes(), *LEGEND):
        print_line(line)


def attacks_asked_for(names: str, player: str | None, trust: bool = False) -> tuple[str, ...]:
    """The attacks of a command line; the policy's name becomes a part of that of its attack.

    Raises:
        OptionError: there is a policy, and no attack for it; or its folder needs to be trusted.
    """
    from farm_ar.agents.attacks import ATTACKS, LEARNED, TRUSTED
    from farm_ar.errors import OptionError

    asked = [one for name in names.split(",") for one in (ATTACKS if name == "all" else (name,))]
    if player is None:
        return tuple(asked)
    if LEARNED not in asked:
        raise OptionError("--policy", f"must come with --attack {LEARNED}", player)
    from farm_ar.agents.packages import need_training

    need_training()
    from farm_ar.cli.options import code_of, require_trust

    code = code_of(player, "best")
    require_trust(player, code, trust)
    learned = f"{TRUSTED if code else LEARNED}:{player}"
    return tuple(learned if name == LEARNED else name for name in asked)


def stress_replay(
    report: Annotated[Path, typer.Argument(metavar="FILE", help="stress.json of a stress test.")],
    failure: Annotated[
        int, typer.Argument(metavar="N", parser=whole(0), help="Number of the failure in the report.")
    ],
    plot: Plot = None,
    trust: Annotated[
        bool, typer.Option("--trust", help="Allow the file to run code: the module:Class that it names.")
    ] = False,
) -> None:
    """Replay a failure of a stress test; the exit code is 1 if it differs in any bit."""
    from farm_ar.agents.stress import read_failure, replay_failure
    from farm_ar.agents.stress.failures import names_code
    from farm_ar.cli.options import require_trust
    from farm_ar.cli.output import print_line, print_table

    found = read_failure(report, failure)
    if names_code(found["reid"]):
        require_trust(str(report), [f"the module of {found['reid']}"], trust)
    again = replay_failure(found)
    rows = [
        (detected, true or "nothing", given or "nothing", "" if given == true else "wrong")
        for detected, true, given in zip(
            again.snapshot.detections.ids, again.truth, again.answer.labels, strict=True
        )
    ]
    print_table(("detection", "is", "was read as", ""), rows)
    print_line(f"D {again.distance!r}, {again.wrong} wrong label{'' if again.wrong == 1 else 's'}")
    if plot is not None:
        from farm_ar.cli.reports import picture_of_identification

        picture_of_identification(again.case.scene, again.snapshot, again.answer, plot, again.truth)
        print_line(f"Wrote {plot}")
    if not again.same:
        print_line("This is not what the report says.")
        raise typer.Exit(1)
    print_line("The same as in the report, bit for bit.")


def design(
    scene: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="The room, its objects and which of them are fixed.")
    ] = "farm",
    objects: Annotated[
        str | None,
        typer.Option(
            metavar="KIND=N,...",
            help="Objects of each category; by default the scene's own, with their labels.",
        ),
    ] = None,
    yaw_limit_deg: Annotated[
        float,
        typer.Option(metavar="DEG", parser=number(0, 180), help="Largest turn of an object to either side."),
    ] = 30.0,
    seed: Seed = 0,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the layout, .svg or .png.")] = Path(
        "out/design.svg"
    ),
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write it as a scene file, .json.")
    ] = None,
) -> None:
    """Propose a placement in which small displacements of identical objects never give a wrong label.

    Maximises the certified radius: as long as no object has moved further than that, no label is wrong in any
    snapshot of any part of the room.
    """
    import numpy as np

    from farm_ar.agents.design import described, with_objects
    from farm_ar.agents.design import design as search
    from farm_ar.cli.inputs import read_scene
    from farm_ar.cli.options import writing
    from farm_ar.cli.output import print_line, print_table
    from farm_ar.scenes import save_scene

    known = read_scene(scene, None)
    own = described(known)
    wanted = known if objects is None else with_objects(known, _counts(objects))
    found = search(wanted, np.random.default_rng(seed), yaw_limit_deg)
    rows = [
        (name, f"{one.radius:.4f}", f"{100 * one.metres:.1f}", f"{one.degrees:.1f}")
        for name, one in (("the scene's own layout", own), ("this design", found))
    ]
    print_table(("", "certified radius", "cm without turning", "degrees in place"), rows)
    layout = found.scene.layout
    poses = [
        (label, f"{x:.3f}", f"{z:.3f}", f"{np.rad2deg(yaw):.1f}")
        for label, (x, z), yaw in zip(layout.labels, layout.position, layout.yaw, strict=True)
    ]
    print_table(("label", "x", "z", "yaw_deg"), poses, ("x", "z", "yaw_deg"))
    if plot is not None:
        with writing("--plot", plot):
            _draw(found, plot)
        print_line(f"Wrote {plot}")
    if save is not None:
        with writing("--save", save):
            save_scene(found.scene, save)
        print_line(f"Wrote {save}")


def _draw(found: Design, path: Path) -> None:
    """Draw a placement, and around each object how far it may move, unturned, without being mistaken."""
    import numpy as np
    from matplotlib.patches import Circle

    from farm_ar.drawing import draw_scene, new_picture, save_picture

    figure, axes = new_picture(found.scene.size)
    draw_scene(axes, found.scene, path=False, cells=False)
    layout = found.scene.layout
    code = layout.category_code
    for i, (x, z) in enumerate(layout.position.tolist()):
        if np.isfinite(found.metres) and np.count_nonzero(code == code[i]) > 1:
            ring = Circle((x, z), found.metres, fill=False, linewidth=0.6, edgecolor="#059669")
            ring.set_linestyle((0, (4, 3)))
            axes.add_patch(ring)
    save_picture(figure, path)


def _counts(text: str) -> dict[str, int]:
    """Numbers by kind from "coop=5,hutch=4"."""
    from farm_ar.arrays import whole_in
    from farm_ar.errors import OptionError

    counts: dict[str, int] = {}
    for part in text.split(","):
        kind, equals, number = part.partition("=")
        if not equals or (count := whole_in(number)) is None or count < 0 or kind in counts:
            raise OptionError("--objects", "must be KIND=N,KIND=N,... with each kind once", text)
        counts[kind] = count
    if sum(counts.values()) > MOST_DESIGNED:
        raise OptionError("--objects", f"must be at most {MOST_DESIGNED} in all", text)
    return counts
