"""Play without the pause (paper, section 5.2): one look after a visit beside five looks a second."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from farm_ar.drawing.video import write_mp4
from farm_ar.game_logic.farm_game import FarmGame
from farm_ar.game_logic.headset import gaze_target
from farm_ar.game_logic.live import UPDATES
from farm_ar.reid import REIDENTIFIERS
from farm_ar.scenes import Scene, builtin_scene
from farm_ar.showcases.film import FPS, ScriptRecorder
from farm_ar.showcases.result import Report, Row, Shown, column, number, percent, points
from farm_ar.showcases.script import Script, ScriptedMove, ScriptedVisit, builtin_scripts, load_script

METHODS = ("spatial", "likelihood")

NUDGED_M, NUDGED_RAD = 0.10, 1.0
"""How far, at the most, random visits move and turn buildings beside the two that change places."""


def play(script: Script, method: str, update: str, number: int = 0) -> Row:
    """Play a script to its end, and count.

    Args:
        script: what happens.
        method: the re-identifier's name.
        update: one of `UPDATES`.
        number: of the script.

    Returns:
        A row: the share of labels right at the end, animals that arrived anywhere while it was played, how
        many of them went astray, seconds of standing still.
    """
    recorder = ScriptRecorder(replace(script, update=update), REIDENTIFIERS[method], make_pictures=None)
    game = recorder.game
    before = _arrived(game)
    film = recorder.play()
    movable = int(game.scene.layout.movable.sum())
    return {
        "script": number,
        "method": method,
        "update": update,
        "accuracy": round(1 - game.tracker.belief.wrong_labels / movable, 4),
        "wrong_labels": game.tracker.belief.wrong_labels,
        "arrived": _arrived(game) - before,
        "astray": game.miscounts,
        "interrupted_s": round(film.interrupted / FPS, 2),
    }


def random_script(scene: Scene, rng: np.random.Generator) -> Script:
    """A visit in which two look-alikes change places by way of a third, and two others are nudged."""
    layout, gaze = scene.layout, str(rng.choice(["S1", "S4"]))
    target = gaze_target(scene, gaze)
    near = np.linalg.norm(layout.position - target, axis=1)
    movable = np.flatnonzero(layout.movable & (near < 0.35))
    kind = str(rng.choice(sorted({layout.category[i] for i in movable})))
    alike = rng.permutation([i for i in movable.tolist() if layout.category[i] == kind])[:2].tolist()
    others = rng.permutation([i for i in movable.tolist() if i not in alike])[:2].tolist()
    first, second = alike
    low, high = np.array([0.08, 0.06]), np.array(scene.size) - np.array([0.08, 0.3])
    aside = rng.uniform(low, high)
    moves = [
        _move(layout.labels[first], aside),
        _move(layout.labels[second], layout.position[first]),
        _move(layout.labels[first], layout.position[second]),
    ]
    for i in others:
        to = np.clip(layout.position[i] + rng.uniform(-NUDGED_M, NUDGED_M, 2), low, high)
        moves.append(_move(layout.labels[i], to, float(rng.uniform(-NUDGED_RAD, NUDGED_RAD))))
    visit = ScriptedVisit(tuple(moves), 2.0)
    return Script("A random visit", scene, gaze, (visit,), seed=int(rng.integers(2**31)), ending=5.0)


def show_live(out: Path, layouts: int, seed: int, film: bool, report: Report) -> Shown:
    """Play the paper's demonstrations and random visits both ways, and sum up."""
    demonstrations = {name: load_script(name) for name in builtin_scripts() if "demonstration" in name}
    scene, trials, rows = builtin_scene("farm"), list[Row](), list[Row]()
    for name, script in demonstrations.items():
        for method in METHODS:
            for update in UPDATES:
                rows.append(_one(name, play(script, method, update)))
    for i in range(layouts):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(i,)))
        script = random_script(scene, rng)
        trials += [play(script, method, update, i) for method in METHODS for update in UPDATES]
        report("Playing both ways", (i + 1) / layouts)
    shown = Shown(
        f"One look after a visit, and five looks a second: demonstrations and {layouts} random visits"
    )
    shown.rows = rows + [_summary(trials, method, update) for method in METHODS for update in UPDATES]
    shown.write(out, "live", trials)
    for name, script in demonstrations.items() if film else ():
        for update in UPDATES:
            report(f"Filming {name}", 0.9)
            recorder = ScriptRecorder(replace(script, update=update))
            shown.paths.append(out / f"{name}-{update}.mp4")
            write_mp4(shown.paths[-1], recorder.frames(), FPS)
    return shown


def _arrived(game: FarmGame) -> int:
    """Animals so far that got somewhere: into a building, or to where none stands."""
    return int((game.counters.counted + game.counters.stranded).sum())


def _move(label: str, to: np.ndarray[tuple[int], np.dtype[np.float64]], turn: float = 0.0) -> ScriptedMove:
    return ScriptedMove(label, (float(to[0]), float(to[1])), None, turn, f"The hand moves {label}")


def _one(name: str, trial: Row) -> Row:
    return {
        "play": name,
        "method": trial["method"],
        "update": trial["update"],
        "right labels": f"{trial['accuracy']:.0%}",
        "live less pause": "",
        "animals astray": str(trial["astray"]),
        "of those that arrived": f"{trial['astray'] / max(trial['arrived'], 1):.1%}",
        "seconds interrupted": f"{trial['interrupted_s']:.1f}",
    }


def _summary(trials: list[Row], method: str, update: str) -> Row:
    rows = {u: [t for t in trials if (t["method"], t["update"]) == (method, u)] for u in UPDATES}
    of = rows[update]
    right = column(of, "accuracy")
    return {
        "play": f"{len(of)} random visits",
        "method": method,
        "update": update,
        "right labels": percent(right),
        "live less pause": points(right, column(rows["pause"], "accuracy")) if update == "live" else "",
        "animals astray": number(column(of, "astray"), 1),
        "of those that arrived": percent(column(of, "astray") / np.maximum(column(of, "arrived"), 1)),
        "seconds interrupted": number(column(of, "interrupted_s"), 1),
    }
