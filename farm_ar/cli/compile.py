"""`farm-ar compile`: compiles all kernels in advance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from farm_ar.cli.options import whole

if TYPE_CHECKING:
    from farm_ar.reid import Reidentifier
    from farm_ar.scenes import Scene, SnapshotBatch

RECIPE = """
FarmToTable-v0:
  n_timesteps: 128
  n_envs: 4
  imitate: {steps: 64, beam: 8, batches: 1}
  policy: ObjectPolicy
  policy_kwargs: {width: 16, pair_width: 8, rounds: 1}
  env_kwargs: {play_seconds: 0.0, animals_a_second: 0.0}
  n_steps: 16
  batch_size: 32
  n_epochs: 1
"""
"""A training that is over at once."""


def compile_kernels(
    parts: Annotated[
        list[str] | None,
        typer.Argument(metavar="[PART]...", help="Kernels of a part, such as spatial; all by default."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", parser=whole(1, 1000), help="Processes; one per core by default."),
    ] = None,
) -> None:
    """Compile the kernels in advance, so that no later command waits for it.

    Run it once after an installation; otherwise each kernel is compiled when it is first called. Compiled
    kernels are not compiled again.
    """
    import multiprocessing
    import os
    from concurrent.futures import ProcessPoolExecutor, as_completed

    from farm_ar.cli.output import progress
    from farm_ar.errors import known_name

    names = parts or list(STEPS)
    for name in names:
        known_name("part", name, tuple(STEPS))
    count = min(workers or os.cpu_count() or 1, len(names))
    beginning = "Compiling (a minute or two, once)"
    context = multiprocessing.get_context("spawn")
    with progress(beginning) as report, ProcessPoolExecutor(count, context) as pool:
        waiting = [pool.submit(_run, name) for name in names]
        for done, ended in enumerate(as_completed(waiting), start=1):
            report(f"Compiled: {ended.result()}", done / len(names))


def _run(name: str) -> str:
    """Do a part of what farm-ar is used for, which compiles all that it calls, and print nothing."""
    import contextlib
    import os
    import tempfile
    import warnings

    with (
        tempfile.TemporaryDirectory() as folder,
        Path(os.devnull).open("w") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
        warnings.catch_warnings(action="ignore"),
    ):
        STEPS[name](Path(folder))
    return name


def _spatial(folder: Path) -> None:
    from farm_ar.reid import SpatialOptions, SpatialReid

    _identify(SpatialReid)
    _identify_many(lambda scene, seen: SpatialReid(scene).identify_many(seen, margins=True))
    _identify_many(lambda scene, seen: SpatialReid(scene, SpatialOptions(threshold=0.5)).identify_many(seen))
    _identify(lambda scene: SpatialReid(scene, SpatialOptions(certify=True)))


def _likelihood(folder: Path) -> None:
    from farm_ar.reid import LikelihoodReid

    _identify(LikelihoodReid)
    _identify_many(lambda scene, seen: LikelihoodReid(scene).identify_many(seen))


def _relational(folder: Path) -> None:
    from farm_ar.reid import RelationalReid

    _identify(RelationalReid)


def _adaptive(folder: Path) -> None:
    from farm_ar.reid import AdaptiveReid

    _identify(AdaptiveReid)


def _identify(make_reid: Callable[[Scene], Reidentifier]) -> None:
    """Snapshots of all kinds, alone and several of a still scene, with all that there is to say of them."""
    import numpy as np

    from farm_ar.reid import track
    from farm_ar.scenes import builtin_scene
    from farm_ar.testing.reidentifiers import snapshots_of

    scene = builtin_scene("farm")
    reid, snapshots = make_reid(scene), [s for _, s in snapshots_of(scene, np.random.default_rng(0))]
    for snapshot in snapshots:
        _ = reid.identify(snapshot).confidence
    track(reid, snapshots[2:5])


def _identify_many(identify: Callable[[Scene, SnapshotBatch], object]) -> None:
    from farm_ar.scenes import builtin_scene, observe_many

    scene = builtin_scene("L1")
    assert scene.camera_path is not None
    identify(scene, observe_many(scene.layout, scene.camera_path.cameras(3, scene.fov)))


def _move(folder: Path) -> None:
    for action in ("displacement", "slot", "continuous"):
        _play("FarmToTable-v0", action=action, reward="clutter")


def _hand(folder: Path) -> None:
    _play("FarmToTableHand-v0", reward="margin", hand_seconds=2)


def _layout(folder: Path) -> None:
    _play("FarmToTableLayout-v0", reward="endpoint", jitter="hard")
    _play("SceneLayout-v0", reward="margin")


def _batches(folder: Path) -> None:
    import gymnasium as gym

    for env_id in ("FarmToTable-v0", "FarmToTableLayout-v0", "SceneLayout-v0"):
        carry: dict[str, Any] = {} if env_id == "SceneLayout-v0" else {"carry": "lift"}
        envs = gym.make_vec(f"farm_ar:{env_id}", num_envs=2, **carry)
        envs.action_space.seed(0)
        envs.reset(seed=0)
        for _ in range(6):
            envs.step(envs.action_space.sample())
        envs.close()


def _play(env_id: str, **arguments: Any) -> None:
    import gymnasium as gym

    from farm_ar.testing.rollouts import roll

    for knowledge in ("white-box", "black-box"):
        env = gym.make(f"farm_ar:{env_id}", knowledge=knowledge, render_mode="rgb_array", **arguments)
        roll(env, 0, 6)
        env.render()
        env.close()


def _planning(folder: Path) -> None:
    import gymnasium as gym
    import numpy as np

    from farm_ar.agents.policies import AnalyticPolicy, GreedyPolicy, play_episodes

    for action in ("displacement", "slot", "continuous"):
        env = gym.make("farm_ar:FarmToTable-v0", action=action)
        for policy in (AnalyticPolicy, GreedyPolicy):
            play_episodes(env, policy(np.random.default_rng(0)), range(1))


def _attacks(folder: Path) -> None:
    _command(
        "stress",
        "--compare",
        "spatial,nearest,distance",
        "--attack",
        "all",
        "--cases",
        1,
        "--queries",
        100,
        "--out",
        folder,
    )


def _service(folder: Path) -> None:
    from farm_ar.service.warmup import warm_up

    warm_up()


def _design(folder: Path) -> None:
    _command("design", "--plot", folder / "design.svg")


def _film(folder: Path) -> None:
    _command("demo", "--no-gif", "--out", folder)


def _training(folder: Path) -> None:
    from importlib.util import find_spec

    if find_spec("torch") and find_spec("sb3_contrib"):
        recipe = folder / "recipe.yml"
        recipe.write_text(RECIPE, encoding="utf-8")
        _command("train", folder / "run", "--recipe", recipe, "--eval-every", 128, "--eval-episodes", 1)


def _command(*arguments: object) -> None:
    from farm_ar.cli.program import app
    from farm_ar.errors import UnfinishedError

    words = [str(argument) for argument in arguments]
    if code := app(words, standalone_mode=False):
        raise UnfinishedError(f"farm-ar {' '.join(words)} ended with exit code {code}")


STEPS: dict[str, Callable[[Path], None]] = {
    "relational": _relational,
    "batches": _batches,
    "adaptive": _adaptive,
    "moves": _move,
    "attacks": _attacks,
    "likelihood": _likelihood,
    "planning": _planning,
    "training": _training,
    "hand": _hand,
    "layouts": _layout,
    "spatial": _spatial,
    "service": _service,
    "design": _design,
    "films": _film,
}
"""What is done, by the name of what it compiles, the longest first. Each is given an empty folder."""
