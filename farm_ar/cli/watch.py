"""`farm-ar watch`: what a trained policy does, as a film."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from farm_ar.cli.options import whole


def watch(
    run: Annotated[
        str,
        typer.Argument(metavar="RUN", help="Folder of a run, or a policy that comes with farm-ar."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The film, .mp4 or .gif; RUN/watch.mp4, or out/RUN.mp4, by default."
        ),
    ] = None,
    episodes: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="How many.")] = 2,
    seed: Annotated[
        int, typer.Option(metavar="N", parser=whole(0, 2**31), help="Of the first; the others follow.")
    ] = 0,
    which: Annotated[str, typer.Option(metavar="NAME", help="best (by the evaluations) or last.")] = "best",
    arg: Annotated[
        list[str] | None, typer.Option(metavar="NAME=VALUE", help="Another argument of the environment.")
    ] = None,
    trust: Annotated[
        bool,
        typer.Option("--trust", help="Run code that the folder names or holds (modules, pickles)."),
    ] = False,
) -> None:
    """Film a trained policy: its moves, the headset's belief after them, and where the animals run."""
    from farm_ar.agents.packages import need_training

    need_training()
    from farm_ar.agents.policies.trained import policy_and_env, shipped
    from farm_ar.cli.output import print_line
    from farm_ar.cli.places import make_folder, writing
    from farm_ar.cli.train import arguments
    from farm_ar.cli.trust import code_of, require_trust
    from farm_ar.drawing.video import write_gif, write_mp4
    from farm_ar.errors import OptionError
    from farm_ar.showcases.episode_film import film_episode
    from farm_ar.showcases.film import FPS, Image

    path = out or (Path("out") / f"{run}.mp4" if run in shipped() else Path(run) / "watch.mp4")
    if path.suffix not in (".mp4", ".gif"):
        raise OptionError("--out", "must end in .mp4 or .gif", str(path))
    # Films show what training leaves out.
    shown = {"play_seconds": 3.0, "animals_a_second": 10.0}
    require_trust(run, code_of(run, which), trust)
    policy, env = policy_and_env(run, which, {**shown, **arguments(arg or [])}, trust)
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
