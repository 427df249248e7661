"""Frames a second of the game's pictures, beside LunarLander's in the same run.

    SDL_VIDEODRIVER=dummy python benchmarks/rendering.py [--write] [--seconds S]

Prints the tables; with --write also makes docs/speed-rendering.md of them. Processor time on one core, of the
pictures alone: what the environments do between two of them is not counted. LunarLander needs:
pip install '.[bench]'
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from statistics import median
from typing import Any

import cv2
import gymnasium as gym
import numpy as np

import farm_ar  # noqa: F401  # registers the environments
from farm_ar.arrays import FloatArray
from farm_ar.drawing.game.above import TableFromAbove
from farm_ar.drawing.game.frames import GameFrames
from farm_ar.game_logic.headset import field_of_view, look_at
from farm_ar.game_logic.render_state import RenderState
from farm_ar.rendering import HOLOLENS_2, Instance, Intrinsics, Renderer, View, model
from farm_ar.rendering.shapes import box, mesh_of
from farm_ar.scenes import Scene
from farm_ar.scenes.builtin import builtin_scene
from farm_ar.scenes.builtin.furniture import Model, Piece, furnish

YARDSTICK = "LunarLander-v3"
ROUNDS = 7
WARM_UP = 150
"""Pictures of each row before it is timed: the sprites that it needs again and again are made then."""
ANIMALS = (10, 30, 100, 300, 1000, 3000, 10000)
BUILDINGS = (10, 20, 50, 100, 200)
PACE_M = 0.004
"""How far an animal runs from one picture to the next, metres."""

Draw = Callable[[], Any]
"""Makes one picture, and is all that is timed."""

Case = Iterator[Draw]
"""Gets ready for the next picture, again and again."""


def in_environment(name: str, act: Callable[[gym.Env[Any, Any], int], Any], **arguments: Any) -> Case:
    """`env.render()` after every step of an environment."""
    env = gym.make(name, render_mode="rgb_array", **arguments)
    env.reset(seed=0)
    env.action_space.seed(0)
    return _steps(env, act)


def _steps(env: gym.Env[Any, Any], act: Callable[[gym.Env[Any, Any], int], Any]) -> Case:
    for number in cycle(range(1 << 20)):
        _, _, terminated, truncated, _ = env.step(act(env, number))
        if terminated or truncated:
            env.reset()
        yield env.render


def random_action(env: gym.Env[Any, Any], number: int) -> Any:
    """Whatever the action space holds."""
    return env.action_space.sample()


def dragging(env: gym.Env[Any, Any], number: int) -> Any:
    """The hand drags a building to and fro in the middle of the table."""
    hand = env.unwrapped.world.tabletop.hand
    goal = np.array([0.42 + 0.25 * np.sin(0.2 * number), 0.34])
    return np.array([*np.clip((goal - hand.position) / 0.15, -1, 1), 0.0, 1.0], dtype=np.float32)


def waiting(env: gym.Env[Any, Any], number: int) -> Any:
    """The hand waits out of view, and the animals run."""
    return np.zeros(4, dtype=np.float32)


def of_moments(draw: Callable[[RenderState], Any], moments: list[RenderState]) -> Case:
    """One picture after the other of moments, round and round."""
    for moment in cycle(moments):
        yield lambda moment=moment: draw(moment)  # type: ignore[misc]


def running(scene: Scene, animals: int, head_moves: bool) -> list[RenderState]:
    """Moments of a game in play, one animal's pace apart."""
    rng = np.random.default_rng(0)
    n, size = len(scene.layout), np.array(scene.size)
    goal = rng.choice(np.flatnonzero(scene.layout.movable), animals)
    heading = rng.uniform(-np.pi, np.pi, animals)
    way = np.stack([np.sin(heading), np.cos(heading)], axis=1)
    places = rng.uniform(0.1, 0.9, (animals, 2)) * size
    eye = np.array([0.5, -0.375]) * size
    level = 0.45 * scene.size[1] / 0.8
    views = [
        look_at(eye + 0.004 * k * head_moves, size * np.array([0.4, 0.5]), field_of_view("photo"), level)
        for k in range(12)
    ]
    if not head_moves:
        views = views[:1] * len(views)
    nothing = np.zeros(n, dtype=np.int64)
    return [
        RenderState(
            scene,
            scene.layout,
            scene.layout,
            np.zeros(n, dtype=bool),
            camera,
            seconds=k / 30,
            counts=nothing + 3,
            misplaced=nothing,
            animal=places + PACE_M * k * way,
            animal_heading=heading,
            animal_goal=goal,
        )
        for k, camera in enumerate(views)
    ]


def rows_of_buildings(count: int) -> Scene:
    """Coops and hutches in rows and a shed, as densely as on the farm: the table grows with their number."""
    coop, hutch, shed = (
        Model("coop", (0.10, 0.08, 0.09)),
        Model("hutch", (0.09, 0.07, 0.07)),
        Model("shed", (0.2, 0.14, 0.16)),
    )
    across = int(np.ceil(np.sqrt(1.5 * count)))
    pieces = [
        Piece((coop, hutch)[k % 2], 0.2 + 0.27 * (k % across), 0.2 + 0.27 * (k // across), 10.0, f"{k}-label")
        for k in range(count)
    ]
    width, depth = 0.4 + 0.27 * (across - 1), 0.6 + 0.27 * ((count - 1) // across)
    pieces.append(Piece(shed, width / 2, depth - 0.12, 180.0, "shed", fixed=True))
    return furnish(
        f"rows of {count}", (width, depth), pieces, [(width / 4, depth / 2), (3 * width / 4, depth / 2)]
    )


def environments() -> dict[str, Case]:
    """The pictures of environments, and of the farm without one."""
    farm = builtin_scene("farm")
    still, moving = running(farm, 40, False), running(farm, 40, True)
    grabbing = [replace(m, truth=_shifted(m, k)) for k, m in enumerate(still)]
    frames = [GameFrames(farm) for _ in range(2)]
    cases = {
        "FarmToTable-v0": in_environment("FarmToTable-v0", _masked),
        "FarmToTableHand-v0, idle": in_environment("FarmToTableHand-v0", waiting),
        "FarmToTableHand-v0, dragging": in_environment("FarmToTableHand-v0", dragging, budget=1e9),
        "SceneLayout-v0": in_environment("SceneLayout-v0", random_action),
        "table from above alone, 640x480": of_moments(TableFromAbove(farm).draw, still),
        "both panes, a building moves": of_moments(frames[0].frame, grabbing),
        "both panes, the head moves": of_moments(frames[1].frame, moving),
    }
    return cases


def renderer() -> dict[str, Case]:
    """The renderer's pictures of the farm from a head that moves, and the same by a z-buffer in NumPy."""
    farm = builtin_scene("farm")
    layout = farm.layout
    things = [
        Instance(
            model(layout.category[i]).fitted(*layout.size[i]),
            np.insert(layout.position[i], 1, 0.0),
            float(layout.yaw[i]),
            i,
        )
        for i in range(len(layout))
    ]
    low, high = np.array([-0.02, -0.03, -0.02]), np.array([farm.size[0] + 0.02, 0.0, farm.size[1] + 0.02])
    things.append(Instance(mesh_of(box(low, high, (120, 160, 90))), np.zeros(3), number=len(things)))
    drawer, corners = Renderer(things), np.concatenate([one.corners for one in things])
    small = HOLOLENS_2.resized(84, 84)

    def views(lens: Intrinsics) -> Iterator[View]:
        for k in cycle(range(1 << 20)):
            yield View(lens, np.array([0.6 + 1e-6 * k, 0.45, -0.32]), 0.0, -0.5)

    def of_views(draw: Callable[[View], Any], lens: Intrinsics) -> Case:
        for view in views(lens):
            yield lambda view=view: draw(view)  # type: ignore[misc]

    return {
        f"{len(corners)} faces, 640x360, depth and ids": of_views(drawer.ids, HOLOLENS_2),
        "with colours and shadows": of_views(drawer.draw, HOLOLENS_2),
        "84x84 with colours and shadows": of_views(drawer.draw, small),
        "640x360, depth and ids by NumPy": of_views(lambda view: numpy_z_buffer(corners, view), HOLOLENS_2),
    }


def numpy_z_buffer(corners: FloatArray, view: View) -> tuple[FloatArray, FloatArray]:
    """(H, W) nearness and face of triangles (F, 3, 3) that are all before the camera, by NumPy."""
    lens = view.intrinsics
    places, away = view.pixels(corners), view.axes(corners)[..., 2]
    nearness, face = np.zeros((lens.height, lens.width)), np.full((lens.height, lens.width), -1.0)
    limit = np.array([lens.width - 1, lens.height - 1])
    first = np.clip(np.ceil(places.min(axis=1)), 0, limit).astype(int)
    last = np.clip(np.floor(places.max(axis=1)), -1, limit).astype(int)
    for k in np.flatnonzero((last >= first).all(axis=1) & (away > 0).all(axis=1)):
        (left, top), (right, bottom) = first[k], last[k] + 1
        (ax, ay), (bx, by), (cx, cy) = places[k]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0:
            continue
        x, y = np.arange(left, right)[None] - ax, np.arange(top, bottom)[:, None] - ay
        second = (x * (cy - ay) - y * (cx - ax)) / area
        third = (y * (bx - ax) - x * (by - ay)) / area
        near = (1 - second - third) / away[k, 0] + second / away[k, 1] + third / away[k, 2]
        window = np.s_[top:bottom, left:right]
        inside = (second >= 0) & (third >= 0) & (second + third <= 1) & (near > nearness[window])
        nearness[window][inside], face[window][inside] = near[inside], k
    return nearness, face


def _masked(env: gym.Env[Any, Any], number: int) -> Any:
    rng = np.random.default_rng(number)
    space: Any = env.action_space
    first = env.unwrapped.action_masks()[: space.nvec[0]].nonzero()[0]
    return np.array([first[rng.integers(len(first))], *rng.integers(space.nvec[1:])])


def _shifted(moment: RenderState, number: int) -> Any:
    layout = moment.truth
    position = layout.position.copy()
    position[1] += [0.004 * number, 0.0]
    return layout.with_poses(position, layout.yaw)


def frames_a_second(cases: dict[str, Case], seconds: float) -> dict[str, float]:
    """Pictures a second of processor time: medians of rounds in which all cases take turns."""
    for case in cases.values():
        for _ in range(WARM_UP):
            next(case)()
    measured: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(ROUNDS):
        for name, case in cases.items():
            spent, count = 0.0, 0
            while spent < seconds / ROUNDS or count < 2:
                draw = next(case)
                begin = time.process_time()
                draw()
                spent += time.process_time() - begin
                count += 1
            measured[name].append(count / spent)
    return {name: median(values) for name, values in measured.items()}


def table(title: str, cases: dict[str, Case], seconds: float) -> str:
    """Measure, and write as a table with LunarLander in its first row."""
    try:
        cases = {YARDSTICK: in_environment(YARDSTICK, random_action)} | cases
    except gym.error.DependencyNotInstalled:
        print(f"({YARDSTICK} is left out: pip install '.[bench]')")
    speeds = frames_a_second(cases, seconds)
    yard = speeds.get(YARDSTICK)
    lines = [f"| {title} | frames/s | by {YARDSTICK} |", "|---|---:|---:|"]
    for name, speed in speeds.items():
        lines.append(
            f"| {name} | {speed:.0f} | {speed / yard:.2f} |" if yard else f"| {name} | {speed:.0f} | |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="make docs/speed-rendering.md of the tables")
    parser.add_argument("--seconds", type=float, default=2.0, help="processor time for each row")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    farm = builtin_scene("farm")
    growing = {f"{n} animals": of_moments(GameFrames(farm).frame, running(farm, n, False)) for n in ANIMALS}
    crowded = {
        f"{n} buildings": of_moments(GameFrames(scene).frame, running(scene, 40, False))
        for n, scene in ((n, rows_of_buildings(n)) for n in BUILDINGS)
    }
    width, height = GameFrames(farm).size
    page = f"""# Speed of rendering

Made by `python benchmarks/rendering.py --write` (LunarLander needs the extra `bench`): pictures a second of
processor time on one core, medians of rounds in one run in which the rows of a table take turns, after 150
pictures that are not timed. The ratios carry over to other machines better than the numbers. LunarLander's
pictures are 600x400; those of the environments here, the table from above beside the headset's view, are
{width}x{height}.
"""
    print(page)
    for title, cases in (
        ("`env.render()`, and the farm with 40 animals", environments()),
        ("the renderer alone, a new view each time", renderer()),
        ("both panes, camera at rest, by animals on the table", growing),
        ("both panes, camera at rest, 40 animals, by buildings", crowded),
    ):
        section = table(title, cases, options.seconds)
        print(section, flush=True)
        page += f"\n{section}"
    if options.write:
        target = Path(__file__).parents[1] / "docs" / "speed-rendering.md"
        unfinished = target.with_suffix(".md.part")
        unfinished.write_text(page, encoding="utf-8")
        unfinished.replace(target)


if __name__ == "__main__":
    main()
